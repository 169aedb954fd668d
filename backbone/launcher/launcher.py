"""Launcher: starts core services and mission, keeps both running while the mission is up, and ends them in reverse."""

from __future__ import annotations

import asyncio
import contextlib
import signal
import time
from collections.abc import AsyncIterator
from functools import partial
from pathlib import Path
from typing import ClassVar

import msgspec

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.authentication import SECRET_NAME
from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import Absence, ComponentState, LifeState, LogLevel
from backbone.creator.messages import (
    READY_WITHIN_S,
    ListProcesses,
    NotThePlacer,
    Processes,
    ProcessFell,
    ReviseSpawn,
    SpawnRevised,
)
from backbone.creator.process_keeper import ProcessKeeper
from backbone.errors import BackboneError
from backbone.launcher.awaited_hosts import announce_awaited_hosts, awaited_hosts
from backbone.launcher.core_launches import CORE_POLICY, UpOptions, core_launches
from backbone.launcher.declared_orders import hardware_orders, unit_orders
from backbone.launcher.ending_messages import (
    AwaitLastBranch,
    AwaitMissionEnd,
    EndingQuestion,
    EndMission,
    LastBranchOver,
    MissionEnded,
    MissionEnding,
)
from backbone.launcher.folder_watch import wait_removed
from backbone.launcher.hand_recorders import HandRecorderWatch
from backbone.launcher.health_watch import HealthWatch
from backbone.launcher.last_branch import LastBranch, ends_before
from backbone.launcher.last_run import run_last
from backbone.launcher.messages import AskTree, NotUpYet, TreeChange
from backbone.launcher.mission_recorder import MissionRecorder, absences_of
from backbone.launcher.mission_stop import REASON, MissionStop, stop_consoles, stop_other_hosts
from backbone.launcher.names_keeper import NamesKeeper
from backbone.launcher.other_hosts import OtherHosts
from backbone.launcher.outcome import BringUpObserver, Outcome
from backbone.launcher.preconditions import has_address
from backbone.launcher.tree_keeper import TreeKeeper
from backbone.launcher.wish_keeper import WishKeeper
from backbone.mission.behavior_orders import behavior_orders, last_order
from backbone.mission.model import MissionDescription
from backbone.mission_log.log import AskLog, AskPeople, LogKeeper, PeopleKnown
from backbone.mission_log.operators import OperatorAction, publish_action
from backbone.naming import Subsystem, address, component_of
from backbone.picture.words import starts_line
from backbone.placer.messages import AskDeclared, DeclaredOrder, Start
from backbone.run_files import RunFolderRemoved
from backbone.waiting import end_tasks, first_of
from backbone.wire import Accepts, Envelope, Message


class Launcher(Component[NoParameters]):
    """Starts the core services and the mission, restarts core services, runs the last branch, stops all."""

    drains_within_s = None
    accepts: ClassVar[Accepts | None] = (
        ListProcesses | ReviseSpawn | AskLog | AskPeople | AskDeclared | AskTree | TreeChange | EndingQuestion
    )

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        *,
        keeper: ProcessKeeper,
        description: MissionDescription,
        options: UpOptions,
        observer: BringUpObserver,
        began_s: float,
        recorder: MissionRecorder | None = None,
    ) -> None:
        super().__init__(launch, bus, clock)
        self._recorder = recorder
        self._keeper, self._description, self._options, self._observer = keeper, description, options, observer
        self._began_s = began_s
        self._others = OtherHosts(description, clock.now_s(), options.record, has_address)
        self._wishes = WishKeeper(self, description, self._others, self._newest)
        self._tree = TreeKeeper(
            bus,
            clock,
            description,
            options.text,
            begin_root=self._wishes.begin_root,
            leave_root=self._wishes.leave_root,
            begin=self.start_task,
            note=self.story.note,
        )
        self._health_watch = HealthWatch(bus, clock, self.changed, self._own_absences)
        self._hand_recorders = HandRecorderWatch(bus, clock, self._is_deaf, self._recorder_changed)
        self._log = LogKeeper(bus)
        self.outcome = Outcome()
        self._parts = MissionStop(bus, self.outcome.ended.append)
        self._others_changed = asyncio.Event()
        self._last = LastBranch(description.last)
        self._last_begins, self._last_is_over, self._has_ended = asyncio.Event(), asyncio.Event(), asyncio.Event()
        keeper.on_fell = self._core_service_fell
        keeper.on_silent = self._core_service_silent
        keeper.on_changed = self.changed
        keeper.on_bug = self.fail

    async def connect(self) -> None:
        """Start the recorder, then the core services in order; start each when the one before is ready."""
        self.start_task(self._health_watch.run(), "health")
        if self._recorder is not None:
            self._recorder.on_changed = partial(self._recorder_changed, self._description.name)
            async with self._step("recorder"):
                await self._recorder.begin()
            self.publish_news()
            self.start_task(self._recorder.keep(), "recorder")
        for launch in core_launches(self._description, self.launch, self._options):
            async with self._step(launch.name):
                await self._keeper.start(launch, CORE_POLICY, READY_WITHIN_S)
        self.bus.watch_alive(f"{Subsystem.BACKBONE}/*", self._backbone_changed)
        self._tree.watch()

    async def serve(self) -> None:
        """Start the mission through the placer and keep it running."""
        self.start_task(self._hand_recorders.run(), "recorders by hand")
        if self.launch.run_directory:
            folder = Path(self.launch.run_directory)
            self.start_task(NamesKeeper(self.bus, self.clock, folder).run(), "names")
            self.start_task(self._end_without(folder), "run folder")
        try:
            await self._start_mission()
        except BackboneError as error:
            self.outcome.failure = error
            self.end(f"could not come up: {self.outcome.why_failed}")
            return
        self.outcome.ready_after_s = time.monotonic() - self._began_s
        self.report(f"all ready; at the end: {self._last.name}" if self._last.name else "all ready")
        source = self._description.source
        publish_action(self.bus, self.clock, OperatorAction.START_MISSION, self._description.name, f"from {source}")
        if self._options.for_s is not None:
            self.start_task(self._end_after(self._options.for_s), "end")
        watching = asyncio.create_task(self._observer.up(self.bus, self.clock), name="observer")
        await first_of(watching, self._last_begins.wait())
        if not watching.cancelled():
            watching.result()

    def _newest(self, order: Start) -> Start:
        return self._tree.newest(order)

    def _recorder_changed(self, name: str, what: str) -> None:
        self.publish_event(name, what, LogLevel.WARNING)
        self.changed()
        self.publish_news()  # also before this launcher is ready

    def _is_deaf(self) -> bool:
        return any(absence.name == component_of(NAMESERVER) for absence in self._keeper.absences())

    async def _end_after(self, mission_s: float) -> None:
        await self.clock.sleep_s(mission_s)
        self.end(f"ran for {mission_s:g} s")

    async def _end_without(self, folder: Path) -> None:
        """End at once if the run folder is removed: no command finds the mission then, and no component can join."""
        await wait_removed(folder, self.clock)
        error = self.outcome.failure = RunFolderRemoved(f"{folder} was removed", directory=str(folder))
        self._observer.announce(f"{error}; the mission ends")
        self.publish_event(self._description.name, f"ends: {error}", LogLevel.ALARM)
        self.end(str(error), at_once=True)

    def end(self, reason: str, *, at_once: bool = False) -> None:
        """Run the last branch, then end. Without a branch, at a second order, or if ``at_once``, end now."""
        self.outcome.order = self.outcome.order or reason
        if self._last.ordered(self.clock.now_s(), is_up=self._is_up, at_once=at_once):
            self._last_is_over.set()
            super().end(reason)
        else:
            self._last_begins.set()
            self.start_task(self._run_last(reason), "last branch")

    @property
    def _is_up(self) -> bool:
        return self.state is LifeState.READY and self.outcome.ready_after_s is not None

    def interrupted(self) -> None:
        """End because the operator pressed Ctrl-C."""
        publish_action(self.bus, self.clock, OperatorAction.STOP_MISSION, self._description.name, "Ctrl-C")
        self.end(signal.SIGINT.name)

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``ListProcesses`` for the core services, and questions about log, people, orders, tree and end.

        The RC manager has its next process started with the numbers and places that operators have set.
        """
        match asked.body:
            case ListProcesses():
                return Processes(self.launch.host, [], self._keeper.processes())
            case ReviseSpawn() as revised:
                if (asked.source, revised.name) != (RC_MANAGER, component_of(RC_MANAGER)):
                    raise NotThePlacer(f"{self.name} does not take {revised.name}'s parameters from {asked.source}")
                self._keeper.revise(revised)
                return SpawnRevised()
            case AskLog() as wanted:
                return self._log.log.answer(wanted)
            case AskPeople():
                return PeopleKnown(self._log.log.people.consoles)
            case AskDeclared(name=name):
                return DeclaredOrder(self._declared(name))
            case AskTree():
                return self._tree.tree()
            case change if isinstance(change, TreeChange):
                if self.outcome.ready_after_s is None or self.state is not LifeState.READY or not self._options.text:
                    raise NotUpYet(f"{self._description.name} is coming up or ending")
                return await self._tree.change(change, asked.source)
            case EndMission(at_once=at_once):
                self.end(f"ordered by {component_of(asked.source)}", at_once=at_once)
                told = self._last.doing or awaited_hosts(self._others, self.clock)
                return MissionEnding(told, self._last.within_s if self._last.is_at_work else 0.0)
            case AwaitLastBranch():
                await self._last_is_over.wait()
                return LastBranchOver(self._last.told)
            case AwaitMissionEnd():
                await self._has_ended.wait()
                return MissionEnded(self.outcome.pushed)
        return await super().answer(asked)

    def _declared(self, name: str) -> Start | None:
        parts = [*hardware_orders(self._description), *unit_orders(self._description)]
        return self._tree.order(name) or next((order for order in parts if order.name == name), None)

    def changed(self) -> None:
        """Publish the launcher's state and the mission's health soon."""
        super().changed()
        self._health_watch.notice()

    def component_state(self) -> ComponentState:
        """Return the state; before the services are started, with the recorder that they wait for."""
        state, wanted = super().component_state(), absences_of(self._recorder)
        return msgspec.structs.replace(state, absent=wanted) if self.state is LifeState.CONNECTING else state

    def absences(self) -> list[Absence]:
        """Return the absent core services, components and machines, and the absences of the health watch."""
        return [*self._own_absences(), *self._health_watch.absences()]

    def _own_absences(self) -> list[Absence]:
        core = [msgspec.structs.replace(absence, vital=True) for absence in self._keeper.absences()]
        mission = self._wishes.absences()
        if self.outcome.ready_after_s is None:
            name, doing = self._description.name, self._being_started()
            mission.append(Absence(name, 0.0, "not all of it is ready", doing, is_start=True))
        recorders = [*absences_of(self._recorder), *self._hand_recorders.absences()]
        return [*core, *mission, *self._others.absences(), *recorders]

    def _being_started(self) -> str:
        """Return the components that the start waits for, with their feedback."""
        processes = self._health_watch.picture.processes
        return starts_line({one: processes[one].doing if one in processes else "" for one in self._wishes.awaited})

    async def drain(self) -> None:
        """Stop the mission in reverse order of its start, then the core services except the nameserver."""
        if self._last.told:
            self._observer.announce(self._last.told)
            self.publish_event(self._last.name, self._last.how, LogLevel.NOTICE)
        async with self._step("stop consoles"):
            await stop_consoles(self.bus)
        async with self._step("stop mission"):
            say = announce_awaited_hosts(self._others, self.clock, self._others_changed, self._observer.announce)
            saying = asyncio.create_task(say, name="say what is awaited")
            await self._parts.stop_all(self._tree.description, self._last.name)
            await end_tasks(saying)
        for host in self._others.lost:
            self._observer.announce(f"{host} is out of reach: end a command that still offers it there with Ctrl-C")
        if self._others.offering:
            async with self._step("stop creators of other hosts"):
                for offer in await stop_other_hosts(self.bus, self._others, self._others_changed):
                    say_so = f"{offer} did not confirm its end; a machine that is cut off ends all by itself"
                    self._observer.announce(say_so)
        async with self._step("stop core services"):
            first, *others = (one.name for one in core_launches(self._description, self.launch, self._options))
            for name in reversed(others):
                self.outcome.ended.append(await self._keeper.end(name, REASON))
            self._has_ended.set()  # the bus still sends the answers while the first one ends
            self.outcome.ended.append(await self._keeper.end(first, REASON))

    def _backbone_changed(self, address: str, stands: bool) -> None:
        if self._others.token_changed(address, stands, self.clock.now_s()):
            self.changed()
        self._others_changed.set()

    async def _wait_for_other_hosts(self) -> None:
        """Return as soon as every declared machine has its creator in the mission."""
        say = self._observer.announce
        if self._others.missing:
            say(f"the mission's secret, for its other hosts: {Path(self.launch.run_directory) / SECRET_NAME}")
        for host in self._others.missing:
            say(f"waiting for host {host}; copy the secret there and type: {self._others.command(host)}")
        while self._others.missing:
            await asyncio.gather(*(self._wait_for_host(host) for host in self._others.missing))

    async def _wait_for_host(self, host: str) -> None:
        async with self._step(f"host {host}"):
            while host in self._others.missing:
                self.report(f"waits for host {', '.join(self._others.missing)}")
                self._others_changed.clear()
                await self._others_changed.wait()

    async def _start_mission(self) -> None:
        await self._wait_for_other_hosts()
        description = self._description
        hardware = "simulated world and resource controllers" if description.components else "resource controllers"
        async with self._step(hardware):
            await self._wishes.start_all(hardware_orders(description))
        if description.units:
            async with self._step("execution units"):
                await self._wishes.start_all(unit_orders(description))
        async with self._step("behaviors"):
            await self._wishes.start_all(behavior_orders(description))

    async def _run_last(self, reason: str) -> None:
        """Stop consoles and behaviors, run the last branch, then end."""
        order = last_order(self._tree.description)
        assert order is not None  # noqa: S101  the decision is to run it
        behaviors = ends_before(self._description.types)
        async with self._step("stop consoles"):
            await stop_consoles(self.bus)
        async with self._step("stop behaviors"):
            await self._parts.stop_roots(self._tree.description)
            await self._parts.stop_placed(lambda placed: placed.type in behaviors)
        until_s = self._last.began(self.clock.now_s())
        self.report(self._last.doing)
        self._observer.announce(self._last.doing)
        self.publish_event(order.name, "begins: the mission ends with this branch", LogLevel.NOTICE)
        at = address(Subsystem.MISSION_CONTROL, order.name)
        await run_last(self._last, self.bus, self.clock, at, self._wishes.keep_once(order, at), until_s)
        self.end(reason)

    def _core_service_fell(self, fell: ProcessFell) -> None:
        self.publish_event(fell.name, f"fell, {fell.how}; restarts in {fell.restart_in_s:.2g} s", LogLevel.WARNING)

    def _core_service_silent(self, name: str, silent_s: float) -> None:
        said = f"shows no sign of life for {silent_s:.1f} s" if silent_s else "responds again"
        self.publish_event(name, said, LogLevel.WARNING)
        self.changed()

    @contextlib.asynccontextmanager
    async def _step(self, step: str) -> AsyncIterator[None]:
        self._observer.began(step)
        began_s = time.monotonic()
        yield
        self._observer.done(step, time.monotonic() - began_s)
