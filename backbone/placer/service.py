"""The placer: starts and stops all components that are no core services.

The component database admits a start, the book chooses its host, and the creator of that host carries it out. If an
order gets no answer, the placer asks the creator whether it was carried out. So no component is started twice.

Source: S000, "component placer": all components ask it; it asks the creator of the chosen host.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from contextlib import AsyncExitStack
from functools import partial
from itertools import chain, repeat
from typing import Annotated, assert_never

import msgspec

from backbone.addresses import COMPONENT_DATABASE, NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import Absence, LogLevel
from backbone.component_database.messages import Admit, Admitted, ComponentType, Multiplicity
from backbone.creator.messages import CUT_OFF_ENDS_WITHIN_S, RestartPolicy, Spawn
from backbone.creator.messages import TYPE as CREATOR
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Appeared, Components, Disappeared, ListComponents
from backbone.naming import component_of, legal
from backbone.placer.bring_up import BringUp
from backbone.placer.creators import ANSWER_EACH_S, ANSWER_WITHIN_S, SPAWN_WITHIN_S, Creators, creator_of
from backbone.placer.decisions import EndOrphan, Inspect, Instruction, Note, PlaceAgain, PlacementPhase, PlacementRecord
from backbone.placer.exchanged_orders import revised
from backbone.placer.hosts_file import HostsFile
from backbone.placer.meetings import Meetings, Work
from backbone.placer.memories import Memories
from backbone.placer.messages import (
    AskMemory,
    AskPlacement,
    CreatorSilent,
    Ended,
    KeepMemory,
    ListPlacements,
    Memory,
    MemoryKept,
    NoHost,
    NotPlaced,
    Placements,
    PlacerQuestion,
    ReviseStart,
    Start,
    Started,
    StartRevised,
    StopComponent,
    StoppedMeanwhile,
)
from backbone.placer.news import News
from backbone.placer.packing import MOST_PACKS, WANTS_PACK
from backbone.placer.placement_book import PlacementBook
from backbone.wire import Envelope, Message, UnknownMessage

AGAIN_PAUSES_S = (0.0, 0.25, 0.5, 1.0, 2.0, 5.0)  # chosen: before each try to place a missing component again
COMPARE_EVERY_S = 5.0  # chosen: a wish without an owner is rare; its owner and the placer died at the same time


class PlacerParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of ``Placer``.

    Attributes:
        packs: Number of shared processes of each host into which components without a process are packed; 0: none;
            None: only types with many components share processes.
    """

    packs: Annotated[int, msgspec.Meta(ge=0, le=MOST_PACKS)] | None = None


class Placer(Component[PlacerParameters]):
    """Places components, and places them again when they are missing."""

    parameters_type = PlacerParameters
    accepts = PlacerQuestion

    def __init__(self, launch: Launch, bus: Bus, clock: Clock) -> None:
        super().__init__(launch, bus, clock)
        self._book = PlacementBook(self.parameters.packs or 0)
        self._queue: asyncio.Queue[Callable[[], None]] = asyncio.Queue()
        self._hosts_file = HostsFile(launch.run_directory)
        self._memories = Memories(launch.run_directory)
        self._happened = News(clock)
        self._creators = Creators(bus, clock, self._book, self._happened)
        self._meetings = Meetings(
            self._creators,
            own_host=launch.host,
            remember=self._remember_host,
            note=self.story.note,
            carry_out=self._carry_out,
            begin=self._begin,
            begin_later=self._begin_later,
        )
        self._start_up = BringUp(self._creators, note=self.story.note, is_meeting=self._meetings.are_under_way)
        self._type_locks: dict[str, asyncio.Lock] = {}
        self._starts = self._refused = self._again = self._stops = self._orphans = 0

    async def connect(self) -> None:
        """Recovery: collect the processes of all creators before the first question can arrive."""
        self.bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._component_changed)
        fenced_until_s = self.clock.now_s() + CUT_OFF_ENDS_WITHIN_S * self.clock.rate
        self._book.fences.after_restart(self._hosts_file.read(), fenced_until_s)
        found = await self._creators.listed()
        await asyncio.gather(*(self._meetings.meet(creator) for creator in found.components))
        self.bus.watch_alive(NAMESERVER, self._nameserver_changed)

    async def serve(self) -> None:
        """Carry out the queued work, and stop components without an owner."""
        self.start_task(self._stop_ownerless(), "stop ownerless")
        while True:
            begin = await self._queue.get()
            begin()

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``Start``, ``ReviseStart``, ``StopComponent``, ``AskPlacement`` and ``ListPlacements``."""
        match asked.body:
            case Start() as order:
                return await self._start(order, asked.source)
            case ReviseStart() as by:
                return await self._revise(by)
            case StopComponent(name=name, reason=reason):
                return await self._stop(name, reason or f"asked by {asked.source}")
            case AskPlacement(name=name):
                record = self._book.record(name)
                if record.unwanted:
                    raise NotPlaced(f"{name} is being stopped", name=name, stopped=True)
                return record.placement()
            case KeepMemory() as memory:
                return self._keep_memory(component_of(asked.source), memory)
            case AskMemory(order_id=order_id):
                name = component_of(asked.source)
                return Memory(self._memories.of(name, order_id) if self._has_order(name, order_id) else b"")
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
            order_id = order.order_id or f"{self.clock.now_s():.6f}"
            spawn = _spawn(name, order, component_type, requester, order_id)
            if not spawn.process and self.parameters.packs is None:
                spawn = msgspec.structs.replace(spawn, alike_most=component_type.alike_most)
            elif not spawn.process and component_type.shares_process and self.parameters.packs:
                spawn = msgspec.structs.replace(spawn, process=WANTS_PACK)
            record = self._book.reserve(spawn, order.host, self.clock.now_s())
            try:
                return await self._start_up.bring_up(record)
            except Refusal:
                if record.phase is PlacementPhase.STARTING:
                    self._book.forget(name)
                    self._happened.tell()
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

    def _keep_memory(self, name: str, memory: KeepMemory) -> MemoryKept:
        if self._has_order(name, memory.order_id):
            self._memories.keep(name, memory)
        return MemoryKept()

    def _has_order(self, name: str, order_id: str) -> bool:
        """Return whether the component of this name is placed under this order."""
        record = self._book.find(name)
        return record is not None and record.spawn.order_id == order_id

    async def _revise(self, by: ReviseStart) -> StartRevised:
        record = self._book.record(by.name)
        record.spawn = revised(record.spawn, by)
        if record.host:
            await self._creators.revise(record.host, record.spawn)
        return StartRevised()

    async def _stop(self, name: str, reason: str) -> Ended:
        record = self._book.record(name)
        record.unwanted = True
        self.story.note(name, f"is to be stopped: {reason}")
        self._happened.tell()
        try:
            by = await self._creators.end_everywhere(record.host, name, reason)
        except CreatorSilent:
            record.unwanted = False
            raise
        if record.phase is PlacementPhase.STARTING:
            await self._start_left_off(record)
        found = self._book.find(name)
        if found is None or found is record:
            self._book.stop_ordered(name, reason)
            self._memories.forget(name)
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
            await self._happened.or_at(until_s)

    def _component_changed(self, heard: Envelope[Message]) -> None:
        match heard.body:
            case Appeared(component=component) if component.type == CREATOR:
                self._enqueue(partial(self._meetings.begin_meeting, component))
            case Appeared(component=component):
                self._book.component_appeared(component.address, component.host, component.pid)
                self._happened.tell()
            case Disappeared(address=gone) if gone.startswith(creator_of("")):
                host = gone.removeprefix(creator_of(""))
                self._enqueue(lambda: self._meetings.lost_sight_of(host))
            case Disappeared(address=gone):
                self._enqueue(lambda: self._carry_out(self._book.component_disappeared(gone)))

    def _nameserver_changed(self, _address: str, alive: bool) -> None:
        """Compare again, because messages were lost while the link or the hub was down."""
        if alive:
            self._begin_later(self._meetings.look_again, "look again")

    def _remember_host(self, host: str) -> None:
        """Save the name of another host for the next placer; a write error ends no placer."""
        try:
            self._hosts_file.keep(host)
        except OSError as error:
            lost = f"a restart of the placer will not know that {host} may be cut off: {error.strerror}"
            self.publish_event(self.name, lost, LogLevel.WARNING)

    def _enqueue(self, begin: Callable[[], None]) -> None:
        """Queue this call for ``serve``, because events arrive before the component serves."""
        self._queue.put_nowait(begin)

    def _begin(self, work: Work, name: str) -> None:
        self.start_task(work(), name)

    def _begin_later(self, work: Work, name: str) -> None:
        self._enqueue(partial(self._begin, work, name))

    def _carry_out(self, instructions: list[Instruction]) -> None:
        for instruction in instructions:
            match instruction:
                case PlaceAgain(name=name):
                    self._begin_later(partial(self._place_again, name), f"place {name} again")
                case EndOrphan(host=host, name=name):
                    self._begin_later(partial(self._end_orphan, host, name), f"end {name} on {host}")
                case Inspect(host=host):
                    self._meetings.inspect(host)
                case Note(subject=subject, what=what):
                    self.story.note(subject, what)
                case _:
                    assert_never(instruction)
        self._happened.tell()
        self.changed()

    async def _place_again(self, name: str) -> None:
        """Start a missing component until it runs or is unwanted; without a possible host it waits for a creator."""
        record = self._book.find(name)
        if record is None or record.phase is not PlacementPhase.WAITING or record.unwanted:
            return
        record.phase = PlacementPhase.STARTING
        await self._start_up.old_life_ended(record)
        for pause_s in chain(AGAIN_PAUSES_S, repeat(AGAIN_PAUSES_S[-1])):
            await self._start_up.pause(record, pause_s)
            record.doing = "is being placed again"
            try:
                await self._start_up.bring_up(record)
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
        self._happened.tell()
        self.changed()

    async def _end_orphan(self, host: str, name: str) -> None:
        try:
            by = await self._creators.end(host, name, "it is not wanted here any more")
        except Refusal as refusal:
            self.story.note(name, f"could not be ended on {host}: {refusal.detail}")
            return
        self._orphans += 1
        self.story.note(name, f"was ended on {host}, by {by}")


def _spawn(name: str, order: Start, component_type: ComponentType, requester: str, order_id: str) -> Spawn:
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
        order_id=order_id,
    )
