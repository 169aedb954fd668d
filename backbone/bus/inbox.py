"""Inbox: passes arrivals from other threads to the event loop, which is woken once for a whole burst."""

from __future__ import annotations

import asyncio
import logging
import threading
import time
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Callable
from functools import cache
from typing import Any, Protocol, TypeVar

from backbone.bus.bus_base import BusBase
from backbone.bus.interface import Clock, Listener, Overhearer, Subscription
from backbone.errors import Refusal
from backbone.wire import MAX_MESSAGE_BYTES, Accepts, Envelope, Message, Reader, Refused, refuse_oversized

log = logging.getLogger(__name__)
T = TypeVar("T")

MOST_WAITING_BYTES = 64 * 1024 * 1024  # chosen: for one listener; seconds of the traffic of a busy component
AT_ONCE_S = 0.01  # chosen: a timer is at most so late by a flood of messages; an honest burst takes less
BATCH_BYTES = 64 * 1024  # zenoh 1.10: a message keeps in memory the whole batch in which it came
GATHER_S = 0.05  # chosen: a component that overhears a mission is woken at most twenty times a second


class Payload(Protocol):
    """Bytes that are not copied yet."""

    def __len__(self) -> int: ...

    def to_bytes(self) -> bytes:
        """Return a copy."""


class Sample(Protocol):
    """A publication as it arrives."""

    @property
    def key_expr(self) -> object:
        """Its key."""

    @property
    def payload(self) -> Payload:
        """Its bytes."""

    @property
    def attachment(self) -> Payload | None:
        """Bytes that travel with it."""


class Whole(bytes):
    """Bytes with the interface of a payload."""

    def to_bytes(self) -> bytes:
        """Return itself."""
        return self


Arrival = tuple[str, Payload]
"""Key and payload of a publication that waits for the event loop."""


class InboxBus(BusBase):
    """Base class of a bus whose arrivals come in other threads. Make it inside a running event loop."""

    def __init__(self, mission: str, source: str, clock: Clock) -> None:
        super().__init__(mission, source, clock)
        self._loop = asyncio.get_running_loop()
        self._inbox: deque[tuple[Callable[..., None], Any]] = deque()
        self._woken = self._has_gathering = False

    def push(self, act: Callable[[T], None], what: T) -> None:
        """Make the loop call ``act(what)``; called from any thread."""
        self._inbox.append((act, what))
        if not self._woken:
            self._wake()

    def gather(self, act: Callable[[T], None], what: T) -> None:
        """Make the loop call ``act(what)`` within ``GATHER_S``, in one burst with others; called from any thread."""
        self._inbox.append((act, what))
        if not (self._woken or self._has_gathering):
            self._has_gathering = True
            self._call_soon(self._loop.call_later, GATHER_S, self._drain)

    def _wake(self) -> None:
        self._woken = True
        self._call_soon(self._drain)

    def _call_soon(self, act: Callable[..., object], *arguments: object) -> None:
        try:
            self._loop.call_soon_threadsafe(act, *arguments)
        except RuntimeError:  # the loop is closed
            log.debug("inbox dropped after the loop's end")

    def _drain(self) -> None:
        """Hand arrivals over for ``AT_ONCE_S``; then the rest of the event loop has its turn before the next ones."""
        self._woken, self._has_gathering = True, False
        try:
            self._hand_over_until(time.monotonic() + AT_ONCE_S)
        finally:
            if self._inbox:
                self._wake()
            else:
                self._woken = False
                if self._inbox and not self._woken:  # another thread pushed in between, and did not wake the loop
                    self._wake()

    def _hand_over_until(self, end_s: float) -> None:
        while self._inbox and time.monotonic() < end_s:
            act, what = self._inbox.popleft()
            if self.closed:
                continue
            try:
                act(what)
            except Exception as bug:  # one bad arrival must not lose the rest of the burst
                self.on_bug(bug)

    def empty_inbox(self) -> None:
        """Drop the arrivals that are not handed over yet."""
        self._inbox.clear()


class Receiving(Protocol):
    """Receiver of the messages of a subscription."""

    @property
    def of(self) -> str:
        """Key, or pattern of keys."""

    @property
    def dropped(self) -> int:
        """Messages that came for it and were not handed over."""


class _Waiting:
    """Bytes that wait for the event loop, and number of messages without room. Used from several threads."""

    def __init__(self, most_bytes: int) -> None:
        self._most, self._bytes, self._guard = most_bytes, 0, threading.Lock()
        self.dropped = 0

    def admits(self, length: int) -> bool:
        """Count a message of this length, or return False if too many bytes wait."""
        with self._guard:
            has_room = self._bytes + length <= self._most
            self._bytes += length if has_room else 0
            self.dropped += not has_room
            return has_room

    def ends(self, length: int) -> None:
        """Record that a message of this length waits no longer."""
        with self._guard:
            self._bytes -= length


class _InOrder(ABC):
    """Receives every sample of a subscriber, in order, as long as no more than ``most_waiting_bytes`` wait.

    Args:
        push: Makes the event loop call a function with an arrival.
    """

    def __init__(self, push: Callable[[Callable[[Arrival], None], Arrival], None], most_waiting_bytes: int) -> None:
        self._push, self._waiting = push, _Waiting(most_waiting_bytes)

    @property
    def dropped(self) -> int:
        """Samples that came and were not handed over, because others waited or newer ones came."""
        return self._waiting.dropped

    def __call__(self, sample: Sample) -> None:
        """Take a sample in; called from any thread. What waits of a short one is a copy, without its batch."""
        payload = sample.payload
        if self._waiting.admits(len(payload)):
            waits = Whole(payload.to_bytes()) if len(payload) < BATCH_BYTES else payload
            self._push(self._hand_over_one, (str(sample.key_expr), waits))

    def _hand_over_one(self, arrival: Arrival) -> None:
        key, payload = arrival
        self._waiting.ends(len(payload))
        self.hand_over(key, payload)

    @abstractmethod
    def hand_over(self, key: str, payload: Payload) -> None:
        """Pass a message to the listener."""


class EachSample(_InOrder):
    """Receives every sample of a subscriber, in order, as long as no more than ``MOST_WAITING_BYTES`` wait.

    Args:
        of: Key, or pattern of keys, that it is subscribed to.
        most_bytes: A longer message is not read.
    """

    def __init__(
        self,
        bus: InboxBus,
        of: str,
        reader: Reader[Message],
        listener: Listener,
        most_bytes: int = MAX_MESSAGE_BYTES,
    ) -> None:
        super().__init__(bus.push, MOST_WAITING_BYTES)
        self._bus, self.of, self._reader, self._listener, self._most = bus, of, reader, listener, most_bytes

    def hand_over(self, key: str, payload: Payload) -> None:
        """Read a message and call the listener."""
        try:
            envelope = self._reader.read(bytes_of(payload, self._most), self._most)
        except Refusal as unreadable:
            self.count_unreadable(key, unreadable)
            return
        self.deliver(envelope)

    def deliver(self, envelope: Envelope[Message]) -> None:
        """Call the listener."""
        self._bus.hear(self._listener, envelope)

    def count_unreadable(self, key: str, refusal: Refusal) -> None:
        """Count and log a publication that cannot be read."""
        self._bus.unreadable += 1
        log.warning("unreadable publication on %s: %s", key, refusal.detail)
        self._bus.on_unreadable(key, refusal)


class OverheardSamples(_InOrder):
    """Receives every sample of a subscription to whole conversations, and does not decode it."""

    def __init__(self, bus: InboxBus, listener: Overhearer, most_waiting_bytes: int) -> None:
        super().__init__(bus.gather, most_waiting_bytes)
        self._bus, self._listener = bus, listener
        self.declared: Subscription | None = None

    def hand_over(self, key: str, payload: Payload) -> None:
        """Call the listener with the bytes of a message."""
        self._bus.heard += 1
        self._bus.call("", self._listener, key, payload.to_bytes())

    def close(self) -> None:
        """Withdraw the subscription."""
        if self.declared is not None:
            self.declared.close()


class LatestSample(EachSample):
    """Receives only the newest undelivered sample of each key.

    Threads share a dictionary and a flag, in atomic steps. Their order makes this safe: another thread stores
    before it reads the flag, and the loop clears the flag before it takes samples out.
    """

    def __init__(
        self,
        bus: InboxBus,
        of: str,
        reader: Reader[Message],
        listener: Listener,
        most_bytes: int = MAX_MESSAGE_BYTES,
    ) -> None:
        super().__init__(bus, of, reader, listener, most_bytes)
        self._newest: dict[str, Sample] = {}
        self._pushed = False

    def __call__(self, sample: Sample) -> None:
        """Take a sample in; called from any thread."""
        name = str(sample.key_expr)
        self._waiting.dropped += name in self._newest
        self._newest[name] = sample
        if not self._pushed:
            self._pushed = True
            self._bus.push(self._hand_over_newest, None)

    def _hand_over_newest(self, _nothing: None) -> None:
        self._pushed = False
        taken = [self._newest.popitem()[1] for _ in range(len(self._newest))]
        for sample in reversed(taken):
            self.hand_over(str(sample.key_expr), sample.payload)


def bytes_of(payload: Payload | None, most_bytes: int = MAX_MESSAGE_BYTES) -> bytes:
    """Return the payload; a payload that is too long is not copied.

    Raises:
        OversizedMessage: The payload is too long for a message.
    """
    if payload is None:
        return b""
    refuse_oversized(len(payload), most_bytes)
    return payload.to_bytes()


@cache
def reader_of(accepts: Accepts) -> Reader[Message]:
    """Return the reader of these messages."""
    return Reader(accepts)


@cache
def reply_reader_of(reply: type[Message]) -> Reader[Message]:
    """Return the reader of this answer or a refusal."""
    return Reader(reply | Refused)
