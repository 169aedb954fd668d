"""Robots and devices of five kinds in one mission on real processes: commanded by behaviors, and by people."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from running_mission import RunningMission, mission_up, status_when_settled

from resource_pool.localization import AskPose, Pose

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

TEAM = Path(__file__).parents[2] / "docs" / "examples" / "team.xml"
MOVED_M = 0.05
RELEASE = {"at_s": 2.0, "release": True}
COURSES: dict[str, list[dict[str, Any]]] = {
    "rover1": [
        {"at_s": 0, "forward_m_s": 0.3, "turn_rad_s": 0.2},
        {"at_s": 1, "give": "grip", "values": {"closed": 1, "lift": 0.5}},
    ],
    "walker1": [{"at_s": 0, "forward_m_s": 0.15, "turn_rad_s": 0}],
    "scout1": [{"at_s": 0, "forward_m_s": 0.2, "turn_rad_s": 0}],
    "wall-camera": [{"at_s": 0, "give": "look", "values": {"pan_rad": 0.3}}],
}


def taken_over(mission: RunningMission, robot: str, course: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Take it over by a script; return what the script prints."""
    lines = "".join(json.dumps(line) + "\n" for line in [*course, RELEASE])
    words = ("scout-console", "attach", robot, "--mission", mission.name, "--script", "-", "--within", "20")
    done = mission.command(*words, stdin=lines)
    assert done.returncode == 0, done.stdout + done.stderr + mission.story()
    return [json.loads(line) for line in done.stdout.splitlines()]


async def place_of(mission: RunningMission, robot: str) -> tuple[float, float]:
    async with mission.bus() as bus:
        pose = await bus.ask("resource_pool/world", AskPose(robot), Pose, within_s=5.0)
        return pose.x_m, pose.y_m


@pytest.mark.thorough
async def test_all_of_a_mixed_team_is_driven_by_hand_and_goes_on_and_the_schedule_is_right(
    tmp_path: Path, judged: Callable[[Path], None]
) -> None:
    trace = tmp_path / "team.jsonl"
    with mission_up("--trace", str(trace), mission_xml=TEAM) as mission:
        for robot, course in COURSES.items():
            before = await place_of(mission, robot)
            said = taken_over(mission, robot, course)
            assert [line["event"] for line in (said[0], said[-1])] == ["granted", "released"]
            applied = {line["command"]: line["values"] for line in said if line["event"] == "applied"}
            wanted = {line.get("give", "move") for line in course}
            assert wanted <= applied.keys(), said
            if "move" in wanted:
                assert math.dist(await place_of(mission, robot), before) > MOVED_M
        assert status_when_settled(mission)["absent"] == []
        assert mission.down() == 0
    judged(trace)
