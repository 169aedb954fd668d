"""The bus between processes, over Eclipse Zenoh. The only file that imports zenoh.

Zenoh's threads never run component code: they put what arrived into an inbox and wake the event
loop once for a whole burst.  ``get`` callbacks are direct (zenoh would start a thread for each
indirect one); subscribers and queryables keep their one indirect thread.

Settings that were measured: clients of one hub, no scouting, lease 2 s, ``express`` on questions
and replies, commands block, everything else may be dropped (docs/decisions/0003-zenoh-settings.md).
"""

from __future__ import annotations

import asyncio
import json
import logging
from collections import deque
from collections.abc import Callable
from typing import Any, cast

import zenoh

from backbone.bus.interface import Accepted, Answer, Clock, LifeListener, LinkListener, Listener, Reply
from backbone.bus.speaker import Speaker
from backbone.errors import HubUnreachable, NoResponder, Refusal, ReplyTimeout
from backbone.keys import Conversation, address_of, key
from backbone.wire import MalformedMessage, Message, OversizedMessage, Reader, Refused, write

log = logging.getLogger(__name__)

LINK_LEASE_MS = 2000  # chosen: twice the second below which a busy Python loses its own link
RETRY_FIRST_MS, RETRY_MOST_MS, RETRY_FACTOR = 20, 100, 1.5  # chosen: a restarted hub is found within 0.1 s
OPEN_TIMEOUT_MS = 5000  # chosen: a hub that starts on a busy machine is there within this
WAIT_BEFORE_CLOSE_US = 1_000_000  # chosen: the longest a hung consumer may stall a sender
_TIMEOUT_PAYLOAD = b"Timeout"

_URGENT = (zenoh.Priority.REAL_TIME, zenoh.CongestionControl.BLOCK, True)
_USUAL = (zenoh.Priority.DATA, zenoh.CongestionControl.DROP, True)
_BULK = (zenoh.Priority.DATA_LOW, zenoh.CongestionControl.DROP, False)
_QUALITY = {
    Conversation.COMMAND: _URGENT,
    Conversation.LEASES: _URGENT,
    Conversation.FRAMES: _BULK,
    Conversation.LOG: _BULK,
}


def _transport() -> dict[str, Any]:
    return {
        "unicast": {"open_timeout": 2000, "accept_timeout": 2000},
        "link": {
            "tx": {
                "lease": LINK_LEASE_MS,
                "keep_alive": 4,
                "queue": {"congestion_control": {"block": {"wait_before_close": WAIT_BEFORE_CLOSE_US}}},
            }
        },
        "shared_memory": {"enabled": False},
    }


def _config(settings: dict[str, Any]) -> zenoh.Config:
    quiet = {"multicast": {"enabled": False}, "gossip": {"enabled": False}}
    return zenoh.Config.from_json5(json.dumps({"scouting": quiet, "transport": _transport(), **settings}))


def client_config(endpoint: str) -> zenoh.Config:
    """Return the settings of a component that talks through the hub at ``endpoint``."""
    retry = {
        "period_init_ms": RETRY_FIRST_MS,
        "period_max_ms": RETRY_MOST_MS,
        "period_increase_factor": RETRY_FACTOR,
    }
    return _config(
        {
            "mode": "client",
            "connect": {
                "endpoints": [endpoint],
                "timeout_ms": OPEN_TIMEOUT_MS,
                "exit_on_failure": True,
                "retry": retry,
            },
        }
    )


def hub_config(listen: list[str], connect: list[str] | None = None) -> zenoh.Config:
    """Return the settings of a hub that listens on these endpoints and joins the hubs at the others."""
    settings: dict[str, Any] = {
        "mode": "router",
        "listen": {"endpoints": listen, "exit_on_failure": True},
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}, "delay": 0},
    }
    if connect:
        settings["connect"] = {"endpoints": connect, "timeout_ms": -1, "exit_on_failure": False}
    return _config(settings)


class ZenohBus(Speaker):
    """One component's voice and ears on a Zenoh session. Open it inside a running event loop."""

    def __init__(self, mission: str, source: str, clock: Clock, session: zenoh.Session) -> None:
        super().__init__(mission, source, clock)
        self._loop = asyncio.get_running_loop()
        self._session = session
        self._inbox: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._woken = False
        self._declared: list[_Declared] = []
        self._publishers: dict[str, zenoh.Publisher] = {}
        self._closed = False

    @classmethod
    def open(cls, mission: str, source: str, clock: Clock, config: zenoh.Config) -> ZenohBus:
        """Return a bus on a new session.

        Raises:
            HubUnreachable: Nobody listens where the settings say, or (for a hub) the port is taken.
        """
        try:
            session = zenoh.open(config)
        except zenoh.ZError as error:
            raise HubUnreachable(str(error)) from error
        return cls(mission, source, clock, session)

    @classmethod
    async def open_when_up(cls, mission: str, source: str, clock: Clock, config: zenoh.Config) -> ZenohBus:
        """Return a bus on a new session as soon as the hub listens, without holding up the event loop.

        Raises:
            HubUnreachable: It did not listen within ``OPEN_TIMEOUT_MS``.
        """
        try:
            session = await asyncio.get_running_loop().run_in_executor(None, zenoh.open, config)
        except zenoh.ZError as error:
            raise HubUnreachable(str(error)) from error
        return cls(mission, source, clock, session)

    # ------------------------------------------------------------------ questions
    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component and return its answer; see ``Bus.ask``."""
        self.asked += 1
        payload = write(self.envelope(question))
        answered: asyncio.Future[Any] = self._loop.create_future()
        cancel = zenoh.CancellationToken()
        self._session.get(
            key(self._mission, address, Conversation.ASK),
            zenoh.handlers.Callback(
                lambda got: self._push(_settle, answered, got),
                lambda: self._push(_settle, answered, None),
                indirect=False,
            ),  # type: ignore[arg-type]
            payload=payload,
            timeout=within_s,
            express=True,
            cancellation_token=cancel,
        )
        try:
            got = await answered
        except asyncio.CancelledError:
            cancel.cancel()  # type: ignore[no-untyped-call]
            raise
        return self._read_reply(address, question, reply, got, within_s)

    def _read_reply(
        self, address: str, question: Message, reply: type[Reply], got: zenoh.Reply | None, within_s: float
    ) -> Reply:
        what = type(question).__name__
        if got is None:
            raise NoResponder(f"nobody answered {what} at {address}")
        if got.err is not None:
            payload = got.err.payload.to_bytes()
            if payload == _TIMEOUT_PAYLOAD:
                raise ReplyTimeout(f"{address} did not answer {what} within {within_s:g} s")
        else:
            payload = cast("zenoh.Sample", got.ok).payload.to_bytes()
        try:
            body = _reader(reply | Refused).read(payload).body
        except Refusal as unreadable:
            self.unreadable += 1
            raise MalformedMessage(
                f"{address} answered {what} with something else: {unreadable.detail}"
            ) from unreadable
        if isinstance(body, Refused):
            raise body.revive()
        return cast("Reply", body)

    def serve(self, address: str, accepts: Accepted, answer: Answer) -> _Declared:
        """Answer questions asked of this address; see ``Bus.serve``."""
        reader = _reader(accepts)
        own = key(self._mission, address, Conversation.ASK)

        def arrived(query: zenoh.Query) -> None:
            self.start(self._answer(reader, answer, own, query))

        return self._declare(self._session.declare_queryable(own, lambda query: self._push(arrived, query)))

    async def _answer(self, reader: Reader[Any], answer: Answer, own: str, query: zenoh.Query) -> None:
        try:
            try:
                question = reader.read(query.payload.to_bytes() if query.payload is not None else b"")
            except Refusal as refusal:
                self.unreadable += 1
                query.reply_err(write(self.envelope(Refused.of(refusal))))
                return
            envelope = await self.reply_to(question, answer)
            if envelope is not None:
                self._send_reply(query, own, envelope)
        finally:
            query.drop()  # type: ignore[no-untyped-call]

    def _send_reply(self, query: zenoh.Query, own: str, envelope: Any) -> None:
        try:
            payload = write(envelope)
        except OversizedMessage as refusal:
            payload = write(self.envelope(Refused.of(refusal)))
        try:
            query.reply(own, payload, express=True)
        except zenoh.ZError as error:  # the asker or the link is gone: nobody is left to tell
            log.info("reply on %s not sent: %s", own, error)

    # ------------------------------------------------------------------ publications
    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Hand the message to whoever subscribed; see ``Bus.publish``."""
        self.published += 1
        own = key(self._mission, address, conversation)
        publisher = self._publishers.get(own)
        if publisher is None:
            priority, congestion_control, express = _QUALITY.get(conversation, _USUAL)
            publisher = self._session.declare_publisher(
                own, priority=priority, congestion_control=congestion_control, express=express
            )
            self._publishers[own] = publisher
        publisher.put(write(self.envelope(message)))

    def subscribe(
        self, address: str, conversation: Conversation, accepts: Accepted, listener: Listener, *, latest: bool = False
    ) -> _Declared:
        """Hear publications; see ``Bus.subscribe``."""
        pattern = key(self._mission, address, conversation)
        receive = _Latest(self, _reader(accepts), listener) if latest else _Each(self, _reader(accepts), listener)
        return self._declare(self._session.declare_subscriber(pattern, receive))

    # ------------------------------------------------------------------ life
    def declare_alive(self, address: str) -> _Declared:
        """Raise a liveliness token; see ``Bus.declare_alive``."""
        own = key(self._mission, address, Conversation.ALIVE)
        return self._declare(self._session.liveliness().declare_token(own))

    def watch_alive(self, address: str, listener: LifeListener) -> _Declared:
        """Watch liveliness tokens; see ``Bus.watch_alive``."""

        def changed(of: str, alive: bool) -> None:
            try:
                listener(of, alive)
            except Exception as bug:
                self.on_bug(bug)

        def arrived(sample: zenoh.Sample) -> None:
            self._push(changed, address_of(str(sample.key_expr)), sample.kind == zenoh.SampleKind.PUT)

        pattern = key(self._mission, address, Conversation.ALIVE)
        return self._declare(self._session.liveliness().declare_subscriber(pattern, arrived, history=True))

    def watch_link(self, listener: LinkListener) -> _Declared:
        """Report when this session's link goes or comes; see ``Bus.watch_link``."""

        def arrived(event: zenoh.TransportEvent) -> None:
            self._push(listener, event.kind == zenoh.SampleKind.PUT)

        return self._declare(self._session.info.declare_transport_events_listener(arrived, history=True))

    async def close(self) -> None:
        """Take back everything declared and close the session; see ``Bus.close``."""
        if self._closed:
            return
        self._closed = True
        await self.end_tasks()
        for declared in list(self._declared):
            declared.close()
        await self._loop.run_in_executor(None, self._session.close)

    # ------------------------------------------------------------------ from zenoh's threads into the loop
    def _push(self, act: Callable[..., None], *arguments: Any) -> None:
        """Have the loop call ``act(*arguments)``; called from zenoh's threads."""
        self._inbox.append((act, arguments))
        if not self._woken:
            self._woken = True
            try:
                self._loop.call_soon_threadsafe(self._drain)
            except RuntimeError:  # the loop is closed: nobody is left to be told
                log.debug("inbox dropped after the loop's end")

    def _drain(self) -> None:
        self._woken = False
        for _ in range(len(self._inbox)):
            act, arguments = self._inbox.popleft()
            act(*arguments)
        if self._inbox and not self._woken:
            self._woken = True
            self._loop.call_soon(self._drain)

    def _declare(self, entity: Any) -> _Declared:
        declared = _Declared(entity, self._declared)
        self._declared.append(declared)
        return declared


class _Declared:
    """A zenoh entity that can be taken back once."""

    def __init__(self, entity: Any, register: list[_Declared]) -> None:
        self._entity, self._register = entity, register

    def close(self) -> None:
        if self in self._register:
            self._register.remove(self)
            try:
                self._entity.undeclare()
            except zenoh.ZError as error:  # the session ended first and took it along
                log.debug("undeclare after close: %s", error)


class _Each:
    """Receives every sample of a subscriber, in order."""

    def __init__(self, bus: ZenohBus, reader: Reader[Any], listener: Listener) -> None:
        self._bus, self._reader, self._listener = bus, reader, listener

    def __call__(self, sample: zenoh.Sample) -> None:
        self._bus._push(self._hand_over, sample)  # noqa: SLF001  same file, same secret

    def _hand_over(self, sample: zenoh.Sample) -> None:
        try:
            envelope = self._reader.read(sample.payload.to_bytes())
        except Refusal as unreadable:
            self._bus.unreadable += 1
            log.warning("unreadable publication on %s: %s", sample.key_expr, unreadable.detail)
            return
        self._bus.hear(self._listener, envelope)


class _Latest(_Each):
    """Receives only the newest sample not yet handed over."""

    def __init__(self, bus: ZenohBus, reader: Reader[Any], listener: Listener) -> None:
        super().__init__(bus, reader, listener)
        self._newest: zenoh.Sample | None = None

    def __call__(self, sample: zenoh.Sample) -> None:
        waiting, self._newest = self._newest is not None, sample
        if not waiting:
            self._bus._push(self._hand_over_newest)  # noqa: SLF001

    def _hand_over_newest(self) -> None:
        sample, self._newest = self._newest, None
        if sample is not None:
            self._hand_over(sample)


def _settle(answered: asyncio.Future[Any], got: zenoh.Reply | None) -> None:
    if not answered.done():
        answered.set_result(got)


_readers: dict[Any, Reader[Any]] = {}


def _reader(accepts: Accepted) -> Reader[Any]:
    reader = _readers.get(accepts)
    if reader is None:
        reader = _readers[accepts] = Reader(accepts)
    return reader
