"""The bus between processes, over Eclipse Zenoh.

Zenoh's threads never run component code: they put arrivals into an inbox and wake the event loop once for a whole
burst. Callbacks of ``get`` are direct, because zenoh would start a thread for each indirect one. Callbacks of tokens
and, outside the hub, of subscribers are direct, too. Inboxes and queryables keep their one indirect thread.

Measured: ``express`` on questions and replies only, blocking for messages that are sent once, dropping for repeated
messages (docs/decisions/0003-zenoh-settings.md).
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable
from functools import partial
from typing import Any, cast

import zenoh

from backbone.bus.answers import Came, NoInbox, TooLate, read_answer
from backbone.bus.bus_base import quoted
from backbone.bus.declared import Together
from backbone.bus.host_boards import HostBoards
from backbone.bus.host_copies import HostCopies, copies_for
from backbone.bus.host_lines import lines_for
from backbone.bus.inbox import EachSample, LatestSample, OverheardSamples, bytes_of, reader_of
from backbone.bus.interface import Answer, Clock, Listener, Overhearer, Overhearing, Reply, Subscription
from backbone.bus.lossless_streams import LosslessOverhearing, LosslessSamples, LosslessStreams
from backbone.bus.near_listening import EachNear, NearListening
from backbone.bus.zenoh_far_copies import FarCopies, copiers, send_copies
from backbone.bus.zenoh_life import LifeBus
from backbone.bus.zenoh_links import Links
from backbone.bus.zenoh_outlets import Outlet, Outlets, Receiver
from backbone.bus.zenoh_questions import Asked, DirectQuestion, Query, Ways, new_inbox, query
from backbone.bus.zenoh_sessions import client_config, close_session, hub_config, is_hub, open_session, open_when_up
from backbone.bus.zenoh_subscribers import Subscribers
from backbone.errors import Refusal
from backbone.keys import Conversation, key, key_of_all, key_of_senders, sender_of
from backbone.quality import EACH_ON_HOST, LARGE, NEVER_DROPPED, QUALITY
from backbone.wire import (
    Accepts,
    Envelope,
    MalformedMessage,
    Message,
    OversizedMessage,
    Reader,
    Refused,
    UnwritableMessage,
    write,
)

__all__ = ["ZenohBus", "client_config", "hub_config"]

log = logging.getLogger(__name__)

_TIMEOUT_PAYLOAD = b"Timeout"
TELL_WITHIN_S = 0.01  # chosen: copies for recorders are made after a context switch, not in it; a crash loses so much


class ZenohBus(LifeBus):
    """One component's bus on a Zenoh session. Open it inside a running event loop.

    Args:
        session: Closed with the bus, unless it is ``shared``.
        is_hub: True if the session is the hub itself.
        shared: True if other buses of this process use the session too. Then publications reach other processes only.
    """

    def __init__(
        self,
        mission: str,
        source: str,
        clock: Clock,
        session: zenoh.Session,
        *,
        is_hub: bool = False,
        shared: bool = False,
    ) -> None:
        super().__init__(mission, source, clock, session, is_hub=is_hub)
        self.copies: HostCopies | None = None
        """Copies for the recorder of this host; see ``use_host``."""
        self.far = None if shared else FarCopies(session, mission, source)
        """Copies for the recorder of the mission, if no socket leads to it; settable."""
        self.boards: HostBoards | None = None
        """Boards for large values to and from this host; settable before the first message."""
        self.subscribers = Subscribers(session, is_hub=is_hub)
        """Settable: one for all buses of a session."""
        self._shared = shared
        self._links = None if shared else Links(session, is_hub=is_hub)
        self._outlets = Outlets(session, mission, source, self.quality, only_elsewhere=shared)
        self.lossless = LosslessStreams(self, session, mission, source, only_elsewhere=shared)
        """Streams to listeners that must get every message."""
        self.ways = Ways(self, session, mission, source, only_elsewhere=shared)
        """Ways to the components that this bus asks repeatedly."""
        self._outlet(source, Conversation.TOLD)  # so that it knows its overhearers before the first answer

    @classmethod
    def open(cls, mission: str, source: str, clock: Clock, config: zenoh.Config) -> ZenohBus:
        """Return a bus on a new session.

        Raises:
            HubUnreachable: No hub listens at the endpoint, or (for a hub) the port is taken.
        """
        return cls(mission, source, clock, open_session(config), is_hub=is_hub(config))

    @classmethod
    async def open_when_up(cls, mission: str, source: str, clock: Clock, config: zenoh.Config) -> ZenohBus:
        """Return a bus on a new session as soon as the hub listens, without blocking the event loop.

        Raises:
            HubUnreachable: The hub did not listen within ``OPEN_TIMEOUT_MS``.
        """
        session = await open_when_up(config)
        return cls(mission, source, clock, session, is_hub=is_hub(config))

    def use_host(self, directory: str) -> None:
        """Use the sockets between processes of this host. When: before the first question.

        Args:
            directory: Folder of the mission's files on this host; empty: none, and only the hub is used.
        """
        self.copies, self.ways.lines = copies_for(directory), lines_for(directory)

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component and return its answer; see ``Bus.ask``."""
        asked_key, asked = key(self._mission, address, Conversation.ASK), self.envelope(question)
        payload, came = write(asked), cast("Came", None)
        self.asked += 1
        try:
            came = await self._answer_to(address, asked_key, payload, within_s)
        finally:
            if not isinstance(came, bytes):  # an answerer makes a copy only if its answer was lost or is late
                self.tell(address, Conversation.ASK, asked)
        try:
            return read_answer(came, address, question, reply, within_s)
        except MalformedMessage:
            self.unreadable += 1
            raise

    async def _answer_to(self, address: str, asked_key: str, payload: bytes, within_s: float) -> Came:
        """Ask by the way that is known to the component, else, or if that leads nowhere, by a query."""
        ends_s = self._loop.time() + within_s
        if (way := self.ways.way_to(address)) is not None:
            answered = self.open_question()
            try:
                came = await self.ways.ask(way, payload, answered, within_s)
            finally:
                self.end_question(answered)
            if came is not NoInbox:
                return came
        return await self._query(address, asked_key, payload, ends_s - self._loop.time())

    async def _query(self, address: str, asked_key: str, payload: bytes, within_s: float) -> Came:
        answered = self.open_question()
        try:
            with self.ways.querying(address):
                got = await query(self, self._session, asked_key, payload, answered, within_s)
        finally:
            self.end_question(answered)
        return self._came_of(address, got)

    def _came_of(self, address: str, got: zenoh.Reply | None) -> Came:
        if got is None:
            return None
        if got.err is not None:
            payload = got.err.payload.to_bytes()
            return TooLate if payload == _TIMEOUT_PAYLOAD else payload
        sample = cast("zenoh.Sample", got.ok)
        self.ways.answered(address, sample.attachment)
        return sample.payload.to_bytes()

    def serve(self, address: str, accepts: Accepts, answer: Answer) -> Subscription:
        """Answer questions to this address; see ``Bus.serve``."""
        self.require_open()
        reader = reader_of(accepts)
        own, inbox = key(self._mission, address, Conversation.ASK), new_inbox(self._mission, address)

        def asked(question: Asked) -> None:
            answering = self.start(self._answer(reader, answer, question))
            answering.add_done_callback(lambda _done: question.drop())  # also if it was cancelled before it began

        def asked_by_query(came: zenoh.Query) -> None:
            asked(Query(came, own, inbox))

        def asked_directly(sample: zenoh.Sample) -> None:
            if (question := DirectQuestion.of(self._session, self._mission, sample)) is None:
                self.unreadable += 1
            else:
                asked(question)

        direct = self._session.declare_subscriber(inbox, lambda sample: self.push(asked_directly, sample))
        near = self.ways.lines.serve(address, inbox, asked) if self.ways.lines is not None else None
        queries = self._session.declare_queryable(own, lambda came: self.push(asked_by_query, came))
        return self._declare(Together(direct, near, queries))

    async def _answer(self, reader: Reader[Message], answer: Answer, asked: Asked) -> None:
        came = list[bytes]()
        try:
            came.append(bytes_of(asked.payload))
            question = reader.read(came[0])
            envelope = await self.reply_to(question, answer)
            if envelope is not None:
                asked.answer(self._write_reply(envelope))
                self.tell(self.source, Conversation.ASK, question, envelope)
        except Refusal as unreadable:
            self.unreadable += 1
            refusal = self.envelope(Refused.of(unreadable))
            asked.refuse(write(refusal))
            self.tell(self.source, Conversation.ASK, *map(bytes, came), refusal)
        except zenoh.ZError as error:  # the requester or the link is gone
            log.info("a reply of %s was not sent: %s", self.source, error)
        except Exception as bug:  # the reply cannot be encoded
            self.on_bug(bug)

    def _write_reply(self, envelope: Envelope[Message]) -> bytes:
        try:
            return write(envelope)
        except (OversizedMessage, UnwritableMessage) as refusal:
            return write(self.envelope(Refused.of(refusal)))

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all subscribers; see ``Bus.publish``."""
        if not self.closed:
            envelope = self.send(address, conversation, message)
            if conversation in NEVER_DROPPED:
                self.tell(address, conversation, envelope)

    def send(self, address: str, conversation: Conversation, message: Message) -> Envelope[Message]:
        """Publish over the session, or over the board of a large conversation, and return the envelope."""
        outlet = self._outlet(address, conversation)
        self.published += 1
        envelope = self.envelope(message)
        copies = copiers(self.copies, self.far, conversation)
        apart: list[Receiver] = [partial(copier.send, outlet.key) for copier in copies]
        apart += [partial(stream.send, outlet.key) for stream in self.lossless.to(address, conversation)]
        outlet.send(envelope, apart, self._loop.time())
        return envelope

    def tell(self, address: str, conversation: Conversation, *messages: Envelope[Message] | bytes) -> None:
        """Publish copies if a component overhears; copies of questions with answers go to recorders, too."""
        super().tell(address, conversation, *messages)
        if conversation is Conversation.ASK:
            copies = copiers(self.copies, self.far, conversation)
            for raw in quoted(messages) if copies else ():
                send_copies(copies, key(self._mission, address, conversation), raw)

    def pass_on(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Send a message of another sender; see ``Bus.pass_on``."""
        if not self.closed:
            outlet = self._outlet(address, conversation)
            raw = write(envelope, outlet.quality.most_bytes)
            outlet.publisher.put(raw)
            for stream in self.lossless.to(address, conversation):
                stream.send(outlet.key, raw)
            send_copies(copiers(self.copies, self.far, conversation), outlet.key, raw)

    def declare_publisher(self, address: str, conversation: Conversation) -> None:
        """Declare the publisher of a key; see ``Bus.declare_publisher``."""
        if not self._outlets.is_full:
            self._outlet(address, conversation)

    def is_overheard(self, conversation: Conversation) -> bool:
        """Return whether another process hears this conversation at this bus's own address; 0.5 µs."""
        if self.lossless.to(self.source, conversation):
            return True
        return self._outlet(self.source, conversation).has_subscriber

    def is_unheard(self, conversation: Conversation) -> bool:
        """Return whether certainly no component hears this conversation; False while its publisher is new."""
        is_told = self.is_overheard(Conversation.TOLD) or copiers(self.copies, self.far, conversation)
        if is_told or self.lossless.to(self.source, conversation):
            return False
        return self._outlet(self.source, conversation).is_unheard(self._loop.time())

    def tell_later(self, act: Callable[[], None]) -> None:
        """Call a function when the copies of ``TELL_WITHIN_S`` have gathered."""
        self._loop.call_later(TELL_WITHIN_S, act)

    def _outlet(self, address: str, conversation: Conversation) -> Outlet:
        return self._outlets.outlet(address, conversation, self._loop.time(), self.boards)

    def subscribe(
        self,
        address: str,
        conversation: Conversation,
        accepts: Accepts,
        listener: Listener,
        *,
        latest: bool = False,
        lossless: bool = False,
    ) -> Subscription:
        """Subscribe to publications; see ``Bus.subscribe``."""
        self.require_open()
        pattern, reader = key(self._mission, address, conversation), reader_of(accepts)
        most_bytes = QUALITY[conversation].most_bytes
        if lossless:
            each = EachSample(self, pattern, reader, listener, most_bytes)
            hearing = LosslessSamples(self, self._session, pattern, each.hand_over)
            return self._declare(hearing, hearing)
        is_near = conversation in EACH_ON_HOST or (latest and conversation in LARGE)
        if is_near and self.boards is not None and "*" not in address:
            near = self._listen_near(self.boards, pattern, reader, listener, NearListening if latest else EachNear)
            return self._declare(near, near)
        kind = LatestSample if latest else EachSample
        receive = kind(self, pattern, reader, listener, most_bytes)
        return self._declare(self.subscribers.declare(pattern, receive), receive)

    def dropped(self) -> dict[str, int]:
        """Return the messages that listeners did not get, by key; see ``Bus.dropped``."""
        counts = Counter[str]()
        for one in self._declared:
            if one.receiver is not None and one.receiver.dropped:
                counts[one.receiver.of.split("/", 2)[2]] += one.receiver.dropped
        return dict(counts)

    def _listen_near(
        self, boards: HostBoards, own: str, reader: Reader[Message], listener: Listener, kind: type[NearListening]
    ) -> NearListening:
        """Listen to one key, from boards of this host if its senders have some."""

        def declare(receive: Callable[[zenoh.Sample], None]) -> Any:
            return self.subscribers.declare(own, receive)

        near = kind(self, reader, listener, boards, own, declare)

        def changed(sample: zenoh.Sample) -> None:
            near.sender_changed(sender_of(own, str(sample.key_expr)), sample.kind == zenoh.SampleKind.PUT)

        at_once: Any = zenoh.handlers.Callback(lambda sample: self.push(changed, sample), indirect=False)
        near.tokens = cast(
            "Any", self._session.liveliness().declare_subscriber(key_of_senders(own), at_once, history=True)
        )
        return near

    def overhear(
        self,
        conversation: Conversation,
        listener: Overhearer,
        most_waiting_bytes: int,
        of: str = "",
        *,
        lossless: bool = False,
    ) -> Overhearing:
        """Subscribe to whole conversations, without decoding them; see ``Bus.overhear``."""
        self.require_open()
        heard = OverheardSamples(self, listener, most_waiting_bytes)
        expression = key(self._mission, of, conversation) if of else key_of_all(self._mission, conversation)
        if lossless:
            every = LosslessSamples(self, self._session, expression, heard.hand_over)
            return LosslessOverhearing(self._declare(every, every), every)
        heard.declared = self._declare(self.subscribers.declare(expression, heard))
        return heard

    async def leave(self) -> None:
        """Close the session unless other buses use it; return when its threads have ended."""
        self.empty_inbox()  # pending questions: their requesters get ``NoResponder``
        self.ways.close()
        self.lossless.close()
        if not self._shared:
            if self._links is not None:
                self._links.close()
            self._outlets.close_boards()
            for sockets in (self.far, self.copies, self.ways.lines):
                if sockets is not None:
                    sockets.close()
            await close_session(self._session)
            return
        self._outlets.close()
