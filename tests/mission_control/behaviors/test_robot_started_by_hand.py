"""A robot is switched on in a running mission: a person starts its RC, drives it at once, and stops it for good."""

from __future__ import annotations

from pathlib import Path

import msgspec
from behaviors_at_work import Person, at_work, driving, pose

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.launcher.start_by_hand import completed
from backbone.mission.reader import read_mission
from backbone.placer.messages import Start
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from mission_control.laboratory.simulation.whole_mission import RunningMission

MISSION = read_mission(Path(__file__).parents[3] / "mission.xml")
WITHOUT_SCOUT3 = msgspec.structs.replace(
    MISSION, resources=tuple(resource for resource in MISSION.resources if resource.name != "scout3")
)


async def robots(running: RunningMission) -> set[str]:
    schedule = await running.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=1.0)
    return {rc.rc for rc in schedule.rcs if rc.kind == "scout"}


def test_a_robot_that_is_started_by_hand_is_driven_at_once_and_gone_when_it_is_stopped() -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(WITHOUT_SCOUT3, person) as running:
            before = await pose(running, "scout3")
            assert await robots(running) == {"scout1", "scout2"}
            order, remark = await completed(running.bus, Start("scout", "scout3", {"network_id": 3}))
            assert "like scout1" in remark
            await running.start(order)
            await person.take_over("scout3", driving(8.0, 8.0, 3.0), kind="video_drive")
            there = await pose(running, "scout3")
            assert there.y_m > before.y_m + 0.3
            assert await robots(running) == {"scout1", "scout2", "scout3"}
            await running.stop("scout3")
            await running.clock.sleep_s(3.0)
            assert await robots(running) == {"scout1", "scout2"}
            await running.clock.sleep_s(12.0)
            grants = [line["arc"] for line in running.trace if line["ev"] == "grant"]
            assert {"watch-scout1-capture", "watch-scout2-capture"} <= set(
                grants[grants.index("console-1-video_drive") :]
            )

    run_virtual(scene())
