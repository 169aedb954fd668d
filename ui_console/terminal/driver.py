"""Reads the keys of a terminal, and writes the screen; bytes that are no key do nothing.

Textual's driver ends the screen at a byte that is no UTF-8, or at a number that is too large, and takes the characters
of an unknown escape sequence for keys: shift and the 8 of some keypads would stop a robot and take another one.
"""

from __future__ import annotations

import atexit
import math
import os
import re
import selectors
import time
from codecs import getincrementaldecoder
from collections.abc import Iterable
from contextlib import suppress

from textual._xterm_parser import XTermParser
from textual.app import App
from textual.binding import Binding
from textual.drivers.linux_driver import LinuxDriver
from textual.events import Key, MouseDown, Paste
from textual.message import Message

from backbone.command_line.terminal_output import TerminalOutput
from ui_console.terminal.keys import KEYS, action_of

STANDARD_OUTPUT = 1  # POSIX: STDOUT_FILENO
READ_MOST_BYTES = 4096  # as Textual's driver
TICK_S = 0.1  # as Textual's driver: an escape key is known by the pause after it
UNREAD_S = 0.5  # chosen: as long as the first press of a drive key counts
STOPPING = {one.key for one in Binding.make_bindings(KEYS) if action_of(one) in {"stop_robot", "stop_all"}}
ENDS_WITHIN_S = (0.2, 1.0)  # chosen: while the event loop waits, and at the end of the process
ESCAPE = "\x1b"
ASK_POSITION = "\x1b[6n"  # ECMA-48, 8.3.35: device status report; terminals of any age answer
SEQUENCE = re.compile(r"\x1b[\[O][ -?]*[@-~]?")  # ECMA-48, 5.4: CSI and SS3, whole or its beginning


class KnownKeys(XTermParser):
    """Parser that drops the rest of an unknown escape sequence."""

    _so_far = ""

    def _sequence_to_key_events(self, sequence: str, alt: bool | None = None) -> Iterable[Key]:
        """Return the keys of a sequence.

        Args:
            sequence: A whole sequence, or one character of an unknown one.
            alt: Whether the character is the first one after escape; None: a whole sequence.
        """
        before = ESCAPE if alt else self._so_far
        self._so_far = "" if alt is None else ESCAPE if sequence == ESCAPE else before + sequence
        if alt is False and SEQUENCE.fullmatch(self._so_far):
            return ()
        return super()._sequence_to_key_events(sequence, alt=bool(alt))


class KeysDropped(Message):
    """Keys or presses of the mouse had no effect, because they came while the process did not read."""


class TerminalDriver(LinuxDriver):
    """Driver of a terminal in which a person may type anything.

    Law: presses of keys and mouse have no effect if the process did not read for ``UNREAD_S``, because it was stopped;
    only the keys of the emergency stop have. The screen gets a ``KeysDropped`` then.
    """

    _is_drawing = False
    _read_s = math.inf

    def __init__(
        self, app: App[object], *, debug: bool = False, mouse: bool = True, size: tuple[int, int] | None = None
    ) -> None:
        super().__init__(app, debug=debug, mouse=mouse, size=size)
        self._output = TerminalOutput(STANDARD_OUTPUT, self._draw_anew)
        atexit.register(self._output.wait_written, ENDS_WITHIN_S[1])

    def write(self, data: str) -> None:
        """Write, without waiting for a terminal that does not read."""
        self._output.write(data)

    def start_application_mode(self) -> None:
        """Begin to draw and to read keys.

        After SIGSTOP and SIGCONT, end first what no handler has ended: of two threads that read keys, one would wait
        for a key for ever, and the end of the screen for that thread.
        """
        if self._is_drawing:
            self._must_signal_resume = True
            self.suspend_application_mode()
        self._output.drops = False
        super().start_application_mode()  # type: ignore[no-untyped-call]  # Textual declares no types here
        self._output.drops = self._is_drawing = True

    def stop_application_mode(self) -> None:
        """Stop drawing and reading, and restore the terminal."""
        self._output.drops = self._is_drawing = False
        super().stop_application_mode()

    def close(self) -> None:
        """End; a terminal that does not take the rest soon gets it while the robot is given back."""
        super().close()
        self._output.wait_written(ENDS_WITHIN_S[0])

    def ask_position(self) -> None:
        """Ask the terminal for the position of its cursor, unless a multiplexer would answer in its place."""
        if not (os.environ.get("TMUX") or os.environ.get("STY")):
            self.write(ASK_POSITION)

    def run_input_thread(self) -> None:
        """Read keys until the screen ends."""
        self._read_s = min(self._read_s, time.monotonic())  # after a stop, the last time before it
        decode = getincrementaldecoder("utf-8")("replace").decode
        parser = KnownKeys()
        with selectors.SelectSelector() as keyboard:
            keyboard.register(self.fileno, selectors.EVENT_READ)
            is_over = False
            while not is_over:  # a last time after the end, because what is left unread is flushed
                is_over = self.exit_event.is_set()
                typed = b""
                is_typed = keyboard.select(TICK_S) or keyboard.select(0)  # a signal may end the first one
                if is_typed and not (typed := os.read(self.fileno, READ_MOST_BYTES)):
                    return  # the terminal was closed
                before_s, self._read_s = self._read_s, time.monotonic()
                is_late = self._read_s > before_s + UNREAD_S
                dropped = 0
                for character in decode(typed):
                    try:
                        for event in parser.feed(character):
                            dropped += not self._passed_on(event, is_late=is_late)
                    except (ValueError, OverflowError):  # an escape sequence with an impossible number
                        parser = KnownKeys()
                for event in parser.tick():
                    dropped += not self._passed_on(event, is_late=is_late)
                if dropped:
                    self.process_message(KeysDropped())

    def _draw_anew(self) -> None:
        with suppress(RuntimeError):  # the event loop has ended
            self._loop.call_soon_threadsafe(self._app.refresh)

    def _passed_on(self, event: Message, *, is_late: bool) -> bool:
        is_stop = isinstance(event, Key) and event.key in STOPPING
        if is_late and not is_stop and isinstance(event, Key | MouseDown | Paste):
            return False
        self.process_message(event)
        return True
