"""Bring-up of one component: choose a host, order its creator to start the component, and choose again if it dies.

A component starts on no host while a silent host may still run it.
"""

from __future__ import annotations

from collections.abc import Callable

from backbone.addresses import NAMESERVER
from backbone.creator.messages import Spawned, StartFailed, creator_name
from backbone.errors import LinkError, NoResponder
from backbone.nameserver.messages import Resolve, Resolved, UnknownName
from backbone.placer.creators import ANSWER_EACH_S, SPAWN_WITHIN_S, Creators, Fate, creator_of
from backbone.placer.decisions import PlacementPhase, PlacementRecord
from backbone.placer.exchanged_orders import as_declared
from backbone.placer.messages import CreatorSilent, NoHost, Started, StoppedMeanwhile

CREATOR_BACK_S = 5.0  # chosen: a killed creator is back within one second
OLD_LIFE_S = 5.0  # chosen: longer than any lease that keeps tokens of a lost host's components
SPAWN_TRIES = 3  # chosen: two creators may die for other reasons; if a third dies, the order is the reason


class BringUp:
    """Starts components whose records are in the book."""

    def __init__(
        self,
        creators: Creators,
        *,
        note: Callable[[str, str], object],
        is_meeting: Callable[[], bool],
    ) -> None:
        """Start components through these creators.

        Args:
            creators: Find the outcome of orders whose answer was lost; know all placements.
            note: Subject, event → the story.
            is_meeting: True while the placer meets a creator, whose host may then be possible.
        """
        self._creators, self._bus, self._clock = creators, creators.bus, creators.clock
        self._book, self._news = creators.book, creators.news
        self._note, self._is_meeting = note, is_meeting

    async def bring_up(self, record: PlacementRecord) -> Started:
        """Start the component on a host and return when it is ready.

        Raises:
            Refusal: It does not run; the record stays STARTING, or RUNNING and suspect if the outcome is unknown.
        """
        name = record.spawn.name
        await self._unfenced(record)
        for tries_left in reversed(range(SPAWN_TRIES)):
            await self._choose(record)
            if record.phase is not PlacementPhase.STARTING:  # it returned with a host that was only cut off
                return started(record)
            self._note(name, f"goes to {record.host}: {'; '.join(record.reasons)}")
            spawn = as_declared(record.spawn)
            if spawn is not record.spawn:
                self._note(name, f"starts with {spawn.class_path} of the mission file, not {record.spawn.class_path}")
                record.spawn = spawn
            try:
                spawned = await self._bus.ask(creator_of(record.host), spawn, Spawned, within_s=SPAWN_WITHIN_S)
                pid = spawned.pid
            except StartFailed as refusal:
                self._refuse_unwanted(record)
                if self._book.is_alive(record.host) or not tries_left:
                    self._book.failed(name, self._clock.now_s())
                    raise self._named(refusal, record.host) from refusal
                self._note(name, f"was ended with {record.host}: {refusal.detail}")
                continue
            except LinkError as error:
                self._note(name, f"was ordered on {record.host} without an answer: {error}")
                fate, pid = await self._creators.fate_of_spawn(record)
                if fate is Fate.HOST_LOST:
                    await self._unfenced(record)
                    if self._book.is_alive(record.host):  # it was only cut off, and may have started it
                        fate, pid = await self._creators.fate_of_spawn(record)
                self._refuse_unwanted(record)
                lost = fate is Fate.HOST_LOST or (fate is Fate.NOT_DONE and isinstance(error, NoResponder))
                if lost and tries_left:
                    continue
                if fate is not Fate.DONE:
                    raise self._silent(record, fate, error) from error
            if record.unwanted:
                await self._creators.end(record.host, name, "was stopped while it started")
                self._refuse_unwanted(record)
            self._book.started(name, pid, self._clock.now_s())
            self._note(name, f"is ready on {record.host}, pid {pid}")
            break
        return started(record)

    async def _unfenced(self, record: PlacementRecord) -> None:
        """Return when no silent host can run the component any more, or when the component and its host are back."""
        name = record.spawn.name
        while record.phase is PlacementPhase.STARTING and not record.unwanted:
            until_s = self._book.fences.until_s(name, self._clock.now_s())
            if until_s is None:
                return
            record.doing = "waits until the silent host has ended it"
            await self._news.or_at(until_s)

    async def _choose(self, record: PlacementRecord) -> None:
        """Choose a host unless the component has returned; if a creator makes one possible soon, wait for it.

        Raises:
            NoHost: No host is possible.
        """
        name, until_s = record.spawn.name, self._clock.now_s() + CREATOR_BACK_S * self._clock.rate
        noted = ""
        while record.phase is PlacementPhase.STARTING:
            self._refuse_unwanted(record)
            try:
                self._book.choose(name, self._clock.now_s())
            except NoHost as refusal:
                may_come = self._is_meeting() or self._book.may_find_host(name)
                if self._clock.now_s() >= until_s or not (may_come or await self._appears(record.pin)):
                    raise
                if not may_come and self._book.is_alive(record.pin):  # the placer has met it during the question
                    continue
                if refusal.detail != noted:  # each load report of a host wakes this loop
                    noted = refusal.detail
                    self._note(name, f"waits for a creator: {noted}")
                await self._news.or_at(until_s)
            else:
                return

    async def _appears(self, host: str) -> bool:
        """Return whether the nameserver knows the creator of this host, which the book then soon knows, too."""
        if not host or any(host == view.name for view in self._book.hosts()):
            return False
        try:
            await self._bus.ask(NAMESERVER, Resolve(creator_name(host)), Resolved, within_s=ANSWER_EACH_S)
        except (UnknownName, LinkError):
            return False
        return True

    def _named(self, refusal: StartFailed, host: str) -> StartFailed:
        """Return the refusal with the name of its host, unless the mission has one host only."""
        at = f"on {host}: " if len(self._book.hosts()) > 1 else ""
        return StartFailed(f"{at}{refusal.detail}", remedy=refusal.remedy, **refusal.facts)

    def _refuse_unwanted(self, record: PlacementRecord) -> None:
        if record.unwanted:
            raise StoppedMeanwhile(f"{record.spawn.name} was stopped before it had started")

    def _silent(self, record: PlacementRecord, fate: Fate, error: LinkError) -> CreatorSilent:
        name, host = record.spawn.name, record.host
        if fate in (Fate.NOT_DONE, Fate.HOST_LOST):
            return CreatorSilent(f"{name}: {error}; it does not run on {host}", name=name, outcome="not_running")
        self._book.unsure(name, self._clock.now_s())
        return CreatorSilent(f"{name}: {error}; whether it runs on {host} is unknown", name=name, outcome="unknown")

    async def old_life_ended(self, record: PlacementRecord) -> None:
        """Return when the name is free or the component has returned; a component dies a moment after its creator."""
        name, until_s = record.spawn.name, self._clock.now_s() + OLD_LIFE_S * self._clock.rate
        while self._clock.now_s() < until_s and record.phase is PlacementPhase.STARTING and not record.unwanted:
            try:
                await self._bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=ANSWER_EACH_S)
            except UnknownName:
                return
            except LinkError as error:
                self._note(name, f"it is unknown whether its old process has ended: {error}")
            await self._news.or_at(min(until_s, self._clock.now_s() + ANSWER_EACH_S / 5 * self._clock.rate))

    async def pause(self, record: PlacementRecord, pause_s: float) -> None:
        """Return after this many seconds of the machine, or when the component is unwanted."""
        until_s = self._clock.now_s() + pause_s * self._clock.rate
        while self._clock.now_s() < until_s and not record.unwanted:
            await self._news.or_at(until_s)


def started(record: PlacementRecord) -> Started:
    """Return the answer to the order that started this component."""
    return Started(record.address, record.host, record.pid, list(record.reasons))
