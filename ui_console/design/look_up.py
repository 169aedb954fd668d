"""Reads the documentation and parameters of classes without blocking the designer's event loop."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from backbone.mission.class_asking import ask_classes
from backbone.mission.class_facts import ClassFacts


async def look_up(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
    """Return the facts of each class, read in another process; if a class has no facts, ``failure`` has the reason.

    Args:
        class_paths: Class paths ``package.module:Class``. Their modules are executed.
    """
    return await asyncio.to_thread(ask_classes, class_paths)
