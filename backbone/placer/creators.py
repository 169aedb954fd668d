"""Creators: the placer's questions and orders to the creators of all hosts, and the outcome of unanswered orders."""

from __future__ import annotations

from enum import Enum

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock, Reply
from backbone.component.asking import ask_until_answered
from backbone.component.messages import LifeState
from backbone.creator.messages import (
    START_MOST_S,
    EndedBy,
    EndProcess,
    ListProcesses,
    NotHere,
    ProcessEnded,
    Processes,
    ReviseSpawn,
    Spawn,
    SpawnRevised,
    creator_name,
)
from backbone.creator.messages import TYPE as CREATOR
from backbone.errors import LinkError
from backbone.nameserver.messages import Components, ListComponents, Resolve, Resolved, UnknownName
from backbone.naming import Subsystem
from backbone.placer.decisions import PlacementRecord
from backbone.placer.messages import CreatorSilent
from backbone.placer.news import News
from backbone.placer.placement_book import PlacementBook
from backbone.wire import Message

ANSWER_EACH_S, ANSWER_WITHIN_S = 1.0, 5.0  # chosen: a killed core service is back within one second
SPAWN_WITHIN_S = START_MOST_S + 5.0  # chosen: a creator's limit and a moment; silence ends a start long before
END_MARGIN_S = 5.0  # chosen: the same for ends


class Fate(Enum):
    """Outcome of an order that was not answered."""

    DONE = "done"
    NOT_DONE = "not done"
    HOST_LOST = "host lost"
    UNKNOWN = "unknown"


class Creators:
    """Asks the creators of all hosts.

    Attributes:
        bus: For questions to nameserver and creators.
        book: All placements; the choice of hosts.
        news: Wakes what waits, after each event.
    """

    def __init__(self, bus: Bus, clock: Clock, book: PlacementBook, news: News) -> None:
        self.bus, self.clock, self.book, self.news = bus, clock, book, news

    async def listed(self) -> Components:
        """Return the nameserver's list of creators.

        Raises:
            LinkError: The nameserver did not answer.
        """
        return await self._ask(NAMESERVER, ListComponents(type=CREATOR), Components)

    async def list_processes(self, host: str) -> Processes:
        """Return the list of the host's creator.

        Raises:
            LinkError: The creator did not answer.
        """
        return await self._ask(creator_of(host), ListProcesses(), Processes)

    async def processes_on(self, host: str) -> Processes | None:
        """Return the list of the host's creator; None if it does not answer or is gone."""
        until_s = self.clock.now_s() + ANSWER_WITHIN_S * self.clock.rate
        while self.clock.now_s() < until_s and self.book.is_alive(host):
            try:
                return await self.bus.ask(creator_of(host), ListProcesses(), Processes, within_s=ANSWER_EACH_S)
            except LinkError:
                await self.news.or_at(self.clock.now_s() + ANSWER_EACH_S / 5 * self.clock.rate)
        return None

    async def revise(self, host: str, spawn: Spawn) -> None:
        """Make this host start the component with this class and these parameters from its next start on.

        Raises:
            CreatorSilent: The creator lives but does not answer; the outcome is unknown.
        """
        try:
            revised = ReviseSpawn(spawn.name, spawn.parameters, spawn.class_path, spawn.declared)
            await self._ask(creator_of(host), revised, SpawnRevised)
        except NotHere:  # it is on its way to this host, or was lost: the next start has the book's parameters
            return
        except LinkError as error:
            raise CreatorSilent(
                f"{spawn.name}: {error}; {host} may start it as before", name=spawn.name, outcome="unknown"
            ) from error

    async def end(self, host: str, name: str, reason: str) -> EndedBy:
        """End the component on this host.

        Raises:
            CreatorSilent: The creator lives but does not answer; the outcome is unknown.
        """
        order = EndProcess(name, reason)
        within_s = order.ask_s + order.term_s + END_MARGIN_S
        try:
            return (await self.bus.ask(creator_of(host), order, ProcessEnded, within_s=within_s)).by
        except NotHere:
            return EndedBy.ITSELF
        except LinkError as error:
            processes = await self.processes_on(host)
            if processes is None:
                gone = not self.book.is_alive(host)
            else:
                gone = all(process.spawn.name != name for process in processes.processes)
            if gone:
                return EndedBy.ITSELF
            raise CreatorSilent(
                f"{name}: {error}; whether it still runs on {host} is unknown", name=name, outcome="unknown"
            ) from error

    async def end_everywhere(self, host: str, name: str, reason: str) -> EndedBy:
        """End the component on its host, and on a silent host that may still run it; return when neither can run it.

        Args:
            host: Its host in the book; empty: none.

        Raises:
            CreatorSilent: The creator lives but does not answer; the outcome is unknown.
        """
        by = await self.end(host, name, reason) if host else EndedBy.ITSELF
        silent: frozenset[str] = frozenset()
        while (until_s := self.book.fences.until_s(name, self.clock.now_s())) is not None:
            silent = self.book.fences.hosts(name)
            await self.news.or_at(until_s)
        for one in filter(self.book.is_alive, sorted(silent)):  # it was only cut off
            by = await self.end(one, name, reason)
        return by

    async def fate_of_spawn(self, record: PlacementRecord) -> tuple[Fate, int]:
        """Ask the creator for the outcome of an unanswered order, and for the pid if the component is ready.

        If only the answer was lost, the component still becomes ready, and this method waits for it.
        """
        until_s = self.clock.now_s() + SPAWN_WITHIN_S * self.clock.rate
        while True:
            answered = await self.processes_on(record.host)
            if answered is None:
                return (Fate.UNKNOWN if self.book.is_alive(record.host) else Fate.HOST_LOST), 0
            mine = [one for one in answered.processes if one.spawn.name == record.spawn.name]
            if not mine:
                return Fate.NOT_DONE, 0
            if mine[0].pid and await self._is_ready(record.spawn.name):
                return Fate.DONE, mine[0].pid
            if self.clock.now_s() >= until_s:
                return Fate.UNKNOWN, 0
            await self.news.or_at(min(until_s, self.clock.now_s() + ANSWER_EACH_S * self.clock.rate))

    async def _is_ready(self, name: str) -> bool:
        try:
            resolved = await self._ask(NAMESERVER, Resolve(name), Resolved)
        except (UnknownName, LinkError):
            return False
        return resolved.component.state is LifeState.READY

    async def _ask(self, address: str, question: Message, reply: type[Reply]) -> Reply:
        return await ask_until_answered(
            self.bus, self.clock, address, question, reply, each_s=ANSWER_EACH_S, within_s=ANSWER_WITHIN_S
        )


def creator_of(host: str) -> str:
    """Return the address of a host's creator."""
    return f"{Subsystem.BACKBONE}/{creator_name(host)}"
