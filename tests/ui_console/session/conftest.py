"""A placer that its test plays, for each test of a console."""

from __future__ import annotations

from typing import Any

import pytest
from fake_resource_pool import Run, with_placer


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    return with_placer(local_mission, {})
