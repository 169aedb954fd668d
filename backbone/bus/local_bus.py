"""The bus inside one process: it delivers the objects themselves, without serialization and without copies.

Each delivery is a separate step of the event loop, in the order of sending, so on a ``VirtualLoop`` each run of a
program is the same.

``LocalBus`` is a complete bus, for missions in one process. ``shared_bus``, whose members also reach other processes,
uses the same delivery between neighbors.
"""

from __future__ import annotations

import asyncio
import functools
from collections import Counter, defaultdict
from collections.abc import Callable

from backbone.bus.interface import Answer, Clock, LifeListener, LinkListener, Listener, Overhearer, Reply
from backbone.bus.lossless import MOST_KEPT_BYTES
from backbone.bus.neighbor_declarations import (
    Declaring,
    Listening,
    NeighborDeclaration,
    Overheard,
    Serving,
    Watching,
    matches,
)
from backbone.errors import NoResponder, ReplyTimeout
from backbone.keys import Conversation, key
from backbone.quality import NEVER_DROPPED
from backbone.waiting import settle
from backbone.wire import Accepts, Envelope, MalformedMessage, Message, Refused, UnknownMessage, schema_of

ADDRESSES_KEPT = 4096  # chosen: more than a mission of 100 robots has

Answered = Callable[[Envelope[Message] | None], None]
"""Callback with the answer to a question, or None if no component serves the address, or it died before it answered."""


class LocalNetwork:
    """The network of the buses of one process and one mission."""

    def __init__(self, mission: str = "local") -> None:
        self.mission = mission
        self.servers: dict[str, Serving] = {}
        self.listeners: dict[Conversation, list[Listening]] = defaultdict(list)
        self.tokens: dict[str, list[NeighborDeclaration]] = {}
        self.watchers: list[Watching] = []
        self.overhearers: list[Overheard] = []

    def join(self, source: str, clock: Clock) -> LocalBus:
        """Return a new bus of the component ``source`` on this network."""
        return LocalBus(self, source, clock)

    # Transport. A network that loses messages overrides these three.
    def carry_question(self, address: str, asked: Envelope[Message], answered: Answered) -> None:
        """Deliver the question to the component that serves the address, and its outcome to ``answered``."""
        server = self.servers.get(address)
        if server is None:
            answered(None)
            return
        answering = server.owner.start(_answer(server, asked))
        answering.add_done_callback(lambda task: answered(_outcome(task)))

    def carry_publication(self, listening: Listening, address: str, envelope: Envelope[Message]) -> None:
        """Deliver a publication to one listener."""
        listening.deliver(address, envelope)

    def carry_life(self, watching: Watching, address: str, alive: bool) -> None:
        """Report a new or ended token to one watcher."""
        watching.notify(address, alive)


class Neighbor(Declaring):
    """A bus that exchanges messages with its neighbors in this process directly.

    Attributes:
        network: The network of its neighbors.
    """

    network: LocalNetwork

    async def ask_neighbor(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask the neighbor that serves the address; see ``Bus.ask``."""
        answered, envelope = self.open_question(), None
        self.asked += 1
        asked = self.envelope(question)
        too_late = asyncio.get_running_loop().call_later(within_s, settle, answered, TimeoutError())
        try:
            await asyncio.sleep(0)
            self.network.carry_question(address, asked, lambda outcome: settle(answered, outcome))
            envelope = await answered
        except TimeoutError:
            raise ReplyTimeout(f"{address} did not answer {type(question).__name__} within {within_s:g} s") from None
        finally:
            too_late.cancel()
            self.end_question(answered)
            if envelope is None:  # the answerer makes a copy only if its answer was lost or is late
                self.tell(address, Conversation.ASK, asked)
        if envelope is None:
            raise NoResponder(f"no component answered {type(question).__name__} at {address}")
        if isinstance(envelope.body, Refused):
            raise envelope.body.revive()
        if not isinstance(envelope.body, reply):
            self.unreadable += 1
            raise MalformedMessage(f"{address} answered {type(envelope.body).__name__}, not {reply.__name__}")
        return envelope.body

    def publish_to_neighbors(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Deliver a publication to every listener in this process."""
        for listening in self.network.listeners[conversation]:
            if matches(listening.pattern, address):
                self.network.carry_publication(listening, address, envelope)
        for overheard in self.network.overhearers:
            overheard.arrived(address, conversation, envelope)

    def serve_neighbors(self, address: str, accepts: Accepts, answer: Answer) -> Serving:
        """Answer questions from this process; if several neighbors serve an address, the newest one answers."""
        servers = self.network.servers

        def leave() -> None:
            if servers.get(address) is serving:
                del servers[address]

        serving = servers[address] = Serving(self, leave, accepts, answer)
        return serving

    def subscribe_to_neighbors(
        self, address: str, conversation: Conversation, accepts: Accepts, listener: Listener, *, latest: bool
    ) -> Listening:
        """Subscribe to publications of this process."""
        listeners = self.network.listeners[conversation]
        listening = Listening(
            self, lambda: listeners.remove(listening), address, conversation, accepts, listener, latest
        )
        listeners.append(listening)
        return listening

    def dropped(self) -> dict[str, int]:
        """Return the messages that listeners did not get, by key; see ``Bus.dropped``."""
        counts = Counter[str]()
        for one in self.declared:
            if isinstance(one, Listening) and one.overwritten:
                counts[f"{one.pattern}/{one.conversation}"] += one.overwritten
        return dict(counts)

    def overhear_neighbors(
        self, conversation: Conversation, listener: Overhearer, most_waiting_bytes: int, of: str, *, lossless: bool
    ) -> Overheard:
        """Subscribe to a conversation of components of this process."""
        most_waiting_bytes = MOST_KEPT_BYTES if lossless else most_waiting_bytes
        overhearers = self.network.overhearers
        overheard = Overheard(
            self, lambda: overhearers.remove(overheard), conversation, listener, most_waiting_bytes, of
        )
        overhearers.append(overheard)
        return overheard

    def declare_to_neighbors(self, address: str) -> NeighborDeclaration:
        """Declare a token in this process."""
        tokens = self.network.tokens.setdefault(address, [])

        def fall() -> None:
            tokens.remove(token)
            if not tokens:
                self._tell_watchers(address, alive=False)

        token = NeighborDeclaration(self, fall)
        tokens.append(token)
        if len(tokens) == 1:
            self._tell_watchers(address, alive=True)
        return token

    def watch_neighbors(self, address: str, listener: LifeListener) -> Watching:
        """Watch the tokens of this process."""
        watchers = self.network.watchers
        watching = Watching(self, lambda: watchers.remove(watching), address, listener)
        watchers.append(watching)
        for standing, tokens in self.network.tokens.items():
            if tokens:
                self.network.carry_life(watching, standing, alive=True)
        return watching

    def is_overheard_by_neighbors(self, conversation: Conversation) -> bool:
        """Return whether a component in this process hears this conversation at this bus's own address."""
        network = self.network
        if not network.overhearers and not network.listeners[conversation]:  # as for most questions
            return False
        return any(overheard.hears(self.source, conversation) for overheard in network.overhearers) or any(
            matches(listening.pattern, self.source) for listening in network.listeners[conversation]
        )

    def take_back_from_neighbors(self) -> None:
        """Withdraw all declarations in this process."""
        for declared in list(self.declared):
            declared.close()

    def _tell_watchers(self, address: str, *, alive: bool) -> None:
        for watching in list(self.network.watchers):
            self.network.carry_life(watching, address, alive)


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

    def declare_publisher(self, address: str, conversation: Conversation) -> None:
        """Do nothing: inside one process nothing is declared; see ``Bus.declare_publisher``."""

    def pass_on(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Send a message of another sender; see ``Bus.pass_on``."""
        if not self.closed:
            _check(self.mission, address)
            self.publish_to_neighbors(address, conversation, envelope)

    def subscribe(
        self,
        address: str,
        conversation: Conversation,
        accepts: Accepts,
        listener: Listener,
        *,
        latest: bool = False,
        lossless: bool = False,
    ) -> Listening:
        """Subscribe to publications; see ``Bus.subscribe``. Inside one process no message is dropped."""
        self.require_open()
        _check(self.mission, address)
        return self.subscribe_to_neighbors(address, conversation, accepts, listener, latest=latest and not lossless)

    def overhear(
        self,
        conversation: Conversation,
        listener: Overhearer,
        most_waiting_bytes: int,
        of: str = "",
        *,
        lossless: bool = False,
    ) -> Overheard:
        """Subscribe to a conversation of one component or of all; see ``Bus.overhear``."""
        self.require_open()
        return self.overhear_neighbors(conversation, listener, most_waiting_bytes, of, lossless=lossless)

    def is_overheard(self, conversation: Conversation) -> bool:
        """Return whether a component hears this conversation at this bus's own address."""
        return self.is_overheard_by_neighbors(conversation)

    def is_unheard(self, conversation: Conversation) -> bool:
        """Return whether no component hears this conversation; see ``Bus.is_unheard``."""
        return not any(map(self.is_overheard_by_neighbors, (conversation, Conversation.TOLD)))

    def declare_alive(self, address: str) -> NeighborDeclaration:
        """Declare a liveliness token; see ``Bus.declare_alive``."""
        self.require_open()
        _check(self.mission, address)
        return self.declare_to_neighbors(address)

    def watch_alive(self, address: str, listener: LifeListener) -> Watching:
        """Watch liveliness tokens; see ``Bus.watch_alive``."""
        self.require_open()
        _check(self.mission, address)
        return self.watch_neighbors(address, listener)

    def watch_link(self, listener: LinkListener) -> NeighborDeclaration:
        """Report the link, which is always up inside one process."""
        self.require_open()
        watching = NeighborDeclaration(self, lambda: None)

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
    else:
        server.owner.unreadable += 1
        schema = schema_of(type(asked.body))
        accepted = ", ".join(sorted(schema_of(kind) for kind in server.kinds))
        refusal = UnknownMessage(f"{schema} is not answered here", schema=schema, accepted=accepted)
        reply = server.owner.envelope(Refused.of(refusal))
    if reply is not None:
        server.owner.tell(server.owner.source, Conversation.ASK, asked, reply)
    return reply


def _outcome(answering: asyncio.Task[Envelope[Message] | None]) -> Envelope[Message] | None:
    return None if answering.cancelled() or answering.exception() is not None else answering.result()


@functools.lru_cache(maxsize=ADDRESSES_KEPT)
def _check(mission: str, address: str) -> None:
    """Refuse the names that the bus between processes refuses in keys."""
    key(mission, address, Conversation.ASK)
