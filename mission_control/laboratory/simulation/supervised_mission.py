"""Runs one supervised mission from a seed: real launcher, keepers, creators, placer and owners on simulated machines.

``mission_run`` has message faults and a simulated creator. Here the creator's real decisions run, and the faults
concern processes, links and machines.
"""

from __future__ import annotations

import asyncio
import contextvars
import tempfile
from collections.abc import Callable, Sequence

from backbone.addresses import LAUNCHER
from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Bus, Clock
from backbone.component.launch import Launch
from backbone.creator.messages import ProcessFell
from backbone.creator.process_keeper import ProcessKeeper
from backbone.keys import Conversation
from backbone.launcher.core_launches import CORE_POLICY, UpOptions
from backbone.launcher.launcher import Launcher
from backbone.naming import Subsystem
from backbone.waiting import end_tasks
from backbone.wire import Envelope
from mission_control.laboratory.simulation.audit import Audit, current_audit
from mission_control.laboratory.simulation.hostile_numbers import hostile_message, say_hostile
from mission_control.laboratory.simulation.laws import first_broken
from mission_control.laboratory.simulation.liveness import RUNS_AGAIN_S, Watcher, first_unhealed
from mission_control.laboratory.simulation.mission_run import MissionRun
from mission_control.laboratory.simulation.operator_choices import (
    OPERATOR,
    OperatorChange,
    OtherRules,
    RobotStop,
    carry_out,
    stop_and_lift,
)
from mission_control.laboratory.simulation.shape import MISSION
from mission_control.laboratory.simulation.simulated_links import LinkedNetwork
from mission_control.laboratory.simulation.simulated_machines import Machines, SimulatedZygote, current_machines
from mission_control.laboratory.simulation.simulated_processes import ProcessLoop, SimulatedProcess, run_processes
from mission_control.laboratory.simulation.supervised_shape import CLASSES, SupervisedShape, draw_supervised_shape
from mission_control.laboratory.simulation.supervision_faults import (
    Cut,
    End,
    Hostile,
    Pause,
    Starve,
    SupervisionFault,
    draw_supervision_faults,
    storm_over_s,
)

HUB = "nameserver"
LOOK_EVERY_S = 0.02  # chosen: far below the bring-up time of a mission
UP_WITHIN_S = 60.0  # chosen: virtual time; only forks and settling take virtual time


def run_supervised(seed: int, *, chaos: bool, faults: Sequence[SupervisionFault] | None = None) -> MissionRun:
    """Run the supervised mission of this seed to its end and judge it; the same arguments give the same bytes.

    Args:
        faults: Only these faults, instead of the seed's.
    """
    shape = draw_supervised_shape(seed)
    if faults is None:
        faults = draw_supervision_faults(shape) if chaos else []
    return run_processes(_SupervisedMission(shape, sorted(faults, key=lambda fault: fault.at_s)).run())


class _Observer:
    """Shows nothing, because the audit has all events."""

    def comes_up(self, mission: str) -> None: ...

    def began(self, step: str) -> None:
        """Do nothing."""

    def done(self, step: str, took_s: float) -> None:
        """Do nothing."""

    def announce(self, line: str) -> None:
        """Show nothing."""

    def connected(self, bus: Bus) -> None:
        """Do nothing."""

    async def up(self, bus: Bus, clock: Clock) -> None:  # noqa: ARG002  names of the protocol
        """Wait until the mission ends."""
        await asyncio.Event().wait()


class _SupervisedMission:
    def __init__(self, shape: SupervisedShape, faults: list[SupervisionFault]) -> None:
        self._shape, self._faults = shape, faults
        self._audit, self._clock = Audit(), VirtualClock()
        self._calm_s = max(shape.pool.active_s, storm_over_s(faults))
        self._rules = next((fault for fault in faults if isinstance(fault, OtherRules)), OtherRules())
        self._waiting_ends: dict[str, End] = {}
        self._operator: SimulatedProcess | None = None
        self._saying: list[asyncio.Task[None]] = []

    async def run(self) -> MissionRun:
        loop = asyncio.get_running_loop()
        assert isinstance(loop, ProcessLoop)  # noqa: S101  see run_supervised
        current_audit.set(self._audit)
        self._network = LinkedNetwork(MISSION, HUB)
        self._machines = Machines(loop, self._network, self._audit)
        self._machines.on_begin = self._forked
        current_machines.set(self._machines)
        self._outside = contextvars.copy_context()
        with tempfile.TemporaryDirectory() as folder:
            try:
                await self._live(folder)
            finally:
                await self._machines.end_all()
        happenings = tuple(self._audit.happenings)
        pool = self._shape.pool
        broken = first_unhealed(happenings) or first_broken(
            pool,
            happenings,
            longest_s=RUNS_AGAIN_S + max((fault.over_s - fault.at_s for fault in self._faults), default=0.0),
            others=self._shape.tree_paths(),
            ages=self._rules.aging_s > 0,
        )
        return MissionRun(pool, tuple(self._faults), happenings, self._audit.digest(), broken)

    async def _live(self, folder: str) -> None:
        launcher = await self._begin(folder)
        watcher = Watcher(self._shape, self._machines, self._audit, self._clock)
        observing = self._machines.begin("observer", self._shape.hosts[0])
        bus = observing.run(self._network.join, "ui_console/observer", self._clock)
        for creator in self._shape.groups()[1]:
            bus.subscribe(f"{Subsystem.BACKBONE}/{creator}", Conversation.EVENTS, ProcessFell, self._heard_fall)
        watching = asyncio.get_running_loop().create_task(watcher.watch(bus), context=observing.context)
        for fault in self._faults:
            await self._clock.sleep_until_s(fault.at_s)
            self._strike(fault)
        await self._clock.sleep_until_s(self._calm_s)
        self._audit.note("mission", "calm")
        await self._clock.sleep_until_s(self._calm_s + RUNS_AGAIN_S)
        watcher.judge_calm()
        self._audit.note("mission", "over")
        await asyncio.gather(*self._saying)
        await end_tasks(watching)
        await end_tasks(launcher)
        if watching.done() and not watching.cancelled() and (bug := watching.exception()) is not None:
            raise bug

    # Bring-up is as in ``bring_up.run_mission``.
    async def _begin(self, folder: str) -> asyncio.Task[None]:
        """Return the launcher's task when the whole mission is ready."""
        own = self._launch("launcher", "", folder)
        process = self._machines.begin(own.name, own.host)
        ready: asyncio.Future[Launcher] = asyncio.get_running_loop().create_future()
        work = self._launcher_life(own, process, ready)
        living = asyncio.get_running_loop().create_task(work, name=own.name, context=process.context)
        async with asyncio.timeout(UP_WITHIN_S):
            launcher = await ready
            while launcher.outcome.ready_after_s is None:
                if living.done() or launcher.outcome.failure is not None:
                    raise launcher.outcome.failure or RuntimeError("the launcher ended")
                await self._clock.sleep_s(LOOK_EVERY_S)
        self._audit.note("mission", "up")
        return living

    async def _launcher_life(self, own: Launch, process: SimulatedProcess, ready: asyncio.Future[Launcher]) -> None:
        keeper = ProcessKeeper(SimulatedZygote(self._machines), self._clock, self._machines.vitals, process.pid)
        hub = self._launch(HUB, CLASSES[HUB], own.run_directory)
        await keeper.start_hub(hub, CORE_POLICY)
        await self._network.links[process].usable.wait()
        bus = self._network.join(own.address, self._clock)
        keeper.use(bus)
        await keeper.wait_ready(hub.name, UP_WITHIN_S)
        launcher = Launcher(
            own,
            bus,
            self._clock,
            keeper=keeper,
            description=self._shape.description(self._rules.parameters()),
            options=UpOptions(),
            observer=_Observer(),
            began_s=0.0,
        )
        launcher.pid = launcher.start_number = process.pid
        self._machines.lives[process] = launcher
        keeper.on_fell = self._note_also(keeper.on_fell)
        ready.set_result(launcher)
        await launcher.run()

    def _launch(self, name: str, class_path: str, folder: str) -> Launch:
        return Launch(
            mission=MISSION,
            subsystem=Subsystem.BACKBONE,
            name=name,
            type=name,
            class_path=class_path,
            host=self._shape.hosts[0],
            endpoint="",
            clock_origin_monotonic_s=0.0,
            clock_rate=1.0,
            requester=LAUNCHER,
            run_directory=folder,
        )

    def _note_also(self, listener: Callable[[ProcessFell], None]) -> Callable[[ProcessFell], None]:
        def note_and_call(fell: ProcessFell) -> None:
            self._note_fall(fell)
            listener(fell)

        return note_and_call

    def _heard_fall(self, heard: Envelope[ProcessFell]) -> None:
        self._note_fall(heard.body)

    def _note_fall(self, fell: ProcessFell) -> None:
        self._audit.note(fell.name, "fell", how=fell.how)

    def _strike(self, fault: SupervisionFault) -> None:
        self._audit.note("mission", "fault", fault=str(fault))
        match fault:
            case OtherRules():  # in force since the bring-up
                return
            case OperatorChange() | RobotStop():
                self._operate(fault)
                return
            case Starve(target=host, gap_s=gap_s):
                self._machines.starve(host, fault.over_s, gap_s)
                return
            case Cut(target=host) if host in self._shape.hosts:
                self._network.cut_host(host)
                self._later(fault.over_s, lambda: self._network.heal_host(host))
                return
            case _:
                process = self._machines.find(fault.target)
        if process is None:
            return
        match fault:
            case Pause():
                for name in self._machines.names(process):
                    self._audit.note(name, "paused", lasts_s=fault.lasts_s)
                process.pause()
                self._network.pause(process)
                self._later(fault.over_s, lambda: self._go_on(process))
            case Cut():
                self._network.cut(process)
                self._later(fault.over_s, lambda: self._network.heal(process))
            case End():
                if fault.again_after_s >= 0:
                    self._waiting_ends[process.name] = fault
                self._end(process, fault)
            case Hostile(number=number):
                self._say_hostile(fault.target, number)

    def _say_hostile(self, target: str, number: int) -> None:
        message = hostile_message(self._shape, target, number)
        stranger = self._machines.begin("stranger", self._shape.hosts[0])
        saying = say_hostile(message, self._network.join, self._clock, self._audit)
        self._saying.append(asyncio.get_running_loop().create_task(saying, context=stranger.context))

    def _operate(self, choice: OperatorChange | RobotStop) -> None:
        if self._operator is None:
            self._operator = self._machines.begin("operator", self._shape.hosts[0])
        bus = self._operator.run(self._network.join, OPERATOR, self._clock)
        work = (
            carry_out(choice, bus, self._audit)
            if isinstance(choice, OperatorChange)
            else stop_and_lift(choice, bus, self._clock, self._audit)
        )
        self._saying.append(asyncio.get_running_loop().create_task(work, context=self._operator.context))

    def _go_on(self, process: SimulatedProcess) -> None:
        if not process.is_dead:
            process.go_on()
            self._network.go_on(process)

    def _end(self, process: SimulatedProcess, fault: End) -> None:
        life = self._machines.lives.get(process)
        if process.is_dead or process not in self._machines.lives:
            return
        if fault.how == "killed" or life is None:
            self._machines.kill(process)
        else:
            process.run(asyncio.get_running_loop().call_soon, life.end, "ended from outside")

    def _forked(self, process: SimulatedProcess) -> None:
        fault = self._waiting_ends.pop(process.name, None)
        if fault is not None:
            self._later(self._clock.now_s() + fault.again_after_s, lambda: self._end(process, fault))

    def _later(self, at_s: float, act: Callable[[], None]) -> None:
        loop = asyncio.get_running_loop()
        loop.call_at(at_s, act, context=self._outside.copy())
