"""What is said in a mission is watched and counted by commands."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from running_mission import MISSION_XML, RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

MIXED = MISSION_XML.parent / "docs" / "examples" / "mixed.xml"


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up(mission_xml=MIXED) as running:
        yield running


def printed(mission: RunningMission, *words: str) -> list[dict[str, Any]]:
    """Return what a command prints as JSON lines."""
    done = mission.command("scout-backbone", *words, "--json", "--mission", mission.name)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.thorough
def test_what_is_said_is_watched_live_with_questions_and_single_fields(mission: RunningMission) -> None:
    poses = printed(mission, "watch", "*/localizer/poses", "--most", "5", "--for", "20")
    assert len(poses) == 5
    assert {one["schema"].partition("/")[0] for one in poses} == {"Pose"}
    places = printed(mission, "watch", "*/localizer/poses", "--field", "x_m", "--most", "3", "--for", "20")
    assert all(isinstance(one["value"], float) for one in places)
    asked = printed(mission, "watch", "*/scout1/ask", "--for", "3")
    assert {"Move/1", "Applied/1"} <= {one["schema"] for one in asked}
    done = mission.command("scout-backbone", "watch", "*/nobody/*", "--for", "1", "--mission", mission.name)
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.thorough
def test_the_busiest_keys_are_told_with_rates_and_sizes(mission: RunningMission) -> None:
    rows = printed(mission, "top", "--for", "3")
    sizes = [one["bytes_per_s"] for one in rows]
    assert sizes == sorted(sizes, reverse=True)
    [world] = [one for one in rows if one["key"].endswith("/world/bodies")]
    assert 15 < world["messages_per_s"] < 40
    assert world["bytes_per_s"] == pytest.approx(world["messages_per_s"] * world["mean_bytes"])
    lines = mission.command(
        "scout-backbone", "watch", "*/world/bodies", "--rate", "--for", "2.5", "--mission", mission.name
    )
    assert lines.stdout.count("world/bodies") >= 2, lines.stdout
