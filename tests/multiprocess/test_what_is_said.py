"""What is said in a mission is watched and counted by commands."""

from __future__ import annotations

import asyncio
import json
import subprocess
from collections.abc import Iterator
from typing import Any

import pytest
from running_mission import BIN, MISSION_XML, RunningMission, mission_up

from backbone.keys import Conversation
from resource_pool.drivers.world_messages import WorldState

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

WITHIN_S = 30.0
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
    asked = printed(mission, "watch", "*/scout1/ask", "--most", "60", "--for", "30")
    assert {"Move/1", "Applied/1"} <= {one["schema"] for one in asked}
    done = mission.command("scout-backbone", "watch", "*/nobody/*", "--for", "1", "--mission", mission.name)
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.thorough
async def test_the_busiest_keys_are_told_with_rates_and_sizes(mission: RunningMission) -> None:
    heard_s: list[float] = []
    async with mission.bus() as bus:
        bus.subscribe("resource_pool/world", Conversation.BODIES, WorldState, lambda one: heard_s.append(one.stamp_s))
        rows = await asyncio.to_thread(printed, mission, "top", "--for", "3")
    sizes = [one["bytes_per_s"] for one in rows]
    assert sizes == sorted(sizes, reverse=True)
    [world] = [one for one in rows if one["key"].endswith("/world/bodies")]
    heard_hz = (len(heard_s) - 1) / (heard_s[-1] - heard_s[0])  # a busy machine lets the world say less
    assert 0.5 * heard_hz < world["messages_per_s"] < 2 * heard_hz
    assert world["bytes_per_s"] == pytest.approx(world["messages_per_s"] * world["mean_bytes"])


@pytest.mark.thorough
def test_rates_are_told_again_and_again_until_the_command_is_ended(mission: RunningMission) -> None:
    words = [str(BIN / "scout-backbone"), "watch", "*/world/bodies", "--rate", "--mission", mission.name]
    with subprocess.Popen(words, env=mission.environment, stdout=subprocess.PIPE, text=True) as watching:
        assert watching.stdout is not None
        rows = (line for line in watching.stdout if "world/bodies" in line)
        assert all(next(rows) for _look in range(3))
        watching.terminate()
        watching.communicate(timeout=WITHIN_S)  # it ends in good order if it is read to its end
    assert watching.returncode == 0
