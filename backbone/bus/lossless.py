"""Lossless delivery: the decisions of a sender and of a listener that must get every message. Pure.

A sender numbers the messages of each stream, keeps them until the listener acknowledges them, and has few of them under
way at a time. A full queue may drop the messages, as it drops all repeated ones, because the sender sends them again. A
sender never waits for a listener that hangs: the sender keeps the unacknowledged messages, up to a number of bytes.
"""

from __future__ import annotations

import math
from collections import OrderedDict, deque
from collections.abc import Iterator
from typing import NamedTuple

MOST_UNDER_WAY_BYTES = 256 * 1024  # chosen: three pictures of 320 x 240; they fit the queues of a link
MOST_KEPT_BYTES = 128 * 1024 * 1024  # chosen: 1700 of these pictures, which are two minutes of a camera
AGAIN_S, AGAIN_MOST_S = 0.25, 2.0  # chosen: a living listener answers sooner; the longest pause is a link's lease
STILL_COME_S = 2.0  # chosen: the lease of a link; a restarted hub is back sooner
BACK_S = 0.02  # chosen: longer than a round trip, so that one gap is repaired once
MOST_LOST = 2**40  # chosen: more than any sender sends; a larger number is ignored
MOST_STREAMS_HEARD = 1024  # chosen: for one listener; a stream has one sender, but any process may invent streams


class Parcel(NamedTuple):
    """One message under way.

    Attributes:
        number: Number of the message in its stream, from 1.
        lost: Messages of the stream that were not sent at all, because too many bytes waited.
        key: Key of the message.
        raw: Bytes of the message.
    """

    number: int
    lost: int
    key: str
    raw: bytes


class LosslessSending:
    """The unacknowledged messages of one sender to one listener.

    Args:
        most_bytes: A message with which more bytes would wait is lost and counted, unless it waits alone.
    """

    def __init__(self, most_bytes: int = MOST_KEPT_BYTES) -> None:
        self._most_bytes = most_bytes
        self._kept: deque[tuple[str, bytes]] = deque()
        self._kept_bytes = self._under_way_bytes = self._under_way = 0
        self._acknowledged = self.lost = 0
        self._pause_s, self._back_s = AGAIN_S, -math.inf
        self.again_s = math.inf
        """Time at which to call ``due`` again, if nothing is added or acknowledged before."""

    @property
    def waiting(self) -> int:
        """Messages that are not acknowledged."""
        return len(self._kept)

    def add(self, key: str, raw: bytes) -> bool:
        """Keep a message to send; return False if it is lost, because too many bytes wait."""
        if self._kept and self._kept_bytes + len(raw) > self._most_bytes:
            self.lost += 1
            return False
        self._kept.append((key, raw))
        self._kept_bytes += len(raw)
        return True

    def acknowledge(self, number: int, now_s: float) -> None:
        """Drop the messages up to this number, which the listener has; the same number again means a gap after it."""
        news = number - self._acknowledged
        if not 0 <= news <= self._under_way:
            return
        if news == 0:
            if self._under_way and now_s >= self._back_s:
                self._go_back(now_s)
            return
        for _ in range(news):
            length = len(self._kept.popleft()[1])
            self._kept_bytes -= length
            self._under_way_bytes -= length
        self._acknowledged, self._under_way = number, self._under_way - news
        self._pause_s = AGAIN_S
        self.again_s = now_s + AGAIN_S if self._under_way else math.inf

    def due(self, now_s: float) -> Iterator[Parcel]:
        """Yield the messages to send now."""
        if now_s >= self.again_s:
            self._go_back(now_s)
            self._pause_s = min(2 * self._pause_s, AGAIN_MOST_S)
        while self._under_way < len(self._kept):
            key, raw = self._kept[self._under_way]
            if self._under_way and self._under_way_bytes + len(raw) > MOST_UNDER_WAY_BYTES:
                break
            self._under_way += 1
            self._under_way_bytes += len(raw)
            yield Parcel(self._acknowledged + self._under_way, self.lost, key, raw)
        if self._under_way and self.again_s == math.inf:
            self.again_s = now_s + self._pause_s

    def _go_back(self, now_s: float) -> None:
        """Send all unacknowledged messages again."""
        self._under_way = self._under_way_bytes = 0
        self.again_s, self._back_s = math.inf, now_s + BACK_S


class LosslessHearing:
    """The streams to one listener, which gets each message once, in the order of its stream."""

    def __init__(self) -> None:
        self._streams: OrderedDict[bytes, tuple[int, int]] = OrderedDict()  # stream → newest number, lost
        self._former_lost = 0

    @property
    def lost(self) -> int:
        """Messages that senders had no room for."""
        return self._former_lost + sum(lost for _number, lost in self._streams.values())

    def take(self, stream: bytes, number: int, lost: int) -> tuple[bool, int]:
        """Return whether to deliver this message, and which number to acknowledge."""
        newest, known_lost = self._streams.pop(stream, (0, 0))
        is_next = number == newest + 1
        newest += is_next
        self._streams[stream] = newest, max(known_lost, lost) if lost <= MOST_LOST else known_lost
        if len(self._streams) > MOST_STREAMS_HEARD:
            self._former_lost += self._streams.popitem(last=False)[1][1]
        return is_next, newest
