"""Read-ahead: the next messages of a recording, decoded before they are due. Pure.

Decoding a chunk of the file takes milliseconds, and so does the first message of a class. A player does this in the
gaps between messages. When a message is due, it only has to be published.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import dataclass

from backbone.recording.reader import NoRecording, Recorded, Recording
from backbone.recording.revival import message_as_sent
from backbone.wire import Message

MOST_AHEAD_BYTES = 1 << 22  # chosen: forty pictures, or many seconds of readings; a busy machine seldom runs out
GAP_S = 0.01  # chosen: a chunk of readings is decoded within half of it (measured: 4 ms)
SPARE = 2.0  # chosen: the next chunk takes at most so many times as long as the longest recent one
FORGOTTEN = 0.98  # chosen: a machine that was busy for a moment counts as fast again after some dozens of messages


@dataclass(frozen=True, slots=True)
class Ready:
    """A message that can be published at once.

    Attributes:
        message: The message as recorded.
        said: The message as it was sent; None: see ``message_as_sent``.
        size: Size of its data in the file, bytes.
    """

    message: Recorded
    said: Message | None
    size: int


class ReadAhead:
    """The messages of a recording in their order, decoded ahead of time.

    Args:
        recording: Read while this is used.
        classes: Known message classes, by schema.
        since_s: First mission time.
        on_key: Called with the key of each message that was decoded.
    """

    def __init__(
        self,
        recording: Recording,
        classes: Mapping[str, type[Message]],
        since_s: float,
        on_key: Callable[[str], None] = lambda _key: None,
    ) -> None:
        self._records, self._classes, self._on_key = recording.records(since_s=since_s), classes, on_key
        self._ready: deque[Ready] = deque()
        self._bytes, self._is_over = 0, False
        self._damage: NoRecording | None = None
        self._longest_s = 0.0

    def has_time(self, gap_s: float) -> bool:
        """Return whether a gap of so many seconds of the machine suffices to decode one more message.

        The fewer messages are decoded, the shorter a gap suffices. So even a mission without long gaps is read ahead.
        """
        needed_s = max(GAP_S, SPARE * self._longest_s)
        return (
            not self._is_over and self._bytes < MOST_AHEAD_BYTES and gap_s > needed_s * self._bytes / MOST_AHEAD_BYTES
        )

    def took(self, seconds: float) -> None:
        """Record how long the last message took, in seconds of the machine; a slow machine needs longer gaps."""
        self._longest_s = max(seconds, FORGOTTEN * self._longest_s)

    def decode_one(self) -> None:
        """Decode one more message, if there is one."""
        try:
            found = next(self._records, None)
        except NoRecording as damage:  # the messages before it are still played
            found, self._damage = None, damage
        if found is None:
            self._is_over = True
            return
        _schema, _channel, record, message = found
        self._ready.append(Ready(message, message_as_sent(self._classes, message), len(record.data)))
        self._bytes += len(record.data)
        self._on_key(message.key)

    def fill(self) -> None:
        """Decode messages until the limit is reached."""
        while self.has_time(math.inf):
            self.decode_one()

    def first(self) -> Ready | None:
        """Return the next message; None: there is none.

        Raises:
            NoRecording: The recording is damaged from here on.
        """
        if not self._ready and not self._is_over:
            self.decode_one()
        if not self._ready and self._damage is not None:
            raise self._damage
        return self._ready[0] if self._ready else None

    def pop(self) -> None:
        """Go on to the message after the next one."""
        self._bytes -= self._ready.popleft().size
