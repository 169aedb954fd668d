"""An errand of any robot of an example mission: out to a place and home, by dead reckoning."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

from behaviors_at_work import at_work, pose

from backbone.mission.model import MissionDescription
from backbone.mission.reader import read_mission_bytes
from mission_control.messages import BehaviorStatus
from resource_pool.localization import AskPose, Pose

SWAY_M = 0.05  # what the middle of a robot with legs moves to and fro at each step

STEP = """
<behavior type="{type}" name="{name}" priority="1">{place}
  <parameter name="localizer" value="localizer"/><parameter name="reached_within_m" value="0.15"/>
  <arc kind="{kind}_drive" minimum-runtime-s="5" period-s="0.05" packet-time-s="0.006">
    <wish type="{kind}" name="{robot}"/>
  </arc>
</behavior>
"""
PLACE = '<parameter name="x_m" value="{}"/><parameter name="y_m" value="{}"/>'
TREE = """
<behaviors><behavior type="sequence" name="errand" priority="1">{out}{home}</behavior></behaviors></mission>
"""


def with_errand(file: Path, robot: str, kind: str, place: tuple[float, float]) -> MissionDescription:
    """Return the example's mission with this errand in place of its behaviors."""
    hardware = file.read_text(encoding="utf-8").partition("<behaviors>")[0]
    out = STEP.format(type="go_to", name="go-out", place=PLACE.format(*place), kind=kind, robot=robot)
    home = STEP.format(type="return_home", name="go-home", place="", kind=kind, robot=robot)
    return read_mission_bytes((hardware + TREE.format(out=out, home=home)).encode(), str(file))


async def errand(file: Path, robot: str, kind: str, place: tuple[float, float]) -> None:
    """Let the robot go there and come home; fail unless it does, and what is believed is as sure as it says."""
    mission = with_errand(file, robot, kind, place)
    async with at_work(mission) as running:
        begin = await pose(running, robot)
        tree: Any = running.component("errand")
        nearest_m = math.inf
        while not tree.status.is_final:
            truth = await pose(running, robot)
            nearest_m = min(nearest_m, math.hypot(truth.x_m - place[0], truth.y_m - place[1]))
            believed = await running.bus.ask("resource_pool/localizer", AskPose(robot), Pose, within_s=1.0)
            wrong_m = math.hypot(truth.x_m - believed.x_m, truth.y_m - believed.y_m)
            assert wrong_m <= 2.5 * believed.spread_m + SWAY_M, (wrong_m, believed)
            await running.clock.sleep_s(0.5)
            assert running.clock.now_s() < 120
        assert tree.status is BehaviorStatus.SUCCESS, tree.payload
        end = await pose(running, robot)
        assert nearest_m < 0.5
        assert math.hypot(end.x_m - begin.x_m, end.y_m - begin.y_m) < 0.8
