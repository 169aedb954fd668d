"""A patrol on the real bus under the RC manager, taken over at any moment."""

from __future__ import annotations

import msgspec
import pytest
from behaviors_at_work import FEW_MOMENTS, MANY_MOMENTS, Person, at_work, driving, example, hear, pose, wait_until
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import run_virtual
from backbone.mission.model import MissionDescription
from mission_control.behaviors.patrol import Patrol, PatrolParameters
from mission_control.messages import BehaviorStatus, WaypointReached

NAME, ROBOT = "patrol-scout1", "scout1"
PLACES = {"waypoints": "1,1 2.5,1 2.5,2.5 1,2.5", "localizer": "world"}


def patrol(rounds: int = 1, **parameters: object) -> MissionDescription:
    return example(NAME, rounds=rounds, **parameters)


def undisturbed(rounds: int = 1) -> list[tuple[int, int]]:
    return [(number + 1, number % 4) for number in range(4 * rounds)]


def record(heard: list[WaypointReached]) -> list[tuple[int, int]]:
    return [(event.number, event.waypoint) for event in heard]


def test_a_patrol_tells_each_way_point_and_succeeds_after_its_rounds() -> None:
    async def scene() -> None:
        async with at_work(patrol(rounds=2)) as running:
            heard = hear(running, NAME, WaypointReached)
            behavior = running.component(NAME)
            assert isinstance(behavior, Patrol)
            await wait_until(running, lambda: behavior.status.is_final, 120.0)
            assert behavior.status is BehaviorStatus.SUCCESS
            assert record(heard) == undisturbed(2)
            assert heard[0].robot == ROBOT
            assert behavior.statistics()["shaken_free"] == 0
            at = await pose(running, ROBOT)
            assert (at.x_m, at.y_m) == pytest.approx((1.0, 2.5), abs=0.12)

    run_virtual(scene())


Disturbances = list[tuple[float, tuple[float, float], float]]
take_overs = st.lists(
    st.tuples(
        st.floats(2.0, 15.0), st.sampled_from([(8.0, 8.0), (-8.0, -6.0), (3.0, -3.0), (0.0, 0.0)]), st.floats(0.1, 6.0)
    ),
    min_size=1,
    max_size=5,
)


def play(disturbances: Disturbances) -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(patrol(), person) as running:
            heard = hear(running, NAME, WaypointReached)
            behavior = running.component(NAME)
            assert isinstance(behavior, Patrol)
            await wait_until(running, lambda: behavior.statistics()["times_resumed"], 10.0)
            for after_s, wheels, lasts_s in disturbances:
                await running.clock.sleep_s(after_s)
                await person.take_over(ROBOT, driving(*wheels, lasts_s))
            await wait_until(running, lambda: behavior.status.is_final, 150.0)
            assert behavior.status is BehaviorStatus.SUCCESS
            assert record(heard) == undisturbed()
            assert behavior.statistics()["times_suspended"] >= 1
            world = await running.statistics("world")
            assert world["stale_packets"] == 0

    run_virtual(scene())


@FEW_MOMENTS
@given(take_overs)
def test_taken_over_at_any_moment_its_record_is_that_of_an_undisturbed_patrol(
    disturbances: Disturbances,
) -> None:
    play(disturbances)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@MANY_MOMENTS
@given(take_overs)
def test_taken_over_at_many_more_moments_its_record_is_still_that(
    disturbances: Disturbances,
) -> None:
    play(disturbances)


def test_a_patrol_says_why_it_is_suspended_and_how_far_it_is() -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(patrol(), person) as running:
            behavior = running.component(NAME)
            said: list[str] = []
            await running.clock.sleep_s(15.0)

            async def look(console: object) -> None:
                await driving(0.0, 0.0, 0.5)(console)  # type: ignore[arg-type]
                said.append(behavior.feedback)

            await person.take_over(ROBOT, look)
            assert said[0].startswith("suspended: ")
            assert "way points reached, next is" in said[0]
            await running.clock.sleep_s(0.5)
            assert behavior.feedback.startswith("patrols with scout1")

    run_virtual(scene())


def test_a_robot_nobody_tracks_ends_the_patrol_with_the_reason() -> None:
    async def scene() -> None:
        async with at_work(patrol(localizer="radio")) as running:
            behavior = running.component(NAME)
            assert isinstance(behavior, Patrol)
            await wait_until(running, lambda: behavior.status.is_final, 30.0)
            assert behavior.status is BehaviorStatus.FAILURE
            assert behavior.payload["code"] == "wire.unknown"

    run_virtual(scene())


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"waypoints": ""}, "there is no place"),
        ({"waypoints": "1,1 2"}, "'2' is no place"),
        ({"waypoints": "1,nan"}, "finite"),
        ({"localizer": ""}, "localizer"),
        ({"rounds": -1}, ">= 0 - at .*rounds"),
        ({"speed_m_s": 0.0}, "> 0.0 - at .*speed_m_s"),
        ({"speed_m_s": 0.5}, "<= 0.3 - at .*speed_m_s"),
        ({"reached_within_m": 0.0}, ">= 0.02 - at .*reached_within_m"),
        ({"rest_s": -1.0}, ">= 0.0 - at .*rest_s"),
    ],
)
def test_parameters_that_mean_nothing_are_refused_with_the_remedy(given: dict[str, object], complaint: str) -> None:
    with pytest.raises(msgspec.ValidationError, match=complaint):
        msgspec.convert({**PLACES, **given}, PatrolParameters)
