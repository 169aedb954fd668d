"""Simulated hands at a gamepad that a console reads through ``stops_gamepad.py``."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from stops_places import Gesture

from ui_console.session.gamepad import ABS_X, BTN_EAST, BTN_NORTH, BTN_START, BTN_TR, EV_ABS, EV_KEY

PROGRAM = Path(__file__).with_name("stops_gamepad.py")
STOPS = {Gesture.PAD_ONE: BTN_EAST, Gesture.PAD_ALL: BTN_NORTH}


class Pad:
    """A gamepad.

    Args:
        folder: Folder for the FIFO of its events.
    """

    def __init__(self, folder: Path) -> None:
        self._fifo = folder / "gamepad"

    def program(self) -> list[str]:
        """Plug it in; return the command line of a console with it."""
        os.mkfifo(self._fifo)
        return [sys.executable, str(PROGRAM), str(self._fifo)]

    def turn(self) -> None:
        """Hold the dead-man button, and the stick to the right."""
        self._feel(f"{EV_ABS} {ABS_X} 100", f"{EV_KEY} {BTN_TR} 1")

    def let_go(self) -> None:
        """Release the dead-man button."""
        self._feel(f"{EV_KEY} {BTN_TR} 0")

    def take(self) -> None:
        """Press start."""
        self._press(BTN_START)

    def stop(self, gesture: Gesture) -> None:
        """Press the button of a stop."""
        self._press(STOPS[gesture])

    def _press(self, button: int) -> None:
        self._feel(f"{EV_KEY} {button} 1", f"{EV_KEY} {button} 0")

    def _feel(self, *events: str) -> None:
        with self._fifo.open("r+b", buffering=0) as fifo:
            fifo.write("".join(f"{event}\n" for event in events).encode())
