"""An observer of a mission's launcher for tests."""

from __future__ import annotations

import asyncio
from collections.abc import Callable


class UpWatcher:
    """Learns when the mission is up, and shows nothing."""

    def __init__(self) -> None:
        self.is_up = asyncio.Event()

    async def up(self, *_given: object) -> None:
        self.is_up.set()
        await asyncio.Event().wait()

    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_arguments: None
