"""What the drivers of ``exchanged_drivers`` have done; their file is read anew, this one is not."""

from __future__ import annotations

from typing import ClassVar


class Bench:
    """What the drivers of a device have done."""

    opened: ClassVar[list[str]] = []
    shone: ClassVar[list[tuple[str, float]]] = []
    most_open: ClassVar[int] = 0
    fault: ClassVar[str] = ""
    tuned: ClassVar[dict[str, str]] = {}
    """Open camera → its frequency."""

    @classmethod
    def clear(cls) -> None:
        cls.opened.clear()
        cls.shone.clear()
        cls.tuned.clear()
        cls.most_open, cls.fault = 0, ""
