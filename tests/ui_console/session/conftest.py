"""A placer that its test plays, for each test of a console."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from fake_resource_pool import FakePlacer

from backbone.bus.clock import VirtualClock, run_virtual

Scene = Callable[[FakePlacer], Awaitable[None]]


@pytest.fixture
def placer_world(local_mission: Any) -> Callable[[Scene], None]:
    def run(scene: Scene) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), {})
                try:
                    await scene(placer)
                finally:
                    await placer.close()

        run_virtual(main())

    return run
