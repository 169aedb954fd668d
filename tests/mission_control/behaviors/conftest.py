"""Fixtures of behaviors at work."""

from __future__ import annotations

from typing import Any

import pytest
from fake_resource_pool import Run, with_placer
from trees_of_components import CLASSES


@pytest.fixture
def placer_world(local_mission: Any) -> Run:
    return with_placer(local_mission, CLASSES)
