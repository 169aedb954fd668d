"""Laws of a way to one place, and of the distance that a follower keeps."""

from __future__ import annotations

import math

import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from mission_control.behaviors.motion import MOST_RAD_S, STILL, FloorPoint, Motion, Position
from mission_control.behaviors.way import ATTEMPTS, Way, keep_distance

STEP_S = 0.1
coordinates = st.floats(-4, 4)
places = st.builds(FloorPoint, coordinates, coordinates)
positions = st.builds(Position, coordinates, coordinates, st.floats(-math.pi, math.pi))


def obey(position: Position, motion: Motion) -> Position:
    heading_rad = position.heading_rad + motion.turn_rad_s * STEP_S
    return Position(
        position.x_m + motion.forward_m_s * math.cos(heading_rad) * STEP_S,
        position.y_m + motion.forward_m_s * math.sin(heading_rad) * STEP_S,
        heading_rad,
    )


def way(place: FloorPoint, within_s: float = 0.0) -> Way:
    return Way(place, speed_m_s=0.2, reached_within_m=0.08, within_s=within_s)


def go(one: Way, position: Position, now_s: float, until_s: float) -> tuple[Position, float]:
    while now_s < until_s and not one.is_over:
        position = obey(position, one.decide(position, now_s))
        now_s += STEP_S
    return position, now_s


@settings(max_examples=share(60))
@given(positions, places)
def test_an_undisturbed_robot_gets_there_and_stands(position: Position, place: FloorPoint) -> None:
    one = way(place)
    at, now_s = go(one, position, 0.0, 300.0)
    assert (one.is_there, one.failure) == (True, "")
    assert place.distance_m(at) <= 0.08
    assert one.decide(at, now_s) == STILL


@settings(max_examples=share(60))
@given(positions, places, st.lists(st.tuples(st.floats(0.1, 10), st.floats(0, 50), st.none() | positions), max_size=5))
def test_after_any_interruptions_it_gets_there_too(
    position: Position, place: FloorPoint, interruptions: list[tuple[float, float, Position | None]]
) -> None:
    one, now_s = way(place), 0.0
    for after_s, lasts_s, left_at in interruptions:
        position, now_s = go(one, position, now_s, now_s + after_s)
        if one.is_over:
            break
        one.interrupt()
        position, now_s = left_at or position, now_s + lasts_s
    at, _ = go(one, position, now_s, now_s + 300.0)
    assert (one.is_there, place.distance_m(at) <= 0.08) == (True, True)


def test_a_robot_that_gets_no_nearer_fails_after_its_shakes() -> None:
    one, now_s = way(FloorPoint(3, 0)), 0.0
    while not one.is_over and now_s < 100:
        one.decide(Position(0, 0, 0), now_s)
        now_s += STEP_S
    assert "3.00 m are left" in one.failure
    assert 4.0 * ATTEMPTS < now_s < 40
    assert not one.is_there
    assert one.decide(Position(0, 0, 0), now_s) == STILL


def test_a_robot_that_gets_no_nearer_fails_in_slices_shorter_than_its_patience_too() -> None:
    one, now_s = way(FloorPoint(3, 0)), 0.0
    while not one.is_over and now_s < 200:
        one.interrupt()
        for _ in range(20):
            one.decide(Position(0, 0, 0), now_s)
            now_s += STEP_S
        now_s += 2.0
    assert "3.00 m are left" in one.failure


@pytest.mark.parametrize(("x_m", "has_failed"), [(2.5, True), (0.5, False)], ids=["left there", "carried back"])
def test_shakes_in_vain_at_one_place_do_not_count_where_a_person_carried_the_robot(
    x_m: float, has_failed: bool
) -> None:
    one, now_s = way(FloorPoint(3, 0)), 0.0
    while now_s < 18.0:
        one.decide(Position(2.5, 0, 0), now_s)
        now_s += STEP_S
    one.interrupt()
    while now_s < 25.0:
        one.decide(Position(x_m, 0, 0), now_s)
        now_s += STEP_S
    assert bool(one.failure) is has_failed


def test_a_robot_that_a_shake_frees_goes_on() -> None:
    """Stuck again and again, each time further on."""
    one, now_s, x_m = way(FloorPoint(3, 0)), 0.0, 0.0
    while not one.is_over and now_s < 200:
        for _ in range(60):
            one.decide(Position(x_m, 0, 0), now_s)
            now_s += STEP_S
        x_m += 0.3
    assert one.is_there


def test_only_the_time_of_grants_counts_towards_its_limit() -> None:
    one = way(FloorPoint(3, 0), within_s=5.0)
    position, now_s = go(one, Position(0, 0, 0), 0.0, 3.0)
    one.interrupt()
    position, now_s = go(one, position, now_s + 1000.0, now_s + 1001.0)
    assert not one.is_over
    go(one, position, now_s, now_s + 10.0)
    assert "after 5 s" in one.failure


def test_a_place_that_is_reached_in_the_last_moment_is_reached() -> None:
    one = way(FloorPoint(3, 0), within_s=0.05)
    one.decide(Position(0, 0, 0), 0.0)
    one.decide(Position(3, 0, 0), 0.1)
    assert (one.is_there, one.failure) == (True, "")


def following(position: Position, target: FloorPoint, distance_m: float) -> Motion:
    return keep_distance(position, target, distance_m, speed_m_s=0.2, tolerance_m=0.1 * distance_m)


@given(positions, places, st.floats(0.2, 3))
def test_a_follower_is_never_asked_for_more_than_it_can_do(
    position: Position, target: FloorPoint, distance_m: float
) -> None:
    motion = following(position, target, distance_m)
    assert abs(motion.forward_m_s) <= 0.2
    assert abs(motion.turn_rad_s) <= MOST_RAD_S


@settings(max_examples=share(60))
@given(positions, places, st.floats(0.2, 3))
def test_a_follower_comes_to_its_distance_faces_the_target_and_stands(
    position: Position, target: FloorPoint, distance_m: float
) -> None:
    for _ in range(1000):
        position = obey(position, following(position, target, distance_m))
    assert target.distance_m(position) == pytest.approx(distance_m, rel=0.11)
    assert abs(target.bearing_rad(position)) < math.radians(11)
    assert following(position, target, distance_m) == STILL


def test_a_follower_goes_after_a_target_that_leaves_and_backs_off_from_one_that_comes() -> None:
    at = Position(0, 0, 0)
    assert following(at, FloorPoint(2, 0), 0.5).forward_m_s == pytest.approx(0.2)
    assert following(at, FloorPoint(0.2, 0), 0.5).forward_m_s < 0
    assert following(at, FloorPoint(-2, 0.1), 0.5).forward_m_s == 0
