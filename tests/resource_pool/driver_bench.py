"""What the drivers of ``exchanged_drivers`` have done; their file is read anew, this one is not."""

from __future__ import annotations

import asyncio
from typing import ClassVar


class Bench:
    """What the drivers of a device have done."""

    opened: ClassVar[list[str]] = []
    shone: ClassVar[list[tuple[str, float]]] = []
    most_open: ClassVar[int] = 0
    fault: ClassVar[str] = ""
    end_deaf: ClassVar[asyncio.Event] = asyncio.Event()
    tuned: ClassVar[dict[str, str]] = {}
    """Open camera → its frequency."""

    @classmethod
    def clear(cls) -> None:
        cls.opened.clear()
        cls.shone.clear()
        cls.tuned.clear()
        cls.most_open, cls.fault, cls.end_deaf = 0, "", asyncio.Event()
