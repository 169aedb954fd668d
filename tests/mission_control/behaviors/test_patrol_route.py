"""The pure part of a patrol, with a robot that obeys exactly, or moves at random."""

from __future__ import annotations

import math
from dataclasses import dataclass

from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from mission_control.behaviors.motion import (
    MOST_M_S,
    MOST_RAD_S,
    STILL,
    FloorPoint,
    Maneuver,
    Motion,
    Position,
    Watchdog,
    head_for,
    turn_to,
    turned,
)
from mission_control.behaviors.patrol_route import PatrolRoute
from scout_model import dimensions
from scout_model.scout import wheels_rad_s

STEP_S = 0.1
SQUARE = [FloorPoint(1.0, 1.0), FloorPoint(3.0, 1.0), FloorPoint(3.0, 3.0), FloorPoint(1.0, 3.0)]

coordinates = st.floats(0.0, 6.0)
places = st.builds(FloorPoint, coordinates, coordinates)
positions = st.builds(Position, coordinates, coordinates, st.floats(-math.pi, math.pi))


def obey(position: Position, motion: Motion, lasts_s: float = STEP_S) -> Position:
    """Where a robot is that moved like this: on an arc."""
    heading_rad = position.heading_rad + motion.turn_rad_s * lasts_s
    half_rad = position.heading_rad + motion.turn_rad_s * lasts_s / 2
    gone_m = motion.forward_m_s * lasts_s
    return Position(
        position.x_m + gone_m * math.cos(half_rad), position.y_m + gone_m * math.sin(half_rad), turned(heading_rad)
    )


def route(waypoints: list[FloorPoint], *, rounds: int = 1, rest_s: float = 0.0) -> PatrolRoute:
    return PatrolRoute(waypoints, rounds=rounds, speed_m_s=0.25, reached_within_m=0.08, rest_s=rest_s)


def record(patrol: PatrolRoute) -> list[tuple[int, int]]:
    return [(visit.number, visit.waypoint) for visit in patrol.visits_since(0)]


def undisturbed(waypoints: list[FloorPoint], rounds: int) -> list[tuple[int, int]]:
    return [(number + 1, number % len(waypoints)) for number in range(rounds * len(waypoints))]


def drive(patrol: PatrolRoute, position: Position, now_s: float, until_s: float) -> tuple[Position, float]:
    while now_s < until_s and not patrol.is_over:
        position = obey(position, patrol.decide(position, now_s))
        now_s += STEP_S
    return position, now_s


@dataclass(frozen=True)
class TakeOver:
    """An operator has the robot for a while and leaves it there."""

    after_s: float
    lasts_s: float
    left_at: Position | None


take_overs = st.lists(
    st.builds(TakeOver, st.floats(0.0, 20.0), st.floats(0.0, 30.0), st.none() | positions), max_size=8
)


def test_a_scouts_wheels_reach_the_speed_of_a_patrol() -> None:
    assert max(wheels_rad_s(MOST_M_S, 0.0)) < dimensions.WHEEL_SPEED_LIMIT_RAD_S


@given(positions, places, st.floats(0.05, 0.3))
def test_head_for_never_asks_for_more_than_the_robot_can_do(
    position: Position, place: FloorPoint, speed_m_s: float
) -> None:
    motion = head_for(position, place, speed_m_s)
    assert 0 <= motion.forward_m_s <= speed_m_s
    assert abs(motion.turn_rad_s) <= MOST_RAD_S


@settings(max_examples=share(60))
@given(positions, places)
def test_head_for_brings_a_robot_there_and_to_rest(position: Position, place: FloorPoint) -> None:
    for _step in range(600):
        position = obey(position, head_for(position, place, 0.25))
    assert place.distance_m(position) < 0.02


@given(positions, st.floats(-10.0, 10.0))
def test_turn_to_ends_at_the_heading_and_moves_nowhere(position: Position, heading_rad: float) -> None:
    before = position
    for _step in range(60):
        motion = turn_to(position, heading_rad)
        assert motion.forward_m_s == 0
        position = obey(position, motion)
    assert abs(turned(position.heading_rad - heading_rad)) < 0.01
    assert (position.x_m, position.y_m) == (before.x_m, before.y_m)


def test_a_maneuver_plays_its_steps_once_from_when_it_is_first_asked() -> None:
    back_and_forth = Maneuver([(Motion(-0.3), 0.375), (Motion(0.3), 0.25)])
    played = [back_and_forth.motion(100 + eighth / 8) for eighth in range(7)]
    assert played == [*[Motion(-0.3)] * 3, *[Motion(0.3)] * 2, None, None]


def test_a_watchdog_bites_only_after_its_patience_without_progress() -> None:
    watchdog = Watchdog(2.0)
    nearing = [(1.0 - 0.05 * tenth, tenth / 10) for tenth in range(10)]
    standing = [(0.55, 1.0 + tenth / 10) for tenth in range(19)]
    assert not any(watchdog.is_stuck(distance_m, now_s) for distance_m, now_s in nearing + standing)
    assert watchdog.is_stuck(0.55, 3.0)
    watchdog.rest()
    assert not watchdog.is_stuck(0.55, 100.0)


@given(st.floats(0.0005, 0.02))
def test_a_slow_robot_is_not_stuck(speed_m_s: float) -> None:
    patrol = PatrolRoute([FloorPoint(0.2, 0.0)], rounds=1, speed_m_s=speed_m_s, reached_within_m=0.08, rest_s=0.0)
    drive(patrol, Position(0.0, 0.0, 0.0), 0.0, 0.13 / speed_m_s)
    assert (patrol.is_over, patrol.freed) == (True, 0)


@given(st.floats(0.2, 6.0), st.floats(0.1, 30.0))
def test_a_watchdog_counts_the_time_of_many_short_slices(slice_s: float, pause_s: float) -> None:
    """A robot that has not moved in a pause stays stuck; one that was moved gets all the patience again."""
    watchdog, now_s, driven_s = Watchdog(4.0), 0.0, 0.0
    while not watchdog.is_stuck(0.55, now_s):
        pauses = int((driven_s + STEP_S) / slice_s) > int(driven_s / slice_s)
        if pauses:
            watchdog.pause()
        now_s, driven_s = now_s + (pause_s if pauses else STEP_S), driven_s + STEP_S
        assert driven_s < 60.0
    assert driven_s > 3.9
    watchdog.pause()
    assert not watchdog.is_stuck(0.45, now_s + pause_s)
    assert not watchdog.is_stuck(0.45, now_s + pause_s + 3.9)
    assert watchdog.is_stuck(0.45, now_s + pause_s + 4.1)


def test_an_undisturbed_patrol_reaches_every_way_point_in_order_and_is_over() -> None:
    patrol = route(SQUARE, rounds=2)
    position, now_s = drive(patrol, Position(0.5, 0.5, 0.0), 0.0, 300.0)
    assert patrol.is_over
    assert record(patrol) == undisturbed(SQUARE, 2)
    assert SQUARE[-1].distance_m(position) < 0.1
    assert now_s < 100.0
    assert patrol.decide(position, now_s) == STILL


@given(st.floats(0.2, 1.5), st.floats(0.0, 0.5))
def test_a_robot_that_came_back_to_its_rest_is_not_stuck_on_its_way_on(carried_m: float, left_s: float) -> None:
    patrol = route(SQUARE, rest_s=10.0)
    position, now_s = drive(patrol, Position(1.0, 1.0, 0.0), 0.0, 10.0 - left_s)
    assert patrol.reached == 1
    drive(patrol, Position(position.x_m + carried_m, position.y_m, position.heading_rad), now_s, 60.0)
    assert patrol.reached > 1
    assert patrol.freed == 0


@settings(max_examples=share(80))
@given(st.lists(places, min_size=1, max_size=5), st.integers(1, 2), positions, take_overs)
def test_after_any_take_overs_the_record_is_that_of_an_undisturbed_patrol(
    waypoints: list[FloorPoint], rounds: int, position: Position, disturbances: list[TakeOver]
) -> None:
    patrol, now_s = route(waypoints, rounds=rounds), 0.0
    for disturbance in disturbances:
        position, now_s = drive(patrol, position, now_s, now_s + disturbance.after_s)
        patrol.interrupt()
        now_s += disturbance.lasts_s
        position = disturbance.left_at or position
    drive(patrol, position, now_s, now_s + 120.0 * rounds * len(waypoints))
    assert record(patrol) == undisturbed(waypoints, rounds)


@given(st.lists(st.tuples(positions, st.booleans()), max_size=60))
def test_whatever_the_robot_does_the_record_is_a_beginning_of_the_undisturbed_one(
    seen: list[tuple[Position, bool]],
) -> None:
    patrol = route(SQUARE, rounds=3)
    for step, (position, interrupted) in enumerate(seen):
        if interrupted:
            patrol.interrupt()
        near = SQUARE[patrol.next_waypoint] if step % 3 == 0 else None
        patrol.decide(Position(near.x_m, near.y_m, 0.0) if near else position, step * STEP_S)
    assert record(patrol) == undisturbed(SQUARE, 3)[: patrol.reached]


def test_a_way_point_that_is_passed_while_the_robot_is_not_held_does_not_count() -> None:
    patrol = route(SQUARE)
    patrol.decide(Position(1.0, 1.0, 0.0), 0.0)
    patrol.interrupt()
    patrol.decide(Position(3.0, 3.0, 0.0), 10.0)
    assert record(patrol) == [(1, 0)]
    assert patrol.next_waypoint == 1


def test_it_rests_at_a_way_point_for_the_time_it_is_held_and_comes_back_when_carried_away() -> None:
    patrol = route(SQUARE, rest_s=2.0)
    here = Position(1.0, 1.0, 0.0)
    motions = [patrol.decide(here, step * STEP_S) for step in range(11)]
    assert motions == [STILL] * 11
    patrol.interrupt()
    away = patrol.decide(Position(2.0, 1.0, math.pi), 60.0)
    assert away.forward_m_s > 0
    position, now_s = drive(patrol, Position(2.0, 1.0, math.pi), 60.1, 66.0)
    assert record(patrol) == [(1, 0)]
    assert SQUARE[0].distance_m(position) <= 0.16
    drive(patrol, position, now_s, now_s + 12.0)
    assert record(patrol) == [(1, 0), (2, 1)]


def test_a_robot_that_does_not_get_on_is_shaken_free_again_and_again_until_it_does() -> None:
    patrol = route(SQUARE)
    stuck = Position(2.0, 1.0, math.pi)
    motions = [patrol.decide(stuck, step * STEP_S) for step in range(120)]
    assert patrol.freed == 2
    assert Motion(-0.35) in motions
    assert Motion(0.35) in motions
    drive(patrol, stuck, 12.0, 60.0)
    assert record(patrol) == undisturbed(SQUARE, 1)
