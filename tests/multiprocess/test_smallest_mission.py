"""The smallest mission runs: fourteen lines, real processes, and a person drives its robot."""

from __future__ import annotations

import json
import math
from pathlib import Path

import pytest
from running_mission import mission_up

from resource_pool.localization import AskPose, Pose

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

SMALLEST = Path(__file__).parents[2] / "docs" / "examples" / "smallest.xml"
DRIVE = '{"at_s":0.2,"left_rad_s":6,"right_rad_s":-6}\n{"at_s":1.2,"release":true}\n'


async def test_the_smallest_mission_comes_up_and_its_robot_is_driven() -> None:
    with mission_up(mission_xml=SMALLEST) as mission:
        async with mission.bus() as bus:
            before = await bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=2)
            words = ("scout-console", "attach", "scout1", "--profile", "pendant", "--mission", mission.name)
            done = mission.command(*words, "--script", "-", stdin=DRIVE)
            after = await bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=2)
        assert done.returncode == 0, f"{done.stdout}\n{done.stderr}\n{mission.story()}"
        assert [json.loads(line)["event"] for line in done.stdout.splitlines()][-1] == "released"
        turned = math.remainder(after.heading_rad - before.heading_rad, math.tau)
        assert abs(turned) > 0.5, f"turned {turned:.2f} rad\n{mission.story()}"
