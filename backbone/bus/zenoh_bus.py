"""The bus between processes, over Eclipse Zenoh. The only file that imports zenoh.

Zenoh's threads never run component code: they put arrivals into an inbox and wake the event loop once for a whole
burst. ``get`` callbacks are direct, because zenoh would start a thread for each indirect one, and so are those about
tokens; other subscribers and queryables keep their one indirect thread.

Measured: ``express`` on questions and replies only, blocking for messages that are sent once, dropping for repeated
messages (docs/decisions/0003-zenoh-settings.md).
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections import OrderedDict
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from typing import Any, cast

import zenoh

from backbone.bus.bus_base import quoted
from backbone.bus.host_copies import HostCopies
from backbone.bus.inbox import (
    EachSample,
    InboxBus,
    LatestSample,
    OverheardSamples,
    bytes_of,
    reader_of,
    reply_reader_of,
)
from backbone.bus.interface import (
    Answer,
    Clock,
    LifeListener,
    LinkListener,
    Listener,
    Overhearer,
    Overhearing,
    Reply,
    Subscription,
)
from backbone.bus.sockets import close_without_waiting
from backbone.bus.zenoh_settings import LINK_LEASE_MS, client_settings, hub_settings
from backbone.errors import HubUnreachable, NoResponder, Refusal, ReplyTimeout
from backbone.keys import NEVER_DROPPED, Conversation, address_of, key, key_of_all
from backbone.waiting import settle
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

log = logging.getLogger(__name__)

_TIMEOUT_PAYLOAD = b"Timeout"

# Priority, and congestion control for a full queue. Never express: without batching a queue holds two messages and
# dropped up to 360 of a burst of 1000; with batching it dropped none, at a thirtieth of the sender's cost.
_URGENT = (zenoh.Priority.REAL_TIME, zenoh.CongestionControl.BLOCK)
_SURE = (zenoh.Priority.DATA, zenoh.CongestionControl.BLOCK)
TELL_WITHIN_S = 0.01  # chosen: copies for recorders are made after a context switch, not in it; a death loses so much
UNHEARD_AFTER_S = 1.0  # chosen: the hub reports its subscribers to a new publisher in milliseconds; until then it sends
MOST_PUBLISHERS = 64  # chosen: most components have far fewer; a framegrabber has one for each of its ARCs
_REPEATED = (zenoh.Priority.DATA, zenoh.CongestionControl.DROP)
_BULK = (zenoh.Priority.DATA_LOW, zenoh.CongestionControl.DROP)
_FOR_RECORDERS = (zenoh.Priority.BACKGROUND, zenoh.CongestionControl.DROP)
_QUALITY = {
    Conversation.COMMAND: _URGENT,
    Conversation.LEASES: _URGENT,
    Conversation.STATUS: _SURE,
    Conversation.EVENTS: _SURE,
    Conversation.OPERATORS: _SURE,
    Conversation.SCHEDULE: _SURE,
    Conversation.FRAMES: _BULK,
    Conversation.LOG: _BULK,
    Conversation.TOLD: _FOR_RECORDERS,
    Conversation.DECISIONS: _FOR_RECORDERS,
}


def client_config(endpoint: str, secret: str = "") -> zenoh.Config:
    """Return the configuration of a client; see ``client_settings``."""
    return _config(client_settings(endpoint, secret))


def hub_config(listen: list[str], connect: list[str] | None = None, *, dictionary_file: str = "") -> zenoh.Config:
    """Return the configuration of a hub; see ``hub_settings``."""
    return _config(hub_settings(listen, connect or [], dictionary_file))


def _config(settings: dict[str, object]) -> zenoh.Config:
    return zenoh.Config.from_json5(json.dumps(settings))


def _is_hub(config: zenoh.Config) -> bool:
    return bool(json.loads(config.get_json("mode")) == "router")


def _unreachable(config: zenoh.Config, error: zenoh.ZError) -> HubUnreachable:
    """Return the error of a session that did not open; zenoh's own text names lines of its source."""
    if _is_hub(config):
        return HubUnreachable(str(error))
    return HubUnreachable(f"no hub answers at {', '.join(json.loads(config.get_json('connect/endpoints')))}")


def open_session(config: zenoh.Config) -> zenoh.Session:
    """Return a new session.

    Raises:
        HubUnreachable: No hub listens at the endpoint, or (for a hub) the port is taken.
    """
    try:
        return zenoh.open(config)
    except zenoh.ZError as error:
        raise _unreachable(config, error) from error


def watch_links(session: zenoh.Session) -> zenoh.LinkEventsListener[None]:
    """Keep the close of this session's TCP links from blocking, while the result is kept."""

    def changed(event: zenoh.LinkEvent) -> None:
        if event.kind == zenoh.SampleKind.PUT and event.link.src.startswith("tcp/"):
            close_without_waiting()

    return session.info.declare_link_events_listener(zenoh.handlers.Callback(changed, indirect=False), history=True)


async def close_session(session: zenoh.Session) -> None:
    """Close the session; return when its threads have ended."""
    await asyncio.get_running_loop().run_in_executor(None, session.close)


class ZenohBus(InboxBus):
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
        super().__init__(mission, source, clock)
        self.copies: HostCopies | None = None
        """For the recorder of this host; settable. A bus with a session of its own closes them."""
        self._session, self._is_hub, self._shared = session, is_hub, shared
        self._links = None if shared else watch_links(session)
        self._declared: set[_Declared] = set()
        self._publishers: OrderedDict[tuple[str, Conversation], zenoh.Publisher] = OrderedDict()
        self._unheard_from_s: dict[tuple[str, Conversation], float] = {}
        self._publisher(source, Conversation.TOLD)  # knows who overhears before the first question is answered

    @classmethod
    def open(cls, mission: str, source: str, clock: Clock, config: zenoh.Config) -> ZenohBus:
        """Return a bus on a new session.

        Raises:
            HubUnreachable: No hub listens at the endpoint, or (for a hub) the port is taken.
        """
        return cls(mission, source, clock, open_session(config), is_hub=_is_hub(config))

    @classmethod
    async def open_when_up(cls, mission: str, source: str, clock: Clock, config: zenoh.Config) -> ZenohBus:
        """Return a bus on a new session as soon as the hub listens, without blocking the event loop.

        Raises:
            HubUnreachable: The hub did not listen within ``OPEN_TIMEOUT_MS``.
        """
        pool = ThreadPoolExecutor(max_workers=1, thread_name_prefix="zenoh_open")
        opening = pool.submit(zenoh.open, config)
        pool.shutdown(wait=False)
        try:
            session = await asyncio.shield(asyncio.wrap_future(opening))
        except asyncio.CancelledError:
            opening.add_done_callback(_close_unwanted)
            raise
        except zenoh.ZError as error:
            raise _unreachable(config, error) from error
        return cls(mission, source, clock, session, is_hub=_is_hub(config))

    # ------------------------------------------------------------------ questions
    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component and return its answer; see ``Bus.ask``."""
        asked_key = key(self._mission, address, Conversation.ASK)
        answered = self.open_question()
        self.asked += 1
        arrived = _Arrived(self, answered)
        cancel = zenoh.CancellationToken()
        try:
            payload = write(self.envelope(question))
            self._session.get(
                asked_key,
                zenoh.handlers.Callback(arrived.reply, arrived.end, indirect=False),
                payload=payload,
                timeout=max(0.0, within_s),
                express=True,
                cancellation_token=cancel,
            )
            got = await answered
        except asyncio.CancelledError:
            cancel.cancel()  # type: ignore[no-untyped-call]
            raise
        finally:
            self.end_question(answered)
        return self._read_reply(address, question, reply, got, within_s)

    def _read_reply(
        self, address: str, question: Message, reply: type[Reply], got: zenoh.Reply | None, within_s: float
    ) -> Reply:
        what = type(question).__name__
        if got is None:
            raise NoResponder(f"no component answered {what} at {address}")
        if got.err is not None:
            payload = got.err.payload.to_bytes()
            if payload == _TIMEOUT_PAYLOAD:
                raise ReplyTimeout(f"{address} did not answer {what} within {within_s:g} s")
        else:
            payload = cast("zenoh.Sample", got.ok).payload.to_bytes()
        try:
            body = reply_reader_of(reply).read(payload).body
        except Refusal as unreadable:
            self.unreadable += 1
            raise MalformedMessage(
                f"{address} answered {what} with something else: {unreadable.detail}"
            ) from unreadable
        if isinstance(body, Refused):
            raise body.revive()
        return cast("Reply", body)

    def serve(self, address: str, accepts: Accepts, answer: Answer) -> Subscription:
        """Answer questions to this address; see ``Bus.serve``."""
        self.require_open()
        reader = reader_of(accepts)
        own = key(self._mission, address, Conversation.ASK)

        def arrived(query: zenoh.Query) -> None:
            self.start(self._answer(reader, answer, own, query))

        return self._declare(self._session.declare_queryable(own, lambda query: self.push(arrived, query)))

    async def _answer(self, reader: Reader[Message], answer: Answer, own: str, query: zenoh.Query) -> None:
        try:
            question = reader.read(bytes_of(query.payload))
            envelope = await self.reply_to(question, answer)
            if envelope is not None:
                query.reply(own, self._write_reply(envelope), express=True)
                self.tell(self.source, Conversation.ASK, question, envelope)
        except Refusal as unreadable:
            self.unreadable += 1
            query.reply_err(write(self.envelope(Refused.of(unreadable))))
        except zenoh.ZError as error:  # the requester or the link is gone
            log.info("reply on %s not sent: %s", own, error)
        except Exception as bug:  # the reply cannot be encoded
            self.on_bug(bug)
        finally:
            query.drop()  # type: ignore[no-untyped-call]

    def _write_reply(self, envelope: Envelope[Message]) -> bytes:
        try:
            return write(envelope)
        except (OversizedMessage, UnwritableMessage) as refusal:
            return write(self.envelope(Refused.of(refusal)))

    # ------------------------------------------------------------------ publications
    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all subscribers; see ``Bus.publish``."""
        if not self.closed:
            envelope = self.send(address, conversation, message)
            if conversation in NEVER_DROPPED:
                self.tell(address, conversation, envelope)

    def send(self, address: str, conversation: Conversation, message: Message) -> Envelope[Message]:
        """Publish over the session and return the envelope. An output that nobody out there hears is not encoded."""
        publisher = self._publisher(address, conversation)
        self.published += 1
        envelope = self.envelope(message)
        copies = self.copies
        if copies is not None and (conversation is Conversation.TOLD or not copies.wants(conversation)):
            copies = None
        if copies is None and conversation is Conversation.OUTPUTS and self._is_unheard(address, conversation):
            return envelope
        raw = write(envelope)
        publisher.put(raw)
        if copies is not None:
            copies.send(key(self._mission, address, conversation), raw)
        return envelope

    def _is_unheard(self, address: str, conversation: Conversation) -> bool:
        """Return whether certainly no other process subscribes to this; 0.5 µs."""
        if self._loop.time() < self._unheard_from_s[address, conversation]:
            return False
        publisher = cast("Any", self._publishers[address, conversation])  # zenoh's stubs say bool of its status
        return not publisher.matching_status.matching

    def tell(self, address: str, conversation: Conversation, *messages: Envelope[Message]) -> None:
        """Publish copies if a component overhears; questions with answers go to the recorder of this host, too."""
        super().tell(address, conversation, *messages)
        if conversation is Conversation.ASK and self.copies is not None and self.copies.wants(conversation):
            for raw in quoted(messages):
                self.copies.send(key(self._mission, address, conversation), raw)

    def pass_on(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Send a message of another sender; see ``Bus.pass_on``."""
        if not self.closed:
            self._publisher(address, conversation).put(write(envelope))

    def is_overheard(self, conversation: Conversation) -> bool:
        """Return whether another process hears this conversation of its own address; 0.5 µs."""
        publisher = cast("Any", self._publisher(self.source, conversation))  # zenoh's stubs say bool of its status
        return bool(publisher.matching_status.matching)

    def tell_later(self, act: Callable[[], None]) -> None:
        """Call a function when the copies of ``TELL_WITHIN_S`` have gathered."""
        self._loop.call_later(TELL_WITHIN_S, act)

    def _publisher(self, address: str, conversation: Conversation) -> zenoh.Publisher:
        publisher = self._publishers.get((address, conversation)) or self._declare_publisher(address, conversation)
        self._publishers.move_to_end((address, conversation))
        return publisher

    def _declare_publisher(self, address: str, conversation: Conversation) -> zenoh.Publisher:
        priority, congestion_control = _QUALITY.get(conversation, _REPEATED)
        publisher = self._publishers[address, conversation] = self._session.declare_publisher(
            key(self._mission, address, conversation),
            priority=priority,
            congestion_control=congestion_control,
            allowed_destination=zenoh.Locality.REMOTE if self._shared else zenoh.Locality.ANY,
        )
        self._unheard_from_s[address, conversation] = self._loop.time() + UNHEARD_AFTER_S
        while len(self._publishers) > MOST_PUBLISHERS:
            silent, longest_silent = self._publishers.popitem(last=False)
            del self._unheard_from_s[silent]
            longest_silent.undeclare()  # type: ignore[no-untyped-call]
        return publisher

    def subscribe(
        self, address: str, conversation: Conversation, accepts: Accepts, listener: Listener, *, latest: bool = False
    ) -> Subscription:
        """Subscribe to publications; see ``Bus.subscribe``."""
        self.require_open()
        pattern = key(self._mission, address, conversation)
        receive = (
            LatestSample(self, reader_of(accepts), listener)
            if latest
            else EachSample(self, reader_of(accepts), listener)
        )
        return self._declare(self._session.declare_subscriber(pattern, receive))

    def overhear(
        self, conversation: Conversation, listener: Overhearer, most_waiting_bytes: int, of: str = ""
    ) -> Overhearing:
        """Subscribe to whole conversations, unread; see ``Bus.overhear``."""
        self.require_open()
        heard = OverheardSamples(self, listener, most_waiting_bytes)
        expression = key(self._mission, of, conversation) if of else key_of_all(self._mission, conversation)
        heard.declared = self._declare(self._session.declare_subscriber(expression, heard))
        return heard

    # ------------------------------------------------------------------ life
    def declare_alive(self, address: str) -> Subscription:
        """Raise this component's liveliness token; see ``Bus.declare_alive``."""
        self.require_open()
        own = key(self._mission, address, Conversation.ALIVE)
        return self._declare(self._session.liveliness().declare_token(own))

    async def stands(self, address: str) -> bool:
        """Return whether the hub has a token at this address; False without a hub.

        Raises:
            NoResponder: The bus is closed already.
        """
        answered = self.open_question()
        arrived = _Arrived(self, answered)
        try:
            self._session.liveliness().get(
                key(self._mission, address, Conversation.ALIVE),
                zenoh.handlers.Callback(arrived.reply, arrived.end, indirect=False),
                timeout=LINK_LEASE_MS / 1000,
            )
            got = await answered
        finally:
            self.end_question(answered)
        return got is not None and got.ok is not None

    def watch_alive(self, address: str, listener: LifeListener) -> Subscription:
        """Watch liveliness tokens; see ``Bus.watch_alive``."""
        self.require_open()

        def changed(sample: zenoh.Sample) -> None:
            self.call("", listener, address_of(str(sample.key_expr)), sample.kind == zenoh.SampleKind.PUT)

        def heard(sample: zenoh.Sample) -> None:
            self.push(changed, sample)

        pattern = key(self._mission, address, Conversation.ALIVE)
        at_once = zenoh.handlers.Callback(heard, indirect=False)
        return self._declare(self._session.liveliness().declare_subscriber(pattern, at_once, history=True))

    def watch_link(self, listener: LinkListener) -> _Declared:
        """Report the loss and return of this session's link; see ``Bus.watch_link``.

        The link of a hub is always up.
        """
        self.require_open()
        if self._is_hub:
            always = self._declare(None)

            def tell(_event: None) -> None:
                if always.stands:
                    self.call("", listener, True)

            self.push(tell, None)
            return always

        def changed(event: zenoh.TransportEvent) -> None:
            self.call("", listener, event.kind == zenoh.SampleKind.PUT)

        return self._declare(
            self._session.info.declare_transport_events_listener(lambda event: self.push(changed, event), history=True)
        )

    # ------------------------------------------------------------------ leaving
    def take_back(self) -> None:
        """Withdraw all declarations."""
        for declared in tuple(self._declared):
            declared.close()

    async def leave(self) -> None:
        """Close the session unless other buses use it; return when its threads have ended."""
        self.empty_inbox()  # pending questions: their requesters get ``NoResponder``
        if not self._shared:
            if self.copies is not None:
                self.copies.close()
            await close_session(self._session)
            return
        for publisher in self._publishers.values():
            publisher.undeclare()  # type: ignore[no-untyped-call]
        self._publishers.clear()

    def _declare(self, entity: Any) -> _Declared:
        declared = _Declared(entity, self._declared)
        self._declared.add(declared)
        return declared


class _Declared:
    """A zenoh entity that can be withdrawn once; None if no entity was needed."""

    def __init__(self, entity: Any, register: set[_Declared]) -> None:
        self._entity, self._register = entity, register

    @property
    def stands(self) -> bool:
        """True until it is withdrawn."""
        return self in self._register

    def close(self) -> None:
        """Withdraw the declaration."""
        if self.stands:
            self._register.remove(self)
            if self._entity is not None:
                self._entity.undeclare()


class _Arrived:
    """Passes a question's first reply to the loop, or None if there was none."""

    __slots__ = ("_answered", "_bus", "_replied")

    def __init__(self, bus: ZenohBus, answered: asyncio.Future[zenoh.Reply | None]) -> None:
        self._bus, self._answered, self._replied = bus, answered, False

    def reply(self, got: zenoh.Reply) -> None:
        self._replied = True  # exactly one component answers, so the end that follows adds nothing
        self._bus.push(self._settle, got)

    def end(self) -> None:
        if not self._replied:
            self._bus.push(self._settle, None)

    def _settle(self, got: zenoh.Reply | None) -> None:
        settle(self._answered, got)


def _close_unwanted(opening: Future[zenoh.Session]) -> None:
    """Close a session that opened after its opener was cancelled, because an open session keeps the process alive."""
    if opening.exception() is None:
        opening.result().close()  # type: ignore[no-untyped-call]
