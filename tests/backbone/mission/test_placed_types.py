"""Which types a mission places, and how often."""

from __future__ import annotations

from collections import Counter
from pathlib import Path

import msgspec
import pytest

from backbone.creator.preload import preloaded_modules
from backbone.mission.reader import read_mission


def test_all_nodes_of_the_tree_are_counted_and_shipped_types_are_preloaded() -> None:
    mission = read_mission(Path(__file__).parents[3] / "mission.xml")
    counts = Counter(mission.placed_types())
    assert (counts["surveillance"], counts["watch_for_motion"]) == (1, 2)
    found = preloaded_modules(mission.types, mission.placed_types())
    assert {
        "mission_control.behaviors.watch_for_motion",
        "mission_control.behaviors.surveillance",
        "resource_pool.rcs.scout",
        "resource_pool.simulated_world",
    } <= set(found)
    assert "mission_control.behaviors.jump" not in found


@pytest.mark.parametrize("name", ["watch_for_motion", "drive"])
def test_code_of_ones_own_is_read_anew_at_each_start(name: str) -> None:
    mission = read_mission(Path(__file__).parents[3] / "mission.xml")
    [shipped] = [one for one in mission.types if one.name == name]
    own = msgspec.structs.replace(shipped, class_path="lab:Own")
    assert preloaded_modules([own], [name] * 2) == []
