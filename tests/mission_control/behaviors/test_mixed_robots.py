"""The example mission of two kinds of robot: it is sound, and one behavior drives both at the same time."""

from __future__ import annotations

import pytest
from behaviors_at_work import EXAMPLES, Person, at_work, driving, hear, pose, wait_until
from errands import errand
from rehearsed_missions import assert_each_gets_its_turn

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import run_virtual
from backbone.mission.reader import read_mission
from backbone.rc_manager.messages import AskAttributes, AskRc, RcState
from backbone.scheduling.views import Attributes
from mission_control.messages import WaypointReached
from ui_console.session.teleoperation import Teleoperation

MIXED = EXAMPLES / "mixed.xml"


def test_one_behavior_patrols_with_a_rover_and_with_a_scout_on_one_radio() -> None:
    async def main() -> None:
        async with at_work(read_mission(MIXED)) as running:
            visits = {robot: hear(running, f"patrol-{robot}", WaypointReached) for robot in ("rover1", "scout1")}
            for number, place in enumerate([(3, 2), (6, 2), (6, 4.5), (3, 4.5)], start=1):
                await wait_until(running, lambda n=number: len(visits["rover1"]) >= n, 40.0)
                at = await pose(running, "rover1")
                assert (at.x_m, at.y_m) == pytest.approx(place, abs=0.2)
            for robot, heard in visits.items():
                assert [(visit.robot, visit.waypoint) for visit in heard[:4]] == [(robot, place) for place in range(4)]
            world = await running.statistics("world")
            assert world["packets_for_no_robot"] == world["stale_packets"] == 0

    run_virtual(main())


def test_a_person_who_drives_the_rover_declares_packets_as_long_as_they_are() -> None:
    """The radio measures 4.34 ms with a reply; consoles declared 2 ms for every robot."""
    person = Person()

    async def main() -> None:
        async with at_work(read_mission(MIXED), person) as running:

            async def course(console: Teleoperation) -> None:
                await driving(2.0, 2.0, lasts_s=3.0)(console)
                radio = await running.bus.ask("resource_pool/radio", AskRc(), RcState, within_s=1.0)
                assert radio.holders
                assert radio.measured == []
                question = AskAttributes(console.name)
                [asked] = (await running.bus.ask(RC_MANAGER, question, Attributes, within_s=1.0)).requests
                assert asked.uses["radio"].streams[0].packet_time_s == 0.005
                seen.append(asked.arc)

            await person.take_over("rover1", course, kind="rover_drive")

    seen: list[str] = []
    run_virtual(main())
    assert seen


def test_a_rover_goes_out_and_home_by_dead_reckoning() -> None:
    run_virtual(errand(MIXED, "rover1", "rover", (6.0, 4.0)))


def test_the_example_is_sound_and_no_robot_waits_for_the_other() -> None:
    assert_each_gets_its_turn(MIXED)
