"""A console without a screen, driven by a gamepad, for the table of stops."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from stops_link import Relay
from stops_pad import Pad
from stops_places import Gesture, Place
from stops_terminal import OfLines
from stops_world import until

LINES = 3


class Headless(OfLines):
    """A console that a gamepad drives."""

    def __init__(self, name: str, relay: Relay, folder: Path) -> None:
        super().__init__(name, relay)
        self._pad = Pad(folder)

    @asynccontextmanager
    async def present(self, environment: dict[str, str], mission: str) -> AsyncIterator[Headless]:
        """Run the console until the block ends."""
        await self._begin([*self._pad.program(), *self.kind.words, "--user", "hana", "--mission", mission], environment)
        try:
            await until(lambda: any("you hold" in line for line in self._heard), "the console holds its robot")
            yield self
        finally:
            await self.let_go()
            await self._end()

    async def take(self) -> None:
        """See ``TriedConsole``."""
        self._pad.take()

    async def go(self, place: Place) -> None:
        """See ``TriedConsole``."""

    async def leave(self, place: Place) -> None:
        """See ``TriedConsole``."""

    async def give(self, gesture: Gesture) -> float:
        """See ``TriedConsole``."""
        at_s = time.monotonic()
        self._pad.stop(gesture)
        return at_s

    async def says(self) -> str:
        """See ``TriedConsole``."""
        return " / ".join(self._heard[-LINES:])

    async def _hold(self) -> None:
        self._pad.turn()
        await asyncio.Event().wait()

    async def _release(self) -> None:
        self._pad.let_go()
