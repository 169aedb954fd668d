"""A network of simulated processes. Each process has one link to the hub, the nameserver's process.

It behaves as measured on the real bus (decision 0003):

* If a link is cut, or its process or the hub is paused, the link keeps messages until it heals. After a lease the link
is given up: these messages are lost, its questions end without an answer, and tokens disappear at both of its ends.
* The death of a process or of the hub is detected at once.
* A link that was given up is re-established a moment after its fault ends; tokens and services then return by
  themselves.
* Neighbors in one process reach each other without a link.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from contextvars import Context

from backbone.bus.interface import Clock, LinkListener
from backbone.bus.local_bus import Answered, LocalBus, LocalNetwork
from backbone.bus.neighbor_declarations import Listening, NeighborDeclaration, Watching
from backbone.wire import Envelope, Message
from mission_control.laboratory.simulation.simulated_processes import SimulatedProcess, current_process

LINK_LEASE_S = 2.0  # zenoh_settings.LINK_LEASE_MS
RECONNECT_AFTER_S = 0.1  # zenoh_settings.RETRY_MOST_MS

Act = Callable[[], None]


def _nothing() -> None:
    """Ignore the loss."""


class Link:
    """A process's link to the hub."""

    def __init__(self, network: LinkedNetwork, process: SimulatedProcess, *, is_hub: bool) -> None:
        self.process, self.is_hub, self.is_up = process, is_hub, False
        self.shown: dict[str, None] = {}
        """Addresses of its tokens, in order."""
        self.listeners: list[LinkListener] = []
        self.questions: dict[object, Act] = {}
        self._network = network
        self._blocks = 0
        self._kept: deque[tuple[Act, Act]] = deque()
        self._alarm: asyncio.TimerHandle | None = None
        self.usable = asyncio.Event()

    @property
    def is_blocked(self) -> bool:
        """True if no message passes."""
        return self._blocks > 0

    def carry(self, act: Act, lost: Act = _nothing) -> None:
        """Call ``act`` when a message sent now arrives, or ``lost`` if it never arrives."""
        if not self.is_up:
            lost()
        elif self.is_blocked:
            self._kept.append((act, lost))
        else:
            act()

    def block(self) -> None:
        """Stop all messages until ``unblock`` has been called as often as ``block``."""
        self._blocks += 1
        if self._blocks == 1:
            self._ring(LINK_LEASE_S, self.give_up)

    def unblock(self) -> None:
        """Undo one ``block``."""
        self._blocks -= 1
        if self._blocks or self.process.is_dead:
            return
        if self.is_up:
            self._cancel_alarm()
            kept, self._kept = self._kept, deque()
            for act, lost in kept:
                self.carry(act, lost)
        else:
            self._ring(RECONNECT_AFTER_S, self.come_up)

    def give_up(self) -> None:
        """Record that the link is lost."""
        self._cancel_alarm()
        if not self.is_up:
            return
        self.is_up = False
        self.usable.clear()
        kept, self._kept = self._kept, deque()
        for _, lost in kept:
            lost()
        questions, self.questions = list(self.questions.values()), {}
        for end in questions:
            end()
        self._changed()
        if not self.is_blocked and not self.process.is_dead:
            self._ring(RECONNECT_AFTER_S, self.come_up)

    def come_up(self) -> None:
        """Record that the link is up, unless it is blocked."""
        if self.is_up or self.is_blocked or self.process.is_dead or not self._network.has_hub:
            return
        self.is_up = True
        self.usable.set()
        self._changed()

    def close(self) -> None:
        """Record that the process has ended."""
        self.give_up()
        self._cancel_alarm()

    def _changed(self) -> None:
        loop = asyncio.get_running_loop()
        if not self.process.is_dead:
            for listener in list(self.listeners):
                self.process.run(loop.call_soon, listener, self.is_up)
        self._network.look_anew(self)

    def _ring(self, after_s: float, act: Act) -> None:
        self._cancel_alarm()
        self._alarm = asyncio.get_running_loop().call_later(after_s, act, context=Context())

    def _cancel_alarm(self) -> None:
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None


class LinkedBus(LocalBus):
    """One component's bus, over its process's link."""

    def __init__(self, network: LinkedNetwork, source: str, clock: Clock, link: Link) -> None:
        super().__init__(network, source, clock)
        self.link = link

    def declare_to_neighbors(self, address: str) -> NeighborDeclaration:
        """Declare a token; behind a cut link another token of this address may exist."""
        tokens = self.network.tokens.setdefault(address, [])
        self.link.shown[address] = None

        def fall() -> None:
            tokens.remove(token)
            self._tell_watchers(address, alive=False)

        token = NeighborDeclaration(self, fall)
        tokens.append(token)
        self._tell_watchers(address, alive=True)
        return token

    def watch_link(self, listener: LinkListener) -> NeighborDeclaration:
        """Report the process's link; see ``Bus.watch_link``."""
        self.require_open()

        def hand_over(up: bool) -> None:
            if not watching.closed:
                self.call("", listener, up)

        watching = NeighborDeclaration(self, lambda: self.link.listeners.remove(hand_over))
        self.link.listeners.append(hand_over)
        asyncio.get_running_loop().call_soon(hand_over, self.link.is_up)
        return watching


class LinkedNetwork(LocalNetwork):
    """See the rules of this file.

    Args:
        mission: Name of the mission; each mission has its own network.
        hub: Name of the component whose process is the hub.
    """

    def __init__(self, mission: str, hub: str) -> None:
        super().__init__(mission)
        self.links: dict[SimulatedProcess, Link] = {}
        self._hub_name = hub
        self._hub: Link | None = None
        self._reported: dict[Watching, set[str]] = {}
        self._host_cuts: dict[str, int] = {}
        self._hub_is_paused = 0
        self._begun: list[SimulatedProcess] = []

    @property
    def has_hub(self) -> bool:
        """True if a hub runs."""
        return self._hub is not None

    def processes(self) -> list[SimulatedProcess]:
        """Return all processes, including ended ones, in the order of their starts."""
        return list(self._begun)

    def begin(self, process: SimulatedProcess) -> Link:
        """Return the link of a new process; the link comes up as soon as possible."""
        self._begun.append(process)
        link = self.links[process] = Link(self, process, is_hub=process.name == self._hub_name)
        if link.is_hub:
            self._hub, self._hub_is_paused = link, 0
            for other in self.links.values():
                other.come_up() if other is link else self._reconnect(other)
            return link
        for _ in range(self._hub_is_paused + self._host_cuts.get(process.host, 0)):
            link.block()
        link.come_up()
        return link

    def _reconnect(self, link: Link) -> None:
        asyncio.get_running_loop().call_later(RECONNECT_AFTER_S, link.come_up, context=Context())

    def end(self, process: SimulatedProcess) -> None:
        """Close a dead process's link; the death of the hub closes all links."""
        link = self.links.pop(process)
        if link is self._hub:
            self._hub = None
            for other in list(self.links.values()):
                other.give_up()
                for _ in range(self._hub_is_paused):
                    other.unblock()
            self._hub_is_paused = 0
        link.close()

    def pause(self, process: SimulatedProcess) -> None:
        """Block the link of a paused process."""
        self._block(self.links[process], 1)

    def go_on(self, process: SimulatedProcess) -> None:
        """Undo one ``pause``."""
        if process in self.links:
            self._block(self.links[process], -1)

    def cut(self, process: SimulatedProcess) -> None:
        """Cut the link of one process; the hub has no link."""
        if not self.links[process].is_hub:
            self.links[process].block()

    def heal(self, process: SimulatedProcess) -> None:
        """Undo one ``cut``."""
        if process in self.links and not self.links[process].is_hub:
            self.links[process].unblock()

    def cut_host(self, host: str) -> None:
        """Cut the links of all processes of a host except the hub, including processes that begin meanwhile."""
        self._host_cuts[host] = self._host_cuts.get(host, 0) + 1
        for link in self._of_host(host):
            link.block()

    def heal_host(self, host: str) -> None:
        """Undo one ``cut_host``."""
        self._host_cuts[host] -= 1
        for link in self._of_host(host):
            link.unblock()

    def _of_host(self, host: str) -> list[Link]:
        return [link for link in self.links.values() if link.process.host == host and not link.is_hub]

    def _block(self, link: Link, by: int) -> None:
        others: Iterable[Link] = [link]
        if link is self._hub:
            self._hub_is_paused += by
            others = [other for other in self.links.values() if other is not link]
        for each in list(others):
            each.block() if by > 0 else each.unblock()

    def join(self, source: str, clock: Clock) -> LinkedBus:
        """Return a new bus of the present process."""
        return LinkedBus(self, source, clock, self.links[_own()])

    def carry_question(self, address: str, asked: Envelope[Message], answered: Answered) -> None:
        """Deliver the question over both links, and return the answer."""
        own, server = self.links.get(_own()), self.servers.get(address)
        if own is None or own.process.is_dead:
            answered(None)
            return
        if server is not None and self._link_of(server) is own:
            LocalNetwork.carry_question(self, address, asked, answered)
            return
        if not own.is_up:
            answered(None)
            return

        def end(outcome: Envelope[Message] | None = None) -> None:
            if question not in ended:
                ended.add(question)
                own.questions.pop(question, None)
                answered(outcome)

        def arrive() -> None:
            server = self.servers.get(address)
            theirs = self._link_of(server) if server is not None else None
            if theirs is None:
                end()
            else:
                theirs.questions[question] = end
                theirs.carry(lambda: ask(theirs), end)

        def ask(theirs: Link) -> None:
            def back(outcome: Envelope[Message] | None) -> None:
                if theirs.questions.pop(question, None) is None or theirs.process.is_dead:
                    end()
                else:
                    theirs.carry(lambda: own.carry(lambda: end(outcome), end), end)

            theirs.process.run(LocalNetwork.carry_question, self, address, asked, back)

        question, ended = object(), set[object]()
        own.questions[question] = end
        own.carry(arrive, end)

    def carry_publication(self, listening: Listening, address: str, envelope: Envelope[Message]) -> None:
        """Deliver the publication over both links."""
        own, theirs = self.links.get(_own()), self._link_of(listening)
        if own is None or theirs is None or own.process.is_dead:
            return

        def deliver() -> None:
            theirs.process.run(listening.deliver, address, envelope)

        if own is theirs:
            deliver()
        else:
            own.carry(lambda: theirs.carry(deliver))

    def carry_life(self, watching: Watching, address: str, alive: bool) -> None:  # noqa: ARG002
        """Update the watcher with the tokens that are visible to it."""
        own = self.links.get(_own())
        if own is None or own.process.is_dead or own is self._link_of(watching):
            self._look(watching, address)
        else:
            own.carry(lambda: self._look(watching, address))

    def look_anew(self, link: Link) -> None:
        """Update all watchers after a change of this link."""
        for watching in list(self.watchers):
            addresses = self.tokens if _bus(watching).link is link else link.shown
            for address in list(addresses):
                if watching.concerns(address):
                    self._look(watching, address)

    def _look(self, watching: Watching, address: str) -> None:
        if watching.closed:
            self._reported.pop(watching, None)
            return
        if not watching.concerns(address):
            return
        link = _bus(watching).link
        stands = any(
            _bus(token).link is link or (_bus(token).link.is_up and link.is_up)
            for token in self.tokens.get(address, ())
            if not _bus(token).link.process.is_dead
        )
        reported = self._reported.setdefault(watching, set())
        if stands is (address in reported):
            return
        if stands:
            reported.add(address)
        else:
            reported.discard(address)

        def tell() -> None:
            link.process.run(watching.notify, address, stands)

        if link.is_up:
            link.carry(tell, _nothing if stands else tell)  # with a lost link every token disappears
        elif not link.process.is_dead:
            tell()

    def _link_of(self, declared: NeighborDeclaration) -> Link | None:
        return self.links.get(_bus(declared).link.process)


def _bus(declared: NeighborDeclaration) -> LinkedBus:
    bus = declared.owner
    assert isinstance(bus, LinkedBus)  # noqa: S101  ``join`` returns no other class
    return bus


def _own() -> SimulatedProcess:
    process = current_process.get()
    if process is None:
        raise RuntimeError("only a simulated process speaks on this network")
    return process
