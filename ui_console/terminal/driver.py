"""Reads the keys of a terminal; bytes that are no key do nothing.

Textual's driver ends the screen at a byte that is no UTF-8, or at a number that is too large.
"""

from __future__ import annotations

import os
import select
from codecs import getincrementaldecoder

from textual._xterm_parser import XTermParser
from textual.drivers.linux_driver import LinuxDriver

READ_MOST_BYTES = 4096  # as Textual's driver
TICK_S = 0.1  # as Textual's driver: an escape key is known by the pause after it


class TerminalDriver(LinuxDriver):
    """Driver of a terminal in which a person may type anything."""

    def run_input_thread(self) -> None:
        """Read keys until the screen ends."""
        decode = getincrementaldecoder("utf-8")("replace").decode
        parser = XTermParser()
        while not self.exit_event.is_set():
            is_readable = select.select([self.fileno], [], [], TICK_S)[0]
            for character in decode(os.read(self.fileno, READ_MOST_BYTES)) if is_readable else "":
                try:
                    for event in parser.feed(character):
                        self.process_message(event)
                except (ValueError, OverflowError):  # an escape sequence with an impossible number
                    parser = XTermParser()
            for event in parser.tick():
                self.process_message(event)
