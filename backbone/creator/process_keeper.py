"""Process keeper: carries out the decisions of ``supervision`` with a zygote, and reports events from zygote and bus.

A component that shares a process is not forked but admitted to that process over the bus, as ``shared_processes``
decides. Creators use a keeper for the placer's orders, the launcher uses one for the core services.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine
from typing import assert_never

import msgspec

from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.component.heartbeat import WRITE_STACKS, forget_heartbeat, read_vitals
from backbone.component.launch import Launch
from backbone.component.membership import PROCESSES, read_process_address
from backbone.component.messages import Absence, Stop, Stopping
from backbone.creator.alarm import Alarm
from backbone.creator.decisions import (
    AskToStop,
    ForkComponent,
    Instruction,
    ReportEnded,
    ReportFell,
    ReportLeft,
    ReportReady,
    ReportSilent,
    ReportStartFailed,
    SendSignal,
    SupervisionWakesAt,
)
from backbone.creator.failed_starts import cause_of_end, log_of
from backbone.creator.kept_components import Kept, KeptComponents, Report, as_spawn
from backbone.creator.messages import (
    READY_WITHIN_S,
    EndProcess,
    NotHere,
    ProcessEnded,
    ProcessFell,
    ProcessState,
    RestartPolicy,
    ReviseSpawn,
    Spawn,
    StartFailed,
)
from backbone.creator.shared_process_keeper import SharedProcessKeeper
from backbone.creator.signs_of_life import ReadVitals, Sign, SignsOfLife
from backbone.creator.silence import LOOK_EVERY_S
from backbone.creator.supervision import Phase, Supervision
from backbone.creator.zygote import Forks, NoProcess
from backbone.errors import BackboneError
from backbone.incarnation import random_start
from backbone.naming import IllegalName, component_of
from backbone.waiting import end_tasks

log = logging.getLogger(__name__)

OVERLAP_S = 0.3  # chosen: ten times longer than a component takes to end; a slower one delays no other
_DEFAULTS = EndProcess("")


class ProcessKeeper:
    """Starts, watches, restarts and ends processes. Use it inside one event loop.

    Args:
        zygote: Forks the processes; the keeper sets its ``on_exit``, the caller closes it.
        clock: Clock of back-off and deadlines, which are in seconds of the machine; None: the machine's own.
        read_vitals: Reads the vitals of a process, given run directory and pid; see ``heartbeat.read_vitals``.
        start: Start of the keeper's incarnation, which is part of each that it starts; 0: a random number.

    Attributes:
        on_fell: Called when a process ended unexpectedly.
        on_silent: Called with name and seconds when a process shows no sign of life, and with 0 when it responds again.
        on_changed: Called after every change of ``processes()``.
        on_bug: Called with each exception that is a bug.
    """

    def __init__(
        self, zygote: Forks, clock: Clock | None = None, read_vitals: ReadVitals = read_vitals, start: int = 0
    ) -> None:
        self.on_fell: Callable[[ProcessFell], None] = _ignore
        self.on_silent: Callable[[str, float], None] = _ignore
        self.on_changed: Callable[[], None] = lambda: None
        self.on_bug: Callable[[BaseException], None] = _report_to_loop
        self._zygote, self._clock = zygote, clock or MissionClock.started_now()
        self._bus: Bus | None = None
        self._supervision = Supervision()
        self._shared = SharedProcessKeeper(
            zygote,
            self._clock,
            self._supervision,
            launch_of=lambda name: self._kept[name].launch,
            report=self._carry_out,
            task=self._task,
        )
        self._kept = KeptComponents()
        self._tasks: set[asyncio.Task[None]] = set()
        self._signs = SignsOfLife(read_vitals)
        self._zygote_trouble, self._zygote_trouble_since_s, self._zygote_busy_s = "", 0.0, 0.0
        self._looking: asyncio.Task[None] | None = None
        self._alarm = Alarm(self._clock, self._task, self._woken, "supervision's alarm")
        self._is_closing = False
        self._lives, self._start = 0, start or random_start()
        zygote.on_exit = self._exited

    def use(self, bus: Bus) -> None:
        """Use this bus from now on to watch for readiness and to ask processes to stop."""
        self._bus = bus
        self._shared.use(bus)
        bus.watch_alive("*/*", self._token_changed)
        bus.watch_alive(PROCESSES, self._process_token_changed)

    # Start
    async def start(
        self, launch: Launch, policy: RestartPolicy, ready_within_s: float, order: Spawn | None = None
    ) -> int:
        """Start the component and return its pid when it is ready.

        Args:
            ready_within_s: Silence, seconds of the machine, after which a start has failed.
            order: Order that ``processes()`` returns; None: made from the other arguments.

        Raises:
            StartFailed: It did not become ready, and its whole process tree has ended.
            AlreadyHere: A component of this name runs, starts or ends here.
        """
        self._begin(launch, order or as_spawn(launch, policy, ready_within_s), is_hub=False)
        return await self._kept.wait_ready(launch.name)

    async def start_hub(self, launch: Launch, policy: RestartPolicy) -> int:
        """Start the process of the hub and return its pid; its readiness can be seen only after ``use``.

        Raises:
            StartFailed: The system refused a process.
            AlreadyHere: A component of this name runs, starts or ends here.
        """
        forked: asyncio.Future[int] = asyncio.get_running_loop().create_future()
        self._begin(launch, as_spawn(launch, policy, READY_WITHIN_S), is_hub=True, forked=forked)
        return await forked

    async def wait_ready(self, name: str, within_s: float) -> int:
        """Return the pid of a started component when it is ready.

        Raises:
            StartFailed: It ended, or was not ready within that many seconds of the machine.
            NotHere: No component of this name was started.
        """
        one = self._supervision.find(name)
        if one is None:
            raise self._kept.failure(name) or NotHere(f"no component {name} runs here", name=name)
        if one.end is not None:
            raise self._kept.failed(name, f"is {one.phase}; {one.last_end}")
        if one.phase is Phase.READY:
            return one.pid
        try:
            async with asyncio.timeout(within_s):
                return await self._kept.wait_ready(name)
        except TimeoutError:
            raise self._kept.failed(name, f"was not ready within {within_s:g} s") from None

    def revise(self, revised: ReviseSpawn) -> None:
        """Start the component as revised from its next start on; its running process stays as it is.

        Raises:
            NotHere: No component of this name is here.
        """
        self._kept.revise(revised)

    # End
    async def end(
        self, name: str, reason: str = "", ask_s: float = _DEFAULTS.ask_s, term_s: float = _DEFAULTS.term_s
    ) -> ProcessEnded:
        """End the component's whole process tree: ask, then SIGTERM, then SIGKILL; return when the tree has ended.

        Args:
            reason: Reason, for the component's story.
            ask_s: Seconds of the machine from the request to SIGTERM.
            term_s: Seconds of the machine from SIGTERM to SIGKILL.

        Raises:
            NotHere: No component of this name is here.
        """
        instructions = self._supervision.end_ordered(name, ask_s, term_s, self._now_s())
        self._kept[name].end_reason = reason
        ended = self._kept.ended(name)
        self._carry_out(instructions)
        return await ended

    async def close(self) -> list[ProcessEnded]:
        """End all components, the last started first, and return how each ended. Later starts are refused.

        A component is asked after all components that started later have ended, or after ``OVERLAP_S``.
        """
        self._is_closing = True
        ends = []
        for name in reversed([one.name for one in self._supervision]):
            ends.append(asyncio.create_task(self._end_if_here(name), name=f"end {name}"))
            await asyncio.wait(ends[-1:], timeout=OVERLAP_S)
        ended = [end for end in await asyncio.gather(*ends) if end is not None]
        await end_tasks(*self._tasks)
        return ended

    async def _end_if_here(self, name: str) -> ProcessEnded | None:
        try:
            return await self.end(name, "everything ends")
        except NotHere:  # it ended by itself meanwhile
            return None

    # Picture
    def order(self, name: str) -> Spawn | None:
        """Return the order of the component of this name, None if there is none."""
        kept = self._kept.get(name)
        return kept.order if kept else None

    def processes(self) -> list[ProcessState]:
        """Return the kept components, in the order of their starts."""
        return [
            ProcessState(
                self._kept[one.name].order,
                one.pid,
                one.restarts,
                one.last_end,
                one.silent_s,
                "" if one.phase is Phase.READY else self._signs.doing(one.pid),
            )
            for one in self._supervision
        ]

    def absences(self) -> list[Absence]:
        """Return the kept components that do not run or respond; times in mission seconds."""
        rate, now_s = self._clock.rate, self._now_s()
        absent = [
            msgspec.structs.replace(absence, since_s=absence.since_s * rate)
            for absence in self._supervision.absences(now_s)
        ]
        if self._zygote_trouble:
            name = f"zygote of {component_of(self._bus.source)}" if self._bus is not None else "zygote"
            doing = "it is continued; new processes wait for it"
            absent.append(Absence(name, self._zygote_trouble_since_s * rate, self._zygote_trouble, doing))
        return absent

    # Events
    def _begin(self, launch: Launch, order: Spawn, *, is_hub: bool, forked: asyncio.Future[int] | None = None) -> None:
        name = launch.name
        if self._is_closing:
            raise StartFailed(f"{name}: everything here is being ended", name=name)
        instructions = self._supervision.start_ordered(
            name, order.policy, order.ready_within_s, self._now_s(), asked_by_signal=is_hub
        )
        self._kept.begin(launch, order)
        if self._looking is None and launch.run_directory:
            self._looking = self._task(self._look_for_life(launch.run_directory), "look for signs of life")
        self._carry_out(instructions, forked)

    def _token_changed(self, address: str, stands: bool) -> None:
        name = component_of(address)
        kept = self._kept.get(name)
        if stands and kept is not None and kept.launch.address == address:
            self._carry_out(self._supervision.ready(name))

    def _process_token_changed(self, address: str, stands: bool) -> None:
        try:
            host, process, pid = read_process_address(address)
        except IllegalName as illegal:  # a token of an unknown client must not end the creator
            log.info("ignored: %s", illegal.detail)
            return
        if stands and any((k.launch.host, k.launch.process) == (host, process) for k in self._kept.values()):
            self._shared.serving(process, pid)

    async def _look_for_life(self, run_directory: str) -> None:
        while True:
            await self._clock.sleep_s(LOOK_EVERY_S * self._clock.rate)
            now_s = self._now_s()
            pids = {one.pid for one in self._supervision if one.pid} | self._shared.pids()
            before_s, self._zygote_busy_s = self._zygote_busy_s, self._zygote.busy_s()
            unreported_s = max(0.0, self._zygote_busy_s - before_s)  # it reports an end when it has time for it
            for sign in self._signs.look(run_directory, pids, now_s):
                if sign.hangs:
                    self._zygote.kill(sign.pid, WRITE_STACKS)
                self._observed(sign, now_s, max(sign.late_s, unreported_s))
            trouble = self._zygote.keep_running()
            if trouble != self._zygote_trouble:
                self._zygote_trouble, self._zygote_trouble_since_s = trouble, now_s
                self.on_changed()

    def _observed(self, sign: Sign, now_s: float, late_s: float) -> None:
        self._shared.observed(sign.pid, sign.silent_s, now_s, late_s)
        for one in [one for one in self._supervision if one.pid == sign.pid]:
            if sign.beats or one.phase is not Phase.READY:  # a ready process without a beat could not create its file
                self._carry_out(self._supervision.observed(one.name, sign.silent_s, now_s, late_s))

    def _exited(self, pid: int, returncode: int) -> None:
        self._signs.forget(pid)
        if self._kept:
            forget_heartbeat(next(iter(self._kept.values())).launch.run_directory, pid)
        if not self._shared.has(pid):
            name = next((one.name for one in self._supervision if one.pid == pid), "")
            cause = cause_of_end(self._kept.launch_of(name), pid, returncode)
            self._carry_out(self._supervision.exited(pid, returncode, self._now_s(), cause))
            return
        self._shared.exited(pid, returncode)

    async def _fork(self, launch: Launch, forked: asyncio.Future[int] | None) -> None:
        name = launch.name
        try:
            pid = await self._zygote.fork(launch)
        except Exception as error:
            self._carry_out(self._supervision.fork_failed(name, str(error), self._now_s()))
            if forked is not None and not forked.done():
                forked.set_exception(self._kept.failure(name) or self._kept.failed(name, str(error)))
            if isinstance(error, NoProcess):
                return
            raise  # a bug, after the supervision knows that the component did not start
        if forked is not None and not forked.done():
            forked.set_result(pid)
        self._carry_out(self._supervision.forked(name, pid, self._now_s()))

    async def _ask_to_stop(self, kept: Kept, within_s: float) -> None:
        try:
            if self._bus is None:
                raise NoProcess("there is no bus for the request")
            stop = Stop(kept.end_reason, kept.launch.incarnation)
            await self._bus.ask(kept.launch.address, stop, Stopping, within_s=within_s)
        except BackboneError as error:
            log.info("%s could not be asked to stop: %s", kept.launch.name, error)
            self._carry_out(self._supervision.ask_failed(kept.launch.name, self._now_s()))

    def _woken(self) -> None:
        self._carry_out(self._supervision.woken(self._now_s()))

    # Instructions
    def _carry_out(self, instructions: list[Instruction], forked: asyncio.Future[int] | None = None) -> None:
        for instruction in instructions:
            match instruction:
                case ForkComponent(name=name):
                    self._begin_life(self._kept[name], forked)
                case AskToStop(name=name, within_s=within_s):
                    self._task(self._ask_to_stop(self._kept[name], within_s), f"ask {name} to stop")
                case SendSignal(name=name, number=number) if self._kept[name].launch.process:
                    self._shared.signalled(name, number)
                case SendSignal(name=name, pid=pid, number=number):
                    log.info("%s to %s, pid %d", number.name, name, pid)
                    self._zygote.kill(pid, number)
                case ReportReady() | ReportStartFailed() | ReportEnded() | ReportLeft() | ReportFell():
                    self._kept.settle(instruction)
                    self._tell(instruction)
                case ReportSilent(name=name, silent_s=silent_s):
                    self.on_silent(name, silent_s)
                case SupervisionWakesAt(at_s=at_s):
                    self._alarm.set(at_s)
                case _:
                    assert_never(instruction)
        if any(not isinstance(each, SupervisionWakesAt | AskToStop | SendSignal) for each in instructions):
            self._kept.retain([one.name for one in self._supervision])
            self.on_changed()

    def _tell(self, report: Report) -> None:
        match report:
            case ReportLeft(name=name):
                log.info("%s ended by itself in good order", name)
            case ReportFell(name=name, how=how, restart_in_s=restart_in_s, failing=failing):
                self.on_fell(ProcessFell(name, how, restart_in_s, log_of(self._kept.launch_of(name)), failing))

    def _begin_life(self, kept: Kept, forked: asyncio.Future[int] | None) -> None:
        self._lives += 1
        launch = kept.launch
        incarnation = f"{launch.host}.{self._start}.{self._lives}"
        launch = kept.launch = msgspec.structs.replace(launch, incarnation=incarnation)
        if launch.process:
            self._shared.wanted(launch)
        else:
            self._task(self._fork(launch, forked), f"fork {launch.name}")

    def _task(self, work: Coroutine[object, None, None], name: str) -> asyncio.Task[None]:
        task = asyncio.create_task(work, name=name)
        self._tasks.add(task)
        task.add_done_callback(self._task_done)
        return task

    def _task_done(self, task: asyncio.Task[None]) -> None:
        self._tasks.discard(task)
        if not task.cancelled() and (bug := task.exception()) is not None:
            self.on_bug(bug)

    def _now_s(self) -> float:
        return self._clock.now_s() / self._clock.rate


def _ignore(*_event: object) -> None:
    """Default listener: ignore the event."""


def _report_to_loop(bug: BaseException) -> None:
    asyncio.get_running_loop().call_exception_handler({"message": "bug in a process keeper", "exception": bug})
