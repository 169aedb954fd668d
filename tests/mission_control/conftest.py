"""What tests of behaviors share."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import pytest
from behaviors_of_a_placer import CLASSES
from fake_resource_pool import FakePlacer, Run, with_placer
from mortal_behaviors import MORTALS, Jumper, Walker


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    return with_placer(local_mission, CLASSES)


@pytest.fixture
def kept_world(local_mission: Any, tmp_path: Path) -> Run:
    """Run a scene with a placer whose components have a folder of the mission."""
    Walker.recalled, Jumper.recalled = [], []
    run = with_placer(local_mission, MORTALS)

    def with_folder(scene: Callable[[FakePlacer], Awaitable[None]]) -> None:
        async def scene_in_folder(placer: FakePlacer) -> None:
            placer.run_directory = str(tmp_path)
            await scene(placer)

        run(scene_in_folder)

    return with_folder
