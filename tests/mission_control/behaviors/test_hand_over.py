"""A person drives a Scout into position and lets go; the behavior that watches through it takes over."""

from __future__ import annotations

from pathlib import Path

import pytest
from behaviors_at_work import Person, at_work, driving, hear, pose, wait_until

from backbone.bus.clock import run_virtual
from backbone.mission.reader import read_mission
from mission_control.messages import MotionSeen

MISSION = Path(__file__).parents[3] / "mission.xml"


def test_a_scout_is_teleoperated_into_position_released_and_watches_from_there() -> None:
    """IROS 2001, "Distributed Surveillance"."""

    async def scene() -> None:
        person = Person()
        async with at_work(read_mission(MISSION), person) as running:
            heard = hear(running, "watch-scout1", MotionSeen)
            before = await pose(running, "scout1")
            await person.take_over("scout1", driving(8.0, 8.0, 3.0), kind="video_drive")
            there = await pose(running, "scout1")
            assert there.y_m > before.y_m + 0.3
            released_s = running.clock.now_s()
            await wait_until(running, lambda: any(seen.at_s > released_s for seen in heard), 240.0)
            switches = [line for line in running.trace if line["ev"] == "connect" and "scout1" in line["epoch"]]
            holders = [line["arc"] for line in switches]
            epochs = [line["epoch"]["scout1"] for line in switches]
            at = holders.index("console-1-video_drive")
            assert set(holders[:at]) == set(holders[at + 1 :]) == {"watch-scout1-capture"}
            assert epochs == sorted(set(epochs))
            still = await pose(running, "scout1")
            assert (still.x_m, still.y_m) == pytest.approx((there.x_m, there.y_m), abs=0.02)

    run_virtual(scene())
