"""Reads the keys of a terminal, and writes the screen; bytes that are no key do nothing.

Textual's driver ends the screen at a byte that is no UTF-8.
"""

from __future__ import annotations

import atexit
import os
import selectors
import signal
import time
from codecs import getincrementaldecoder
from collections.abc import Iterable
from contextlib import suppress

from textual.app import App
from textual.drivers.linux_driver import LinuxDriver
from textual.message import Message

from backbone.command_line.terminal_output import TerminalOutput
from ui_console.terminal.key_gate import KeyGate
from ui_console.terminal.key_stream import KeyStream

STANDARD_OUTPUT = 1  # POSIX: STDOUT_FILENO
READ_MOST_BYTES = 4096  # as Textual's driver
TICK_S = 0.1  # as Textual's driver: an escape key is known by the pause after it
ENDS_WITHIN_S = (0.2, 1.0)  # chosen: while the event loop waits, and at the end of the process
ASK_POSITION = "\x1b[6n"  # ECMA-48, 8.3.35: device status report; terminals of any age answer


class KeysDropped(Message):
    """Keys or presses of the mouse had no effect, because they came too late, or too many at once."""


class TerminalDriver(LinuxDriver):
    """Driver of a terminal in which a person may type anything.

    Law: what the ``KeyGate`` does not admit has no effect. The screen gets a ``KeysDropped`` then.
    """

    _is_drawing = False

    def __init__(
        self, app: App[object], *, debug: bool = False, mouse: bool = True, size: tuple[int, int] | None = None
    ) -> None:
        super().__init__(app, debug=debug, mouse=mouse, size=size)
        # The system may give SIGCONT to any thread; with a handler of the loop, it ends the loop's wait.
        self._loop.add_signal_handler(signal.SIGCONT, lambda: None)
        signal.signal(signal.SIGCONT, self._sigcont_application)
        self._gate = KeyGate()
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
        is_resumed = self._must_signal_resume
        self._output.drops = False
        super().start_application_mode()  # type: ignore[no-untyped-call]  # Textual declares no types here
        self._output.drops = self._is_drawing = True
        if is_resumed:
            self._draw_anew()  # the terminal's second screen is empty now

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
        self._gate.begin(time.monotonic())
        decode = getincrementaldecoder("utf-8")("replace").decode
        stream, typed_s = KeyStream(), time.monotonic()
        with selectors.SelectSelector() as keyboard:
            keyboard.register(self.fileno, selectors.EVENT_READ)
            is_over = False
            while not is_over:  # a last time after the end, because what is left unread is flushed
                is_over = self.exit_event.is_set()
                typed = b""
                is_typed = keyboard.select(TICK_S) or keyboard.select(0)  # a signal may end the first one
                if is_typed and not (typed := os.read(self.fileno, READ_MOST_BYTES)):
                    return  # the terminal was closed
                now_s = time.monotonic()
                if typed:
                    typed_s = now_s
                    self._pass_on(stream.typed(decode(typed)), now_s)
                else:
                    self._pass_on(stream.pause() if now_s >= typed_s + TICK_S else (), now_s)

    def _draw_anew(self) -> None:
        with suppress(RuntimeError):  # the event loop has ended
            self._loop.call_soon_threadsafe(self._app.refresh)

    def _pass_on(self, read: Iterable[Message], now_s: float) -> None:
        for event in self._gate.admitted(read, now_s):
            self.process_message(event)
        if self._gate.has_dropped:
            self.process_message(KeysDropped())
