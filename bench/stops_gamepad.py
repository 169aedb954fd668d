"""A console with a gamepad whose input another program supplies: ``stops_gamepad.py FIFO WORD …``.

The lines of the FIFO are events as the device would send them: type, code and value. All else is ``scout-console``.
"""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator, Mapping
from pathlib import Path
from typing import NamedTuple

from ui_console import cli
from ui_console.session import gamepad

RANGES = {gamepad.ABS_X: (-100, 100), gamepad.ABS_Y: (-100, 100)}


class PlayedEvent(NamedTuple):
    """An event of the device."""

    type: int
    code: int
    value: int


class PlayedGamepad:
    """A device whose events come from a FIFO.

    Args:
        path: Path of the FIFO.
    """

    def __init__(self, path: Path) -> None:
        self._path = path

    async def async_read_loop(self) -> AsyncIterator[PlayedEvent]:
        """Yield the events from the FIFO."""
        reader = asyncio.StreamReader()
        # opened for reading and writing, so that the file does not end while no program writes
        pipe = self._path.open("r+b", buffering=0)
        loop = asyncio.get_running_loop()
        await loop.connect_read_pipe(lambda: asyncio.StreamReaderProtocol(reader), pipe)
        while line := await reader.readline():
            yield PlayedEvent(*map(int, line.split()))


def main() -> None:
    """Run the console with the device of the first word."""
    played = PlayedGamepad(Path(sys.argv.pop(1)))

    def find_played() -> tuple[gamepad.Gamepad, Mapping[int, tuple[int, int]]]:
        return played, RANGES

    gamepad.find_gamepad = find_played  # type: ignore[assignment]
    cli.main()


if __name__ == "__main__":
    main()
