"""Servoing to the landmark in the simulated world, with noise on the air, and taken over on the way."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import msgspec
import pytest
from behaviors_at_work import FEW_MOMENTS, MANY_MOMENTS, Person, at_work, driving, example, pose, wait_until
from fake_resource_pool import FakePlacer
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_order
from backbone.mission.model import MissionDescription
from backbone.wire import Envelope
from mission_control.behaviors.servo_to_target import ServoParameters, ServoToTarget
from mission_control.messages import BehaviorStatus
from resource_pool.dead_reckoning import FloorPose
from resource_pool.floor_plans import before_board
from resource_pool.localization import LandmarkSighting, Pose

NAME, ROBOT = "servo-scout3", "scout3"
PLACE = (4.5, 5.8 - 0.45, math.pi / 2)


def without_landmark(mission: MissionDescription) -> MissionDescription:
    def bare(parameters: dict[str, Any]) -> dict[str, Any]:
        return {**parameters, "world": {**parameters["world"], "landmarks": []}}

    worlds = [msgspec.structs.replace(part, parameters=bare(part.parameters)) for part in mission.components]
    return msgspec.structs.replace(mission, components=tuple(worlds))


def assert_at_its_place(at: Pose) -> None:
    """Within 5 cm and 10 degrees."""
    assert math.hypot(at.x_m - PLACE[0], at.y_m - PLACE[1]) < 0.05
    assert abs(at.heading_rad - PLACE[2]) < math.radians(10.0)


Disturbances = list[tuple[float, float, int]]
take_overs = st.lists(
    st.tuples(st.floats(3.0, 15.0), st.floats(0.2, 2.0), st.sampled_from([-1, 1])), min_size=1, max_size=2
)


def play(disturbances: Disturbances) -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(example(NAME), person) as running:
            behavior = running.component(NAME)
            assert isinstance(behavior, ServoToTarget)
            approaches = 0.0
            await wait_until(running, lambda: behavior.statistics()["times_resumed"], 10.0)
            for after_s, lasts_s, side in disturbances:
                await running.clock.sleep_s(after_s)
                await person.take_over(ROBOT, driving(-side * 4.0, side * 4.0, lasts_s))
                assert behavior.statistics()["approaches"] >= approaches
                approaches = behavior.statistics()["approaches"]
            await wait_until(running, lambda: behavior.status.is_final, 120.0)
            assert behavior.status is BehaviorStatus.SUCCESS, behavior.payload
            assert behavior.statistics()["times_suspended"] >= len(disturbances)
            assert_at_its_place(await pose(running, ROBOT))

    run_virtual(scene())


@pytest.mark.thorough
@FEW_MOMENTS
@given(take_overs)
def test_taken_over_and_turned_away_at_any_moment_it_still_arrives(
    disturbances: Disturbances,
) -> None:
    play(disturbances)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@MANY_MOMENTS
@given(take_overs)
def test_taken_over_at_many_more_moments_it_still_arrives(disturbances: Disturbances) -> None:
    play(disturbances)


@pytest.mark.thorough
def test_where_there_is_no_target_it_fails_after_its_turns() -> None:
    async def scene() -> None:
        async with at_work(without_landmark(example(NAME, search_turns=1))) as running:
            behavior = running.component(NAME)
            assert isinstance(behavior, ServoToTarget)
            await wait_until(running, lambda: behavior.status.is_final, 60.0)
            assert behavior.status is BehaviorStatus.FAILURE
            assert behavior.payload["code"] == "servo.target_not_found"
            assert "no target in 1 turns" in behavior.payload["detail"]

    run_virtual(scene())


def test_pictures_of_another_camera_end_it_with_the_remedy(local_mission: Any) -> None:
    async def scene() -> None:
        async with local_mission("servoing") as network:
            placer = FakePlacer(network, VirtualClock(), {"servo": ServoToTarget})
            arc_need = {"kind": "capture", "minimum_runtime_s": 5.0}
            order = {"type": "servo", "name": "servo", "priority": 1, "arc": arc_need}
            servo = await placer.launch(behavior_order(order, [("servoing", 10)]))
            await placer.wait(lambda: placer.arcs)
            [arc] = placer.arcs.values()
            await arc.grant()
            arc.publish(bytes(12), 4, 3)
            await placer.wait(lambda: servo.status is BehaviorStatus.FAILURE)
            assert servo.payload["code"] == "servo.unusable_picture"
            assert "320 by 240" in servo.payload["remedy"]
            await placer.close()

    run_virtual(scene())


def test_a_driving_behavior_without_an_arc_fails_and_says_which_it_needs(local_mission: Any) -> None:
    async def scene() -> None:
        async with local_mission("servoing") as network:
            placer = FakePlacer(network, VirtualClock(), {"servo": ServoToTarget})
            order = {"type": "servo", "name": "servo", "priority": 1}
            servo = await placer.launch(behavior_order(order, [("servoing", 10)]))
            await placer.wait(lambda: servo.status is BehaviorStatus.FAILURE)
            assert servo.payload["code"] == "behavior.needs_arc"
            assert "'capture'" in servo.payload["detail"]
            await placer.close()

    run_virtual(scene())


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"stop_m": 0.1}, ">= 0.4 - at .*stop_m"),
        ({"search_turns": -1.0}, ">= 0.0 - at .*search_turns"),
        ({"latency_s": 0.5}, "< 0.5 - at .*latency_s"),
    ],
)
def test_parameters_that_mean_nothing_are_refused_with_the_remedy(given: dict[str, object], complaint: str) -> None:
    with pytest.raises(msgspec.ValidationError, match=complaint):
        msgspec.convert(given, ServoParameters)


@pytest.mark.thorough
def test_what_it_sees_of_the_landmark_tells_localizers_where_the_robot_is() -> None:
    async def scene() -> None:
        async with at_work(example(NAME)) as running:
            told: list[tuple[LandmarkSighting, float]] = []
            board = FloorPose(4.5, 5.8, -math.pi / 2)

            def heard(envelope: Envelope[LandmarkSighting]) -> None:
                told.append((envelope.body, running.clock.now_s()))

            running.bus.subscribe(f"mission_control/{NAME}", Conversation.SIGHTINGS, LandmarkSighting, heard)
            behavior = running.component(NAME)
            truth: list[tuple[float, Pose]] = []
            while not behavior.status.is_final:
                truth.append((running.clock.now_s(), await pose(running, ROBOT)))
                await running.clock.sleep_s(1 / 30)
            assert len(told) > 5
            for sighting, at_s in told:
                assert sighting.robot == ROBOT
                assert 0 <= at_s - sighting.at_s < 0.5
                _, at = min(truth, key=lambda one, then_s=sighting.at_s: abs(one[0] - then_s))
                seen = before_board(board, sighting)
                assert math.hypot(seen.x_m - at.x_m, seen.y_m - at.y_m) <= 2 * sighting.spread_m
                assert abs(math.remainder(seen.heading_rad - at.heading_rad, math.tau)) < math.radians(12.0)
            pauses = [after.at_s - before.at_s for (before, _), (after, _) in pairwise(told)]
            assert min(pauses) > 0.19

    run_virtual(scene())
