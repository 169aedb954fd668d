"""Returning to the marked place: the way there with a played robot, then all of it in the simulated world."""

from __future__ import annotations

import math
from typing import Any

import msgspec
import pytest
from behaviors_at_work import Person, at_work, driving, example, pose, wait_until
from hypothesis import given
from hypothesis import strategies as st

from backbone.bus.clock import run_virtual
from backbone.component.messages import Parameters, SetParameter
from mission_control.behaviors.motion import FloorPoint, Motion, Position
from mission_control.behaviors.pickup_route import AWAY_M, NEAR_M, PickupRoute, PickupStage
from mission_control.behaviors.return_to_pickup import PickupParameters, ReturnToPickup
from mission_control.messages import BehaviorStatus

NAME, ROBOT = "return-scout5", "scout5"
NEAR = FloorPoint(2.0, 2.0)
positions = st.builds(Position, st.floats(0.0, 6.0), st.floats(0.0, 6.0), st.floats(-math.pi, math.pi))


def pickup_route(attempts: int = 2) -> PickupRoute:
    return PickupRoute(NEAR, speed_m_s=0.2, attempts=attempts)


@given(positions)
def test_far_from_the_mark_it_travels_first_and_near_it_goes_by_sight_at_once(position: Position) -> None:
    route = pickup_route()
    motion = route.decide(position, 0.0)
    if NEAR.distance_m(position) > AWAY_M:
        assert route.stage is PickupStage.TRAVEL
        assert motion != Motion()
    else:
        assert route.stage is PickupStage.BY_SIGHT
        assert motion == Motion()


@given(positions, positions)
def test_wherever_it_was_left_after_a_suspension_it_goes_on_from_there(before: Position, after: Position) -> None:
    route = pickup_route()
    route.decide(before, 0.0)
    went_by_sight = route.stage is PickupStage.BY_SIGHT
    for _ in range(2):
        route.interrupt()
        assert route.stage is (PickupStage.LOOK if went_by_sight else PickupStage.UNKNOWN)
    route.looked(is_seen=False)
    route.decide(after, 100.0)
    assert (route.stage is PickupStage.TRAVEL) == (NEAR.distance_m(after) > AWAY_M)


def test_if_the_mark_is_in_sight_after_a_suspension_it_goes_on_by_sight_wherever_that_is() -> None:
    route = pickup_route()
    route.decide(Position(2.0, 2.0, 0.0), 0.0)
    route.interrupt()
    route.looked(is_seen=True)
    assert route.stage is PickupStage.BY_SIGHT


def test_it_travels_until_it_is_near_and_is_freed_when_it_does_not_get_on() -> None:
    route, stuck = pickup_route(), Position(5.0, 2.0, math.pi)
    motions = [route.decide(stuck, tenth / 10) for tenth in range(60)]
    assert Motion(-0.35) in motions
    assert route.decide(Position(2.0 + NEAR_M / 2, 2.0, 0.0), 6.0) == Motion()
    assert route.stage is PickupStage.BY_SIGHT


def test_what_was_looked_for_in_vain_is_remembered_over_a_suspension() -> None:
    route = pickup_route(attempts=2)
    route.decide(Position(2.0, 2.0, 0.0), 0.0)
    route.not_found()
    assert route.stage is PickupStage.TRAVEL
    route.interrupt()
    assert route.in_vain == 1
    route.decide(Position(2.0, 2.0, 0.0), 50.0)
    route.not_found()
    assert route.stage is PickupStage.FAILED
    route.interrupt()
    assert route.stage is PickupStage.FAILED


@pytest.mark.thorough
def test_in_the_world_a_robot_that_was_driven_away_meanwhile_returns_to_its_mark() -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(example(NAME), person) as running:
            behavior = running.component(NAME)
            assert isinstance(behavior, ReturnToPickup)
            await wait_until(running, lambda: behavior.route.stage is PickupStage.BY_SIGHT, 30.0)
            await person.take_over(ROBOT, driving(-12.0, -13.0, 6.0))
            await wait_until(running, lambda: behavior.status.is_final, 120.0)
            assert behavior.status is BehaviorStatus.SUCCESS, behavior.payload
            assert behavior.statistics()["times_suspended"] >= 1
            at = await pose(running, ROBOT)
            assert math.hypot(at.x_m - (0.2 + 0.45), at.y_m - 4.5) < 0.05
            assert abs(abs(at.heading_rad) - math.pi) < math.radians(10.0)

    run_virtual(scene())


def test_in_the_world_another_place_or_distance_while_it_goes_by_sight_does_not_stop_it() -> None:
    async def scene() -> None:
        async with at_work(example(NAME)) as running:
            behavior: Any = running.component(NAME)
            await wait_until(running, lambda: behavior.route.stage is PickupStage.BY_SIGHT, 30.0)
            for parameter, value in (("near", "2,4.5"), ("stop_m", 0.6)):
                await running.bus.ask(behavior.address, SetParameter(parameter, value), Parameters, within_s=1.0)
                await running.clock.sleep_s(1.0)
            await wait_until(running, lambda: behavior.status.is_final, 90.0)
            assert behavior.status is BehaviorStatus.SUCCESS
            assert behavior.payload["ahead_m"] == pytest.approx(0.6, abs=0.05)

    run_virtual(scene())


@pytest.mark.thorough
def test_in_the_world_a_robot_left_before_its_mark_does_not_go_back_to_where_it_came_by() -> None:
    """Its place before the mark is 1.15 m from the place to which it goes first."""

    async def scene() -> None:
        person = Person()
        async with at_work(example(NAME, near="1.8,4.5"), person) as running:
            behavior: Any = running.component(NAME)
            while (await pose(running, ROBOT)).x_m > 0.75:
                await running.clock.sleep_s(0.1)
                assert running.clock.now_s() < 60.0, behavior.feedback
            assert not behavior.status.is_final
            await person.take_over(ROBOT, driving(0.0, 0.0, 0.3))
            await wait_until(running, lambda: behavior.robot, 5.0)
            stages = {PickupStage.LOOK, PickupStage.UNKNOWN}
            await wait_until(running, lambda: behavior.route.stage not in stages, 5.0)
            assert behavior.route.stage is PickupStage.BY_SIGHT
            await wait_until(running, lambda: behavior.status.is_final, 60.0)
            assert behavior.status is BehaviorStatus.SUCCESS

    run_virtual(scene())


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"near": "1"}, "is no place"),
        ({"near": "1,1 2,2"}, "write one place"),
        ({"localizer": ""}, "localizer"),
        ({"speed_m_s": 0.0}, "> 0.0 - at .*speed_m_s"),
        ({"search_turns": 0.0}, "> 0.0 - at .*search_turns"),
        ({"attempts": 0}, ">= 1 - at .*attempts"),
        ({"stop_m": 0.0}, ">= 0.4 - at .*stop_m"),
    ],
)
def test_parameters_that_mean_nothing_are_refused_with_the_remedy(given: dict[str, object], complaint: str) -> None:
    with pytest.raises(msgspec.ValidationError, match=complaint):
        msgspec.convert({"near": "1,1", "localizer": "world", **given}, PickupParameters)
