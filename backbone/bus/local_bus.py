"""The bus inside one process: it delivers the objects themselves, without serialization and without copies.

Each delivery is a separate step of the event loop, in the order of sending, so on a ``VirtualLoop`` the same program
gives the same run.

``LocalBus`` is a complete bus, for missions in one process. ``shared_bus``, whose members also reach other processes,
uses the same delivery between neighbors.
"""

from __future__ import annotations

import asyncio
import functools
from collections import defaultdict
from collections.abc import Callable

from backbone.bus.bus_base import BusBase
from backbone.bus.interface import Answer, Clock, LifeListener, LinkListener, Listener, Overhearer, Reply
from backbone.errors import NoResponder, ReplyTimeout
from backbone.keys import NEVER_DROPPED, Conversation, key
from backbone.waiting import settle
from backbone.wire import (
    Accepts,
    Envelope,
    MalformedMessage,
    Message,
    Refused,
    UnknownMessage,
    kinds_of,
    schema_of,
    write,
)

Answered = Callable[[Envelope[Message] | None], None]
"""Callback with the answer to a question, or None if the component died over it."""


class LocalNetwork:
    """The network of the buses of one process and one mission."""

    def __init__(self, mission: str = "local") -> None:
        self.mission = mission
        self.servers: dict[str, Serving] = {}
        self.listeners: dict[Conversation, list[Listening]] = defaultdict(list)
        self.tokens: dict[str, list[Declaration]] = {}
        self.watchers: list[Watching] = []
        self.overhearers: list[Overheard] = []

    def join(self, source: str, clock: Clock) -> LocalBus:
        """Return a new bus of the component ``source`` on this network."""
        return LocalBus(self, source, clock)

    # Transport. A network that loses messages overrides these three.
    def carry_question(self, address: str, asked: Envelope[Message], answered: Answered) -> None:
        """Deliver the question to the component that serves the address, and its outcome to ``answered``.

        Raises:
            NoResponder: No component serves the address.
        """
        server = self.servers.get(address)
        if server is None:
            raise NoResponder(f"no component answers at {address}")
        answering = server.owner.start(_answer(server, asked))
        answering.add_done_callback(lambda task: answered(_outcome(task)))

    def carry_publication(self, listening: Listening, address: str, envelope: Envelope[Message]) -> None:
        """Deliver a publication to one listener."""
        listening.deliver(address, envelope)

    def carry_life(self, watching: Watching, address: str, alive: bool) -> None:
        """Deliver the rise or fall of a token to one watcher."""
        watching.notify(address, alive)


class Neighbor(BusBase):
    """A bus that exchanges messages with its neighbors in this process directly.

    Attributes:
        network: The network of its neighbors.
        declared: Its declarations in that network.
    """

    network: LocalNetwork
    declared: list[Declaration]

    async def ask_neighbor(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask the neighbor that serves the address; see ``Bus.ask``."""
        answered = self.open_question()
        self.asked += 1
        asked = self.envelope(question)
        try:
            async with asyncio.timeout(within_s):
                await asyncio.sleep(0)
                self.network.carry_question(address, asked, lambda outcome: settle(answered, outcome))
                envelope = await answered
        except TimeoutError:
            raise ReplyTimeout(f"{address} did not answer {type(question).__name__} within {within_s:g} s") from None
        finally:
            self.end_question(answered)
        if envelope is None:
            raise NoResponder(f"{address} died before it answered {type(question).__name__}")
        if isinstance(envelope.body, Refused):
            raise envelope.body.revive()
        if not isinstance(envelope.body, reply):
            self.unreadable += 1
            raise MalformedMessage(f"{address} answered {type(envelope.body).__name__}, not {reply.__name__}")
        return envelope.body

    def publish_to_neighbors(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Deliver a publication to every listener in this process."""
        for listening in self.network.listeners[conversation]:
            if _matches(listening.pattern, address):
                self.network.carry_publication(listening, address, envelope)
        for overheard in self.network.overhearers:
            overheard.arrived(address, conversation, envelope)

    def serve_neighbors(self, address: str, accepts: Accepts, answer: Answer) -> Serving:
        """Answer questions from this process; if several neighbors serve an address, the newest one answers."""
        serving = self.network.servers[address] = Serving(self, address, accepts, answer)
        return serving

    def subscribe_to_neighbors(
        self, address: str, conversation: Conversation, accepts: Accepts, listener: Listener, *, latest: bool
    ) -> Listening:
        """Subscribe to publications of this process."""
        listening = Listening(self, address, conversation, accepts, listener, latest)
        self.network.listeners[conversation].append(listening)
        return listening

    def overhear_neighbors(
        self, conversation: Conversation, listener: Overhearer, most_waiting_bytes: int, of: str
    ) -> Overheard:
        """Subscribe to a conversation of components of this process."""
        overheard = Overheard(self, conversation, listener, most_waiting_bytes, of)
        self.network.overhearers.append(overheard)
        return overheard

    def declare_to_neighbors(self, address: str) -> Declaration:
        """Raise a token in this process."""
        tokens = self.network.tokens.setdefault(address, [])

        def fall() -> None:
            tokens.remove(token)
            if not tokens:
                self._tell_watchers(address, alive=False)

        token = Declaration(self, fall)
        tokens.append(token)
        if len(tokens) == 1:
            self._tell_watchers(address, alive=True)
        return token

    def watch_neighbors(self, address: str, listener: LifeListener) -> Watching:
        """Watch the tokens of this process."""
        watching = Watching(self, address, listener)
        self.network.watchers.append(watching)
        for standing, tokens in self.network.tokens.items():
            if tokens:
                self.network.carry_life(watching, standing, alive=True)
        return watching

    def is_overheard_by_neighbors(self, conversation: Conversation) -> bool:
        """Return whether a component in this process hears this conversation of its own address."""
        network = self.network
        return any(overheard.hears(self.source, conversation) for overheard in network.overhearers) or any(
            _matches(listening.pattern, self.source) for listening in network.listeners[conversation]
        )

    def take_back_from_neighbors(self) -> None:
        """Withdraw all declarations in this process."""
        for declared in list(self.declared):
            declared.close()

    def _tell_watchers(self, address: str, *, alive: bool) -> None:
        for watching in list(self.network.watchers):
            self.network.carry_life(watching, address, alive)


class Declaration:
    """A declaration of one bus; ``close`` removes it from the network."""

    def __init__(self, owner: Neighbor, take_back: Callable[[], None]) -> None:
        self.owner, self._take_back, self.closed = owner, take_back, False
        owner.declared.append(self)

    def close(self) -> None:
        """Withdraw the declaration."""
        if not self.closed:
            self.closed = True
            self.owner.declared.remove(self)
            self._take_back()


class Serving(Declaration):
    """A declaration that answers at an address."""

    def __init__(self, owner: Neighbor, address: str, accepts: Accepts, answer: Answer) -> None:
        super().__init__(owner, lambda: self._leave(owner.network, address))
        self.kinds, self.answer = kinds_of(accepts), answer

    def _leave(self, network: LocalNetwork, address: str) -> None:
        if network.servers.get(address) is self:
            del network.servers[address]


class Listening(Declaration):
    """A declaration that subscribes to a conversation."""

    def __init__(
        self,
        owner: Neighbor,
        pattern: str,
        conversation: Conversation,
        accepts: Accepts,
        listener: Listener,
        latest: bool,
    ) -> None:
        super().__init__(owner, lambda: owner.network.listeners[conversation].remove(self))
        self.pattern, self.conversation, self.kinds, self.listener = pattern, conversation, kinds_of(accepts), listener
        self.latest = latest
        self.newest: dict[str, Envelope[Message]] = {}

    def deliver(self, address: str, envelope: Envelope[Message]) -> None:
        """Deliver the publication in a step of its own."""
        loop = asyncio.get_running_loop()
        if not self.latest:
            loop.call_soon(self._hand_over, envelope)
            return
        if not self.newest:
            loop.call_soon(self._hand_over_newest)
        self.newest[address] = envelope

    def _hand_over_newest(self) -> None:
        newest, self.newest = self.newest, {}
        for envelope in newest.values():
            self._hand_over(envelope)

    def _hand_over(self, envelope: Envelope[Message]) -> None:
        if self.closed:
            return
        if isinstance(envelope.body, self.kinds):
            self.owner.hear(self.listener, envelope)
        else:
            self.owner.unreadable += 1


class Overheard(Declaration):
    """A declaration that subscribes to a conversation of one component or of all, as bytes."""

    def __init__(self, owner: Neighbor, conversation: Conversation, listener: Overhearer, most: int, of: str) -> None:
        super().__init__(owner, lambda: owner.network.overhearers.remove(self))
        self._conversation, self._listener, self._most, self._of = conversation, listener, most, of
        self._waiting = self.dropped = 0

    def hears(self, address: str, conversation: Conversation) -> bool:
        """Return whether it is subscribed to this conversation of this address."""
        return conversation is self._conversation and self._of in ("", address)

    def arrived(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Deliver a publication in a step of its own, unless too many wait."""
        if not self.hears(address, conversation):
            return
        raw = write(envelope)
        if self._waiting + len(raw) > self._most:
            self.dropped += 1
            return
        self._waiting += len(raw)
        name = key(self.owner.network.mission, address, conversation)
        asyncio.get_running_loop().call_soon(self._hand_over, name, raw)

    def _hand_over(self, name: str, raw: bytes) -> None:
        self._waiting -= len(raw)
        if not self.closed:
            self.owner.heard += 1
            self.owner.call("", self._listener, name, raw)


class Watching(Declaration):
    """A declaration that watches tokens."""

    def __init__(self, owner: Neighbor, pattern: str, listener: LifeListener) -> None:
        super().__init__(owner, lambda: owner.network.watchers.remove(self))
        self.pattern, self.listener = pattern, listener

    def concerns(self, address: str) -> bool:
        """Return whether the listener watches this address."""
        return _matches(self.pattern, address)

    def notify(self, address: str, alive: bool) -> None:
        """Call the listener in a step of its own, if it watches this address."""
        if self.concerns(address):
            asyncio.get_running_loop().call_soon(self._hand_over, address, alive)

    def _hand_over(self, address: str, alive: bool) -> None:
        if not self.closed:
            self.owner.call("", self.listener, address, alive)


class LocalBus(Neighbor):
    """One component's bus on a ``LocalNetwork``."""

    def __init__(self, network: LocalNetwork, source: str, clock: Clock) -> None:
        super().__init__(network.mission, source, clock)
        self.network = network
        self.declared = []

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component and return its answer; see ``Bus.ask``."""
        _check(self.mission, address)
        return await self.ask_neighbor(address, question, reply, within_s=within_s)

    def serve(self, address: str, accepts: Accepts, answer: Answer) -> Serving:
        """Answer questions to this address; see ``Bus.serve``."""
        self.require_open()
        _check(self.mission, address)
        return self.serve_neighbors(address, accepts, answer)

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all subscribers; see ``Bus.publish``."""
        if self.closed:
            return
        _check(self.mission, address)
        self.published += 1
        envelope = self.envelope(message)
        self.publish_to_neighbors(address, conversation, envelope)
        if conversation in NEVER_DROPPED:
            self.tell(address, conversation, envelope)

    def pass_on(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Send a message of another sender; see ``Bus.pass_on``."""
        if not self.closed:
            _check(self.mission, address)
            self.publish_to_neighbors(address, conversation, envelope)

    def subscribe(
        self, address: str, conversation: Conversation, accepts: Accepts, listener: Listener, *, latest: bool = False
    ) -> Listening:
        """Subscribe to publications; see ``Bus.subscribe``."""
        self.require_open()
        _check(self.mission, address)
        return self.subscribe_to_neighbors(address, conversation, accepts, listener, latest=latest)

    def overhear(
        self, conversation: Conversation, listener: Overhearer, most_waiting_bytes: int, of: str = ""
    ) -> Overheard:
        """Subscribe to a conversation of one component or of all; see ``Bus.overhear``."""
        self.require_open()
        return self.overhear_neighbors(conversation, listener, most_waiting_bytes, of)

    def is_overheard(self, conversation: Conversation) -> bool:
        """Return whether a component hears this conversation of its own address."""
        return self.is_overheard_by_neighbors(conversation)

    def declare_alive(self, address: str) -> Declaration:
        """Raise a liveliness token; see ``Bus.declare_alive``."""
        self.require_open()
        _check(self.mission, address)
        return self.declare_to_neighbors(address)

    def watch_alive(self, address: str, listener: LifeListener) -> Watching:
        """Watch liveliness tokens; see ``Bus.watch_alive``."""
        self.require_open()
        _check(self.mission, address)
        return self.watch_neighbors(address, listener)

    def watch_link(self, listener: LinkListener) -> Declaration:
        """Report the link, which is always up inside one process."""
        self.require_open()
        watching = Declaration(self, lambda: None)

        def hand_over() -> None:
            if not watching.closed:
                self.call("", listener, True)

        asyncio.get_running_loop().call_soon(hand_over)
        return watching

    def take_back(self) -> None:
        """Withdraw all declarations."""
        self.take_back_from_neighbors()

    async def leave(self) -> None:
        """Return at once, because no declaration is left in the network."""


async def _answer(server: Serving, asked: Envelope[Message]) -> Envelope[Message] | None:
    if isinstance(asked.body, server.kinds):
        reply = await server.owner.reply_to(asked, server.answer)
        if reply is not None:
            server.owner.tell(server.owner.source, Conversation.ASK, asked, reply)
        return reply
    server.owner.unreadable += 1
    schema = schema_of(type(asked.body))
    accepted = ", ".join(sorted(schema_of(kind) for kind in server.kinds))
    refusal = UnknownMessage(f"{schema} is not answered here", schema=schema, accepted=accepted)
    return server.owner.envelope(Refused.of(refusal))


def _outcome(answering: asyncio.Task[Envelope[Message] | None]) -> Envelope[Message] | None:
    return None if answering.cancelled() or answering.exception() is not None else answering.result()


def _check(mission: str, address: str) -> None:
    """Refuse the names that the bus between processes refuses in keys."""
    key(mission, address, Conversation.ASK)


@functools.lru_cache(maxsize=4096)
def _matches(pattern: str, address: str) -> bool:
    if pattern == address:
        return True
    wanted, given = pattern.split("/"), address.split("/")
    return len(wanted) == len(given) and all(w in ("*", g) for w, g in zip(wanted, given, strict=True))
