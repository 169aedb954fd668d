"""What tests of behaviors share."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager
from typing import Any

import pytest
from behaviors_of_a_placer import CLASSES, Run
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    """Run a scene with a placer on a fresh network."""

    @asynccontextmanager
    async def placer() -> AsyncIterator[FakePlacer]:
        async with local_mission("iros2001") as network:
            made = FakePlacer(network, VirtualClock(), CLASSES)
            try:
                yield made
            finally:
                await made.close()

    def run(scene: Callable[[FakePlacer], Awaitable[None]]) -> None:
        async def main() -> None:
            async with placer() as made:
                await scene(made)

        run_virtual(main())

    return run
