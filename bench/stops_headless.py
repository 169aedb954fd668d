"""A console without a screen, driven by a gamepad, for the table of stops."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, suppress
from pathlib import Path

from stops_link import Relay
from stops_pad import Pad
from stops_places import Gesture, Place
from stops_terminal import TriedConsole
from stops_world import until

LINES = 3


class Headless(TriedConsole):
    """A console whose output is lines of text."""

    def __init__(self, name: str, relay: Relay, folder: Path) -> None:
        super().__init__(name, relay)
        self._pad, self._heard = Pad(folder), list[str]()
        self._process: asyncio.subprocess.Process | None = None

    @asynccontextmanager
    async def present(self, environment: dict[str, str], mission: str) -> AsyncIterator[Headless]:
        """Run the console until the block ends."""
        words = [*self._pad.program(), *self.kind.words, "--user", "hana", "--mission", mission]
        pipe = asyncio.subprocess.PIPE
        self._process = await asyncio.create_subprocess_exec(*words, env={**os.environ, **environment}, stdout=pipe)
        reading = asyncio.create_task(self._read(self._process), name="the console's lines")
        try:
            await until(lambda: any("you hold" in line for line in self._heard), "the console holds its robot")
            yield self
        finally:
            await self.let_go()
            with suppress(ProcessLookupError):
                self._process.kill()
            await self._process.wait()
            await reading

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

    async def freeze(self) -> None:
        """See ``TriedConsole``."""
        self._signal(signal.SIGSTOP)

    async def thaw(self) -> None:
        """See ``TriedConsole``."""
        self._signal(signal.SIGCONT)

    async def _hold(self) -> None:
        self._pad.turn()
        await asyncio.Event().wait()

    async def _release(self) -> None:
        self._pad.let_go()

    def _signal(self, number: signal.Signals) -> None:
        assert self._process is not None
        self._process.send_signal(number)

    async def _read(self, process: asyncio.subprocess.Process) -> None:
        assert process.stdout is not None
        async for line in process.stdout:
            self._heard.append(line.decode().rstrip())
