"""Decides which keys have an effect: those that a hand types and a console reads at once.

Rules of this file: no terminal; the time is an argument.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from textual.binding import Binding
from textual.events import Key, MouseDown, MouseEvent, MouseMove, MouseUp, Paste
from textual.message import Message

from ui_console.terminal.keys import KEYS, action_of

UNREAD_S = 0.5  # chosen: as long as the first press of a drive key counts
MOST_AT_ONCE = 64  # chosen: a key held for two seconds, on a link that stood still meanwhile
KEYS_PER_S = 64.0  # chosen: twice as fast as keyboards repeat; a screen answers a key in milliseconds
MOVES_PER_S = 32.0  # chosen: no hand aims faster; a screen that answers a thousand moves a second answers no key
STOPPING = {one.key for one in Binding.make_bindings(KEYS) if action_of(one) in {"stop_robot", "stop_all"}}


class KeyGate:
    """Admits keys, pasted text and the mouse, one read after the other.

    Law: a key of the emergency stop is always admitted, once a read. Others are not if the process did not read for
    ``UNREAD_S``, because it was stopped, nor if they are faster than ``KEYS_PER_S``: a screen that answers thousands of
    pasted keys would answer the stop after them much later. Of the mouse's moves, the newest is admitted, at the latest
    at the next read.

    Attributes:
        has_dropped: Whether keys, text or presses of this read have no effect.
    """

    def __init__(self) -> None:
        self.has_dropped = False
        self._read_s = math.inf
        self._is_late = False
        self._free = float(MOST_AT_ONCE)
        self._stopped_by: set[str] = set()
        self._move: MouseMove | None = None
        self._moved_s = -math.inf

    def begin(self, now_s: float) -> None:
        """Begin to read; a time of waiting for input before does not count."""
        self._read_s = min(self._read_s, now_s)  # after a stop, the last time before it

    def admitted(self, read: Iterable[Message], now_s: float) -> list[Message]:
        """Return what has an effect of one read, which may be empty."""
        since_s = now_s - self._read_s
        self._read_s, self._is_late = now_s, since_s > UNREAD_S
        self._free = min(float(MOST_AT_ONCE), self._free + max(0.0, since_s) * KEYS_PER_S)
        self._stopped_by.clear()
        self.has_dropped = False
        admitted = [event for event in read if self._admits(event)]
        if self._move is not None and now_s >= self._moved_s + 1 / MOVES_PER_S:
            admitted.append(self._move)
            self._move, self._moved_s = None, now_s
        return admitted

    def _admits(self, event: Message) -> bool:
        if isinstance(event, MouseEvent):
            self._move = event if isinstance(event, MouseMove) else None  # others have the newest place
        if isinstance(event, MouseMove):
            return False
        if isinstance(event, Key) and event.key in STOPPING:
            is_first = event.key not in self._stopped_by
            self._stopped_by.add(event.key)
            return is_first
        if isinstance(event, MouseUp) or not isinstance(event, Key | MouseEvent | Paste):
            return True
        is_press = isinstance(event, Key | MouseDown | Paste)
        if self._is_late or self._free < (1.0 if is_press else MOST_AT_ONCE / 2):  # a wheel leaves half of it to keys
            self.has_dropped |= is_press
            return False
        self._free -= 1.0
        return True
