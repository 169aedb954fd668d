"""Ask classes for their documentation and parameters, while a designer's event loop goes on."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence

from backbone.mission.class_asking import ask_classes
from backbone.mission.class_facts import ClassFacts


async def look_up(class_paths: Sequence[str]) -> dict[str, ClassFacts]:
    """Return the facts of each class, read in another process; ``failure`` has the reason why a class has none.

    Args:
        class_paths: ``package.module:Class`` each. Their modules are run.
    """
    return await asyncio.to_thread(ask_classes, class_paths)
