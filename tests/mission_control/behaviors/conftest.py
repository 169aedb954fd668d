"""Fixtures of behaviors at work."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from fake_resource_pool import FakePlacer
from trees_of_components import CLASSES, Run

from backbone.bus.clock import VirtualClock, run_virtual


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    def run(scene: Callable[[FakePlacer], Awaitable[None]]) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), CLASSES)
                try:
                    await scene(placer)
                finally:
                    await placer.close()

        run_virtual(main())

    return run
