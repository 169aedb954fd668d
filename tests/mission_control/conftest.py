"""What tests of behaviors share."""

from __future__ import annotations

from typing import Any

import pytest
from behaviors_of_a_placer import CLASSES
from fake_resource_pool import Run, with_placer


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    return with_placer(local_mission, CLASSES)
