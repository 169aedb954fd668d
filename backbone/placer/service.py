"""The placer: starts and stops all components that are no core services.

The component database admits a start, the book chooses its host, and the creator of that host carries it out. If an
order gets no answer, the placer asks the creator whether it was carried out. So no component is started twice.

Source: S000, "component placer": all components ask it; it asks the creator of the chosen host.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from contextlib import AsyncExitStack
from enum import Enum
from functools import partial
from itertools import chain, repeat
from typing import Any, assert_never

from backbone.addresses import COMPONENT_DATABASE, NAMESERVER
from backbone.bus.interface import Bus, Clock, Subscription
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import Absence, ComponentState, LifeState
from backbone.component_database.messages import Admit, Admitted, ComponentType, Multiplicity
from backbone.creator.messages import (
    CUT_OFF_ENDS_WITHIN_S,
    START_MOST_S,
    EndedBy,
    EndProcess,
    HostLoad,
    ListProcesses,
    NotHere,
    ProcessEnded,
    Processes,
    ProcessFell,
    RestartPolicy,
    Spawn,
    Spawned,
    StartFailed,
    creator_name,
)
from backbone.creator.messages import TYPE as CREATOR
from backbone.errors import LinkError, NoResponder, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import (
    RECONNECT_S,
    Appeared,
    Components,
    Disappeared,
    ListComponents,
    Resolve,
    Resolved,
    UnknownName,
)
from backbone.naming import Subsystem, component_of, legal
from backbone.placer.messages import (
    AskPlacement,
    CreatorSilent,
    Ended,
    ListPlacements,
    NoHost,
    NotPlaced,
    Placements,
    PlacerQuestion,
    Start,
    Started,
    StopComponent,
    StoppedMeanwhile,
)
from backbone.placer.placement_book import (
    EndOrphan,
    Inspect,
    Instruction,
    Note,
    PlaceAgain,
    PlacementBook,
    PlacementPhase,
    PlacementRecord,
)
from backbone.wire import Envelope, Message, UnknownMessage

ANSWER_EACH_S, ANSWER_WITHIN_S = 1.0, 5.0  # chosen: a killed core service is back within one second
SPAWN_WITHIN_S = START_MOST_S + 5.0  # chosen: a creator's limit and a moment; silence ends a start long before
END_MARGIN_S = 5.0  # chosen: the same for ends
CREATOR_BACK_S = 5.0  # chosen: a killed creator is back within one second
OLD_LIFE_S = 5.0  # chosen: longer than any lease that keeps tokens of a lost host's components
LEAVING = (LifeState.DRAINING, LifeState.STOPPED, LifeState.FAILED)
SPAWN_TRIES = 3  # chosen: two creators may die for other reasons; a third dies of the order
AGAIN_PAUSES_S = (0.0, 0.25, 0.5, 1.0, 2.0, 5.0)  # chosen: before each try to place a missing component again
COMPARE_EVERY_S = 5.0  # chosen: wishes without an owner are rare: the owner and the placer died at the same time


class Fate(Enum):
    """Outcome of an order that was not answered."""

    DONE = "done"
    NOT_DONE = "not done"
    HOST_LOST = "host lost"
    UNKNOWN = "unknown"


class Placer(Component[NoParameters]):
    """Places components, and places them again when they are missing."""

    accepts = PlacerQuestion

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._book = PlacementBook()
        self._queue: asyncio.Queue[Callable[[], None]] = asyncio.Queue()
        self._something_happened = asyncio.Event()
        self._meeting: dict[str, int] = {}
        self._newest: dict[str, int] = {}
        self._inspecting: set[str] = set()
        self._ears: dict[str, list[Subscription]] = {}
        self._type_locks: dict[str, asyncio.Lock] = {}
        self._starts = self._refused = self._again = self._stops = self._orphans = 0

    # ------------------------------------------------------------------ life
    async def connect(self) -> None:
        """Recovery: collect the processes of all creators before the first question can arrive."""
        self.bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._component_changed)
        found = await self._creators()
        await asyncio.gather(*(self._meet(creator) for creator in found.components))
        self.bus.watch_alive(NAMESERVER, self._nameserver_changed)

    async def serve(self) -> None:
        """Carry out the queued work, and stop components without an owner."""
        self.start_task(self._stop_ownerless(), "stop ownerless")
        while True:
            begin = await self._queue.get()
            begin()

    async def answer(self, asked: Envelope[Any]) -> Message:
        """Answer ``Start``, ``StopComponent``, ``AskPlacement`` and ``ListPlacements``."""
        match asked.body:
            case Start() as order:
                return await self._start(order, asked.source)
            case StopComponent(name=name, reason=reason):
                return await self._stop(name, reason or f"asked by {asked.source}")
            case AskPlacement(name=name):
                record = self._book.record(name)
                if record.unwanted:
                    raise NotPlaced(f"{name} is being stopped", name=name, stopped=True)
                return record.placement()
            case ListPlacements():
                return Placements([record.placement() for record in self._book.records()], self._book.stopped())
            case other:
                raise UnknownMessage(f"{type(other).__name__} is not answered here")

    def absences(self) -> list[Absence]:
        """Return the wanted components that have no host now."""
        return self._book.absences()

    def statistics(self) -> dict[str, float]:
        """Return counts of hosts, placements, starts and stops."""
        records, hosts = self._book.records(), self._book.hosts()
        return {
            "hosts": float(len(hosts)),
            "hosts_alive": float(sum(host.alive for host in hosts)),
            "placements": float(len(records)),
            "placements_waiting": float(sum(record.phase is PlacementPhase.WAITING for record in records)),
            "starts": float(self._starts),
            "starts_refused": float(self._refused),
            "placed_again": float(self._again),
            "stops": float(self._stops),
            "orphans_ended": float(self._orphans),
        }

    # ------------------------------------------------------------------ start
    async def _start(self, order: Start, requester: str) -> Started:
        name = order.name or self._book.number(order.type)
        self._starts += 1
        try:
            return await self._start_as(legal(name), order, requester)
        except Refusal as refusal:
            self._refused += 1
            self.story.note(name, f"was not started: {refusal.detail}")
            raise

    async def _start_as(self, name: str, order: Start, requester: str) -> Started:
        async with AsyncExitStack() as alone:
            await alone.enter_async_context(self._type_locks.setdefault(order.type, asyncio.Lock()))
            component_type = await self._admit(order.type, name)
            self._book.refuse_second(component_type, name)
            if component_type.multiplicity is Multiplicity.MANY:
                await alone.aclose()
            record = self._book.reserve(_spawn(name, order, component_type, requester), order.host, self.clock.now_s())
            try:
                return await self._bring_up(record)
            except Refusal:
                if record.phase is PlacementPhase.STARTING:
                    self._book.forget(name)
                    self._tell_news()
                raise

    async def _admit(self, type_name: str, name: str) -> ComponentType:
        try:
            admitted = await ask_until_answered(
                self.bus,
                self.clock,
                COMPONENT_DATABASE,
                Admit(type_name, name),
                Admitted,
                each_s=ANSWER_WITHIN_S,
                within_s=ANSWER_WITHIN_S,
            )
        except LinkError as error:
            raise NoHost(f"{name}: the component database does not admit it: {error}", name=name) from error
        return admitted.component_type

    async def _bring_up(self, record: PlacementRecord) -> Started:
        """Start the component on a host and return when it is ready.

        Raises:
            Refusal: It does not run; the record stays STARTING, or RUNNING and suspect if the outcome is unknown.
        """
        name = record.spawn.name
        await self._unfenced(record)
        for tries_left in reversed(range(SPAWN_TRIES)):
            await self._choose(record)
            if record.phase is not PlacementPhase.STARTING:  # it returned with a host that was only cut off
                return _started(record)
            self.story.note(name, f"goes to {record.host}: {'; '.join(record.reasons)}")
            spawn = record.spawn
            try:
                spawned = await self.bus.ask(_creator(record.host), spawn, Spawned, within_s=SPAWN_WITHIN_S)
                pid = spawned.pid
            except StartFailed as refusal:
                self._refuse_unwanted(record)
                if self._book.is_alive(record.host) or not tries_left:
                    raise
                self.story.note(name, f"was ended with {record.host}: {refusal.detail}")
                continue
            except LinkError as error:
                self.story.note(name, f"was ordered on {record.host} without an answer: {error}")
                fate, pid = await self._fate_of_spawn(record)
                if fate is Fate.HOST_LOST:
                    await self._unfenced(record)
                    if self._book.is_alive(record.host):  # it was only cut off, and may have started it
                        fate, pid = await self._fate_of_spawn(record)
                self._refuse_unwanted(record)
                lost = fate is Fate.HOST_LOST or (fate is Fate.NOT_DONE and isinstance(error, NoResponder))
                if lost and tries_left:
                    continue
                if fate is not Fate.DONE:
                    raise self._silent(record, fate, error) from error
            if record.unwanted:
                await self._end_on(record.host, name, "was stopped while it started")
                self._refuse_unwanted(record)
            self._book.started(name, pid, self.clock.now_s())
            self.story.note(name, f"is ready on {record.host}, pid {pid}")
            break
        return _started(record)

    async def _unfenced(self, record: PlacementRecord) -> None:
        """Return when no silent host can run the component any more, or when it has returned with its host."""
        name = record.spawn.name
        while record.phase is PlacementPhase.STARTING and not record.unwanted:
            until_s = self._book.fenced_until_s(name, self.clock.now_s())
            if until_s is None:
                return
            record.doing = "waits until the silent host has ended it"
            await self._news_or(until_s)

    async def _choose(self, record: PlacementRecord) -> None:
        """Choose a host unless the component has returned; wait a while if only a creator's return makes one possible.

        Raises:
            NoHost: No host is possible.
        """
        name, until_s = record.spawn.name, self.clock.now_s() + CREATOR_BACK_S * self.clock.rate
        while record.phase is PlacementPhase.STARTING:
            self._refuse_unwanted(record)
            try:
                self._book.choose(name, self.clock.now_s())
            except NoHost as refusal:
                if not (self._meeting or self._book.may_find_host(name)) or self.clock.now_s() >= until_s:
                    raise
                self.story.note(name, f"waits for a creator: {refusal.detail}")
                await self._news_or(until_s)
            else:
                return

    def _refuse_unwanted(self, record: PlacementRecord) -> None:
        if record.unwanted:
            raise StoppedMeanwhile(f"{record.spawn.name} was stopped before it had started")

    async def _fate_of_spawn(self, record: PlacementRecord) -> tuple[Fate, int]:
        """Ask the creator for the outcome of an unanswered order, and for the pid if the component is ready.

        If only the answer was lost, the component still becomes ready, and this method waits for it.
        """
        until_s = self.clock.now_s() + SPAWN_WITHIN_S * self.clock.rate
        while True:
            answered = await self._ask_processes(record.host)
            if answered is None:
                return (Fate.UNKNOWN if self._book.is_alive(record.host) else Fate.HOST_LOST), 0
            mine = [one for one in answered.processes if one.spawn.name == record.spawn.name]
            if not mine:
                return Fate.NOT_DONE, 0
            if mine[0].pid and await self._is_ready(record.spawn.name):
                return Fate.DONE, mine[0].pid
            if self.clock.now_s() >= until_s:
                return Fate.UNKNOWN, 0
            await self._news_or(min(until_s, self.clock.now_s() + ANSWER_EACH_S * self.clock.rate))

    def _silent(self, record: PlacementRecord, fate: Fate, error: LinkError) -> CreatorSilent:
        name, host = record.spawn.name, record.host
        if fate in (Fate.NOT_DONE, Fate.HOST_LOST):
            return CreatorSilent(f"{name}: {error}; it does not run on {host}", name=name, outcome="not_running")
        self._book.unsure(name, self.clock.now_s())
        return CreatorSilent(f"{name}: {error}; whether it runs on {host} is unknown", name=name, outcome="unknown")

    async def _is_ready(self, name: str) -> bool:
        try:
            resolved = await ask_until_answered(
                self.bus,
                self.clock,
                NAMESERVER,
                Resolve(name),
                Resolved,
                each_s=ANSWER_EACH_S,
                within_s=ANSWER_WITHIN_S,
            )
        except (UnknownName, LinkError):
            return False
        return resolved.component.state is LifeState.READY

    # ------------------------------------------------------------------ stop
    async def _stop(self, name: str, reason: str) -> Ended:
        record = self._book.record(name)
        record.unwanted = True
        self.story.note(name, f"is to be stopped: {reason}")
        self._tell_news()
        host = record.host
        try:
            by = await self._end_on(host, name, reason) if host else EndedBy.ITSELF
        except CreatorSilent:
            record.unwanted = False
            raise
        if record.phase is PlacementPhase.STARTING:
            await self._start_left_off(record)
        found = self._book.find(name)
        if found is None or found is record:
            self._book.stop_ordered(name, reason)
        self._stops += 1
        self.story.note(name, f"is stopped, by {by}")
        self._stop_owned(record.address, f"its owner {name} was stopped")
        self.changed()
        return Ended(name, by)

    def _stop_owned(self, owner: str, reason: str) -> None:
        """Stop this owner's components, because an owner's wishes end with the owner."""
        for name in self._book.owned_by(owner):
            self.start_task(self._stop_quietly(name, reason), f"stop {name}")

    async def _stop_quietly(self, name: str, reason: str) -> None:
        try:
            await self._stop(name, reason)
        except Refusal as refusal:
            self.story.note(name, f"could not be stopped: {refusal.detail}")

    async def _stop_ownerless(self) -> None:
        """Stop the components of decision processes that are neither wanted nor alive; repeat for ever."""
        suspects: set[str] = set()
        while True:
            await self.clock.sleep_s(COMPARE_EVERY_S * self.clock.rate)
            owners = set(self._book.ownerless())
            if owners & suspects:
                try:
                    there = await self.bus.ask(NAMESERVER, ListComponents(), Components, within_s=ANSWER_EACH_S)
                except LinkError:
                    continue
                owners -= {component.address for component in there.components} if there.complete else owners
                for owner in owners & suspects:
                    self._stop_owned(owner, f"its owner {owner} is gone")
            suspects = owners

    async def _start_left_off(self, record: PlacementRecord) -> None:
        """Return when the task that starts the component has ended and the component is out of the book."""
        until_s = self.clock.now_s() + SPAWN_WITHIN_S * self.clock.rate
        while self._book.find(record.spawn.name) is record and self.clock.now_s() < until_s:
            await self._news_or(until_s)

    async def _end_on(self, host: str, name: str, reason: str) -> EndedBy:
        """End the component on this host.

        Raises:
            CreatorSilent: The creator lives but does not answer; the outcome is unknown.
        """
        order = EndProcess(name, reason)
        within_s = order.ask_s + order.term_s + END_MARGIN_S
        try:
            return (await self.bus.ask(_creator(host), order, ProcessEnded, within_s=within_s)).by
        except NotHere:
            return EndedBy.ITSELF
        except LinkError as error:
            processes = await self._ask_processes(host)
            if processes is None:
                gone = not self._book.is_alive(host)
            else:
                gone = all(process.spawn.name != name for process in processes.processes)
            if gone:
                return EndedBy.ITSELF
            raise CreatorSilent(
                f"{name}: {error}; whether it still runs on {host} is unknown", name=name, outcome="unknown"
            ) from error

    # ------------------------------------------------------------------ events
    def _component_changed(self, heard: Envelope[Any]) -> None:
        match heard.body:
            case Appeared(component=component) if component.type == CREATOR:
                self._enqueue(partial(self._begin_meeting, component))
            case Appeared(component=component):
                self._book.component_appeared(component.address, component.host, component.pid)
                self._tell_news()
            case Disappeared(address=gone) if gone.startswith(_creator("")):
                host = gone.removeprefix(_creator(""))
                self._enqueue(lambda: self._lost_sight_of(host))
            case Disappeared(address=gone):
                self._enqueue(lambda: self._carry_out(self._book.component_disappeared(gone)))

    def _nameserver_changed(self, _address: str, alive: bool) -> None:
        """Compare again, because messages were lost while the link or the hub was down."""
        if alive:
            self._enqueue(partial(self._begin, self._look_again, "look again"))

    def _load_heard(self, heard: Envelope[HostLoad]) -> None:
        self._carry_out(self._book.load_heard(heard.body))

    def _fall_heard(self, heard: Envelope[ProcessFell]) -> None:
        fell = heard.body
        then = f"restart in {fell.restart_in_s:g} s" if fell.restart_in_s >= 0 else "not restarted"
        self.story.note(fell.name, f"fell: {fell.how}; {then}")
        record = self._book.find(fell.name)
        if record is not None and fell.restart_in_s < 0:
            self._carry_out(self._book.component_disappeared(record.address))

    def _enqueue(self, begin: Callable[[], None]) -> None:
        """Queue this for ``serve``, because events arrive before the component serves."""
        self._queue.put_nowait(begin)

    def _begin(self, work: Callable[[], Coroutine[Any, Any, None]], name: str) -> None:
        self.start_task(work(), name)

    def _carry_out(self, instructions: list[Instruction]) -> None:
        for instruction in instructions:
            match instruction:
                case PlaceAgain(name=name):
                    self._enqueue(partial(self._begin, partial(self._place_again, name), f"place {name} again"))
                case EndOrphan(host=host, name=name):
                    self._enqueue(partial(self._begin, partial(self._end_orphan, host, name), f"end {name} on {host}"))
                case Inspect(host=host) if host in self._inspecting:
                    pass  # the next load inspects components that are still suspect
                case Inspect(host=host):
                    self._inspecting.add(host)
                    self._enqueue(partial(self._begin, partial(self._inspect, host), f"inspect {host}"))
                case Note(subject=subject, what=what):
                    self.story.note(subject, what)
                case _:
                    assert_never(instruction)
        self._tell_news()
        self.changed()

    def _creator_status_heard(self, heard: Envelope[ComponentState]) -> None:
        """Place a creator's components again as soon as it drains; its token stands until it has ended them."""
        creator = heard.body
        if creator.state in LEAVING and self._book.knows_creator(creator.host, creator.pid):
            self._carry_out(self._book.creator_down(creator.host, self.clock.now_s()))

    # ------------------------------------------------------------------ creators
    async def _creators(self) -> Components:
        return await ask_until_answered(
            self.bus,
            self.clock,
            NAMESERVER,
            ListComponents(type=CREATOR),
            Components,
            each_s=ANSWER_EACH_S,
            within_s=ANSWER_WITHIN_S,
        )

    async def _look_again(self) -> None:
        """Compare the nameserver's list of creators with the book; a complete list also shows missing creators."""
        while True:
            try:
                found = await self._creators()
            except LinkError as error:  # when the nameserver is back, its token starts this again
                self.story.note(component_of(NAMESERVER), f"does not list the creators: {error}")
                return
            for creator in found.components:
                if self._book.knows_creator(creator.host, creator.pid):
                    self._carry_out([Inspect(creator.host)])
                else:
                    self._begin_meeting(creator)
            if found.complete:
                break
            back_s = found.hub_since_s + RECONNECT_S * self.clock.rate
            await self.clock.sleep_s(max(back_s - self.clock.now_s(), RECONNECT_S / 10 * self.clock.rate))
        there = {creator.host for creator in found.components}
        for host in self._book.hosts():
            if host.name not in there:
                self._lost_sight_of(host.name)

    def _lost_sight_of(self, host: str) -> None:
        """Record a creator's fallen token: a creator of this host died, one of another host may be cut off."""
        fence_s = 0.0 if host == self.launch.host else CUT_OFF_ENDS_WITHIN_S * self.clock.rate
        self._carry_out(self._book.creator_down(host, self.clock.now_s(), fence_s))

    def _begin_meeting(self, creator: ComponentState) -> None:
        if self._newest.get(creator.host) != creator.pid or creator.host not in self._meeting:
            self._newest[creator.host] = creator.pid
            self._begin(partial(self._meet, creator), f"meet {creator.host}")

    async def _meet(self, creator: ComponentState) -> None:
        """Collect a creator's tags and processes, and subscribe to its reports."""
        host, asked_s = creator.host, self.clock.now_s()
        self._newest[host] = creator.pid
        self._meeting[host] = self._meeting.get(host, 0) + 1
        if host not in self._ears:
            own = _creator(host)
            self._ears[host] = [
                self.bus.subscribe(own, Conversation.TELEMETRY, HostLoad, self._load_heard, latest=True),
                self.bus.subscribe(own, Conversation.EVENTS, ProcessFell, self._fall_heard),
                self.bus.subscribe(own, Conversation.STATUS, ComponentState, self._creator_status_heard),
            ]
        try:
            answered = await ask_until_answered(
                self.bus,
                self.clock,
                _creator(host),
                ListProcesses(),
                Processes,
                each_s=ANSWER_EACH_S,
                within_s=ANSWER_WITHIN_S,
            )
        except LinkError as error:  # it may only be slow: ask again while its token stands
            self.story.note(host, f"its creator does not list its processes: {error}")
            self._enqueue(partial(self._begin, partial(self._meet_later, creator), f"meet {host} later"))
            return
        finally:
            self._meeting[host] -= 1
            if not self._meeting[host]:
                del self._meeting[host]
            self._tell_news()
        if self._newest[host] == creator.pid:  # else the placer meets its successor instead
            self._carry_out(self._book.creator_up(host, answered.tags, creator.pid, answered.processes, asked_s))

    async def _meet_later(self, creator: ComponentState) -> None:
        await self.clock.sleep_s(ANSWER_WITHIN_S * self.clock.rate)
        try:
            found = await self._creators()
        except LinkError:  # the nameserver's return makes the placer look again
            return
        is_there = any((each.host, each.pid) == (creator.host, creator.pid) for each in found.components)
        if is_there and not self._book.knows_creator(creator.host, creator.pid):
            self._begin_meeting(creator)

    async def _inspect(self, host: str) -> None:
        asked_s = self.clock.now_s()
        processes = await self._ask_processes(host)
        self._inspecting.discard(host)
        if processes is not None:
            self._carry_out(self._book.inspected(host, processes.processes, asked_s))

    async def _ask_processes(self, host: str) -> Processes | None:
        """Return the list of the host's creator; None if it does not answer or is gone."""
        until_s = self.clock.now_s() + ANSWER_WITHIN_S * self.clock.rate
        while self.clock.now_s() < until_s and self._book.is_alive(host):
            try:
                return await self.bus.ask(_creator(host), ListProcesses(), Processes, within_s=ANSWER_EACH_S)
            except LinkError:
                await self._news_or(self.clock.now_s() + ANSWER_EACH_S / 5 * self.clock.rate)
        return None

    # ------------------------------------------------------------------ after a loss
    async def _place_again(self, name: str) -> None:
        """Start a missing component until it runs or is unwanted; without a possible host it waits for a creator."""
        record = self._book.find(name)
        if record is None or record.phase is not PlacementPhase.WAITING or record.unwanted:
            return
        record.phase = PlacementPhase.STARTING
        await self._old_life_ended(record)
        for pause_s in chain(AGAIN_PAUSES_S, repeat(AGAIN_PAUSES_S[-1])):
            await self._pause(record, pause_s)
            record.doing = "is being placed again"
            try:
                await self._bring_up(record)
            except NoHost as refusal:
                self.story.note(name, f"waits for a host: {refusal.detail}")
                self._book.waits(name, refusal.detail)
                break
            except StoppedMeanwhile:
                self._book.forget(name)
                break
            except Refusal as refusal:
                self.story.note(name, f"could not be started again: {refusal.detail}")
                record.cause = f"could not be started again: {refusal.detail}"
                if record.phase is not PlacementPhase.STARTING:  # its creator's list decides whether it runs
                    break
                self.changed()
            else:
                self._again += 1
                break
        self._tell_news()
        self.changed()

    async def _pause(self, record: PlacementRecord, pause_s: float) -> None:
        """Return after this many seconds of the machine, or when the component is unwanted."""
        until_s = self.clock.now_s() + pause_s * self.clock.rate
        while self.clock.now_s() < until_s and not record.unwanted:
            await self._news_or(until_s)

    async def _old_life_ended(self, record: PlacementRecord) -> None:
        """Return when the name is free or has returned, because a component dies a moment after its creator."""
        name, until_s = record.spawn.name, self.clock.now_s() + OLD_LIFE_S * self.clock.rate
        while self.clock.now_s() < until_s and record.phase is PlacementPhase.STARTING and not record.unwanted:
            try:
                await self.bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=ANSWER_EACH_S)
            except UnknownName:
                return
            except LinkError as error:
                self.story.note(name, f"it is unknown whether its old process has ended: {error}")
            await self._news_or(min(until_s, self.clock.now_s() + ANSWER_EACH_S / 5 * self.clock.rate))

    async def _end_orphan(self, host: str, name: str) -> None:
        try:
            by = await self._end_on(host, name, "it is not wanted here any more")
        except Refusal as refusal:
            self.story.note(name, f"could not be ended on {host}: {refusal.detail}")
            return
        self._orphans += 1
        self.story.note(name, f"was ended on {host}, by {by}")

    # ------------------------------------------------------------------ waiting for news
    def _tell_news(self) -> None:
        self._something_happened.set()
        self._something_happened = asyncio.Event()

    async def _news_or(self, at_s: float) -> None:
        """Return after the next event, or at this mission time."""
        news = asyncio.ensure_future(self._something_happened.wait())
        time = asyncio.ensure_future(self.clock.sleep_until_s(at_s))
        try:
            await asyncio.wait({news, time}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            news.cancel()
            time.cancel()
            await asyncio.gather(news, time, return_exceptions=True)


def _creator(host: str) -> str:
    return f"{Subsystem.BACKBONE}/{creator_name(host)}"


def _started(record: PlacementRecord) -> Started:
    return Started(record.address, record.host, record.pid, list(record.reasons))


def _spawn(name: str, order: Start, component_type: ComponentType, requester: str) -> Spawn:
    return Spawn(
        subsystem=component_type.subsystem,
        name=name,
        type=component_type.name,
        class_path=component_type.class_path,
        parameters=order.parameters,
        requester=requester,
        policy=RestartPolicy(restart=component_type.restart),
        pinned=bool(order.host),
        tags=sorted({*component_type.tags, *order.tags}),
        process=order.process,
    )
