"""Decides which keys have an effect: those that a hand types and a console reads at once.

Rules of this file: no terminal; the time is an argument.
"""

from __future__ import annotations

import math

from textual.binding import Binding
from textual.events import Key, MouseDown, Paste
from textual.message import Message

from ui_console.terminal.keys import KEYS, action_of

UNREAD_S = 0.5  # chosen: as long as the first press of a drive key counts
MOST_AT_ONCE = 64  # chosen: a key held for two seconds, on a link that stood still meanwhile
KEYS_PER_S = 64.0  # chosen: twice as fast as keyboards repeat; a screen answers a key in milliseconds
STOPPING = {one.key for one in Binding.make_bindings(KEYS) if action_of(one) in {"stop_robot", "stop_all"}}


class KeyGate:
    """Admits keys, pasted text and presses of the mouse, one read after the other.

    Law: a key of the emergency stop is always admitted, once a read. Others are not if the process did not read for
    ``UNREAD_S``, because it was stopped, nor if they are faster than ``KEYS_PER_S``: a screen that answers thousands of
    pasted keys would answer the stop after them much later.

    Attributes:
        has_dropped: Whether keys, text or presses of this read have no effect.
    """

    def __init__(self) -> None:
        self.has_dropped = False
        self._read_s = math.inf
        self._is_late = False
        self._free = float(MOST_AT_ONCE)
        self._stopped_by: set[str] = set()

    def begin(self, now_s: float) -> None:
        """Begin to read; a time of waiting for input before does not count."""
        self._read_s = min(self._read_s, now_s)  # after a stop, the last time before it

    def read(self, now_s: float) -> None:
        """Note that the process has read, also if nothing was typed."""
        since_s = now_s - self._read_s
        self._read_s, self._is_late = now_s, since_s > UNREAD_S
        self._free = min(float(MOST_AT_ONCE), self._free + max(0.0, since_s) * KEYS_PER_S)
        self._stopped_by.clear()
        self.has_dropped = False

    def admits(self, event: Message) -> bool:
        """Return whether an event of this read has an effect; anything but keys, text and presses of the mouse has."""
        if isinstance(event, Key) and event.key in STOPPING:
            is_first = event.key not in self._stopped_by
            self._stopped_by.add(event.key)
            return is_first
        if not isinstance(event, Key | MouseDown | Paste):
            return True
        if self._is_late or self._free < 1.0:
            self.has_dropped = True
            return False
        self._free -= isinstance(event, Key)
        return True
