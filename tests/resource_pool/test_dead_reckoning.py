"""Laws of dead reckoning: events in, beliefs out."""

from __future__ import annotations

import math
from collections.abc import Callable

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.begin_places import read_begins
from resource_pool.dead_reckoning import REMEMBERED_S, Belief, DeadReckoning, FloorPose
from resource_pool.doubt import Doubt
from resource_pool.floor_plans import before_board, board, sighted_from
from resource_pool.localization import FloorPlan, LandmarkSighting, Pose, PoseSource
from resource_pool.messages import COMMAND_TIMEOUT_S

HERE = FloorPose(1.0, 2.0, 0.5)
BEGIN = Belief(HERE, 0.0, 0.02, 0.03)

poses = st.builds(FloorPose, st.floats(-9, 9), st.floats(-9, 9), st.floats(-math.pi, math.pi))
speeds = st.tuples(st.floats(-0.4, 0.4), st.floats(-3, 3))
pauses = st.floats(0, 2)
Event = Callable[[DeadReckoning, float], None]


def moving(forward_m_s: float, turn_rad_s: float) -> Event:
    return lambda robot, at_s: robot.moves(forward_m_s, turn_rad_s, at_s)


def counting(way_m: float, turned_rad: float) -> Event:
    return lambda robot, at_s: robot.counts(way_m, turned_rad, at_s)


def sighting(pose: FloorPose, spread_m: float, spread_rad: float, ago_s: float = 0.0) -> Event:
    return lambda robot, at_s: robot.sighted(pose, spread_m, spread_rad, at_s - ago_s)


honest_moves = speeds.map(lambda given: moving(*given))
honest_counts = st.tuples(st.floats(-3, 3), st.floats(-9, 9)).map(lambda given: counting(*given))
jumps = st.just(lambda robot, at_s: robot.jumps(at_s))
unsighted = st.lists(st.tuples(pauses, honest_moves | honest_counts | jumps), max_size=20)

wild = st.floats(allow_nan=True, allow_infinity=True)
hostile = st.one_of(
    st.tuples(wild, wild).map(lambda given: moving(*given)),
    st.tuples(wild, wild).map(lambda given: counting(*given)),
    st.tuples(st.builds(FloorPose, wild, wild, wild), wild, wild, wild.map(abs)).map(lambda given: sighting(*given)),
    jumps,
    honest_moves,
)


def played(robot: DeadReckoning, events: list[tuple[float, Event]]) -> float:
    """Play each event after its pause, and return the time of the last."""
    at_s = robot.believe(-1.0).at_s
    for pause_s, event in events:
        at_s += pause_s
        event(robot, at_s)
    return at_s


def are_near(one: FloorPose, other: FloorPose, within: float = 1e-6) -> bool:
    turn = one.heading_rad - other.heading_rad
    return one.distance_m(other) < within and abs(math.sin(turn / 2)) < within


@given(st.lists(pauses, max_size=10))
def test_without_a_command_a_robot_is_believed_where_it_was(waits: list[float]) -> None:
    robot = DeadReckoning(BEGIN)
    for at_s in waits:
        believed = robot.believe(at_s)
        assert (believed.pose, believed.spread_m, believed.spread_rad) == (HERE, 0.02, 0.03)


@given(speeds, st.floats(0, 100))
def test_a_motion_lasts_until_robots_end_it_by_themselves(speed: tuple[float, float], later_s: float) -> None:
    forward_m_s, turn_rad_s = speed
    robot = DeadReckoning(BEGIN)
    robot.moves(forward_m_s, turn_rad_s, 1.0)
    end = HERE.moved(forward_m_s * COMMAND_TIMEOUT_S, turn_rad_s * COMMAND_TIMEOUT_S)
    assert are_near(robot.believe(1.0 + COMMAND_TIMEOUT_S + later_s).pose, end)
    assert not robot.is_moving


def test_forward_is_along_the_heading_and_a_full_turn_leads_back() -> None:
    robot = DeadReckoning(Belief(FloorPose(0, 0, math.pi / 2), 0.0, 0.0, 0.0))
    robot.moves(0.2, 0.0, 0.0)
    robot.moves(0.0, 0.0, 0.4)
    assert are_near(robot.believe(2.0).pose, FloorPose(0, 0.08, math.pi / 2))
    for tick in range(40):
        robot.moves(0.3, 2 * math.pi / 4.0, 3.0 + 0.1 * tick)
    robot.moves(0.0, 0.0, 7.0)
    assert are_near(robot.believe(9.0).pose, FloorPose(0, 0.08, math.pi / 2))


@given(st.floats(-3, 3), st.floats(0, 0.5), st.floats(0, 0.4))
def test_a_turn_to_the_left_and_one_to_the_right_are_mirror_images(turn: float, lasts_s: float, forward: float) -> None:
    ends = []
    for sign in (1, -1):
        robot = DeadReckoning(Belief(FloorPose(0, 0, 0), 0.0, 0.0, 0.0))
        robot.moves(forward, sign * turn, 0.0)
        robot.moves(0.0, 0.0, lasts_s)
        ends.append(robot.believe(5.0))
    left, right = ends
    assert are_near(left.pose, FloorPose(right.pose.x_m, -right.pose.y_m, -right.pose.heading_rad))
    assert (left.spread_m, left.spread_rad) == (right.spread_m, right.spread_rad)


@given(unsighted)
def test_without_a_sighting_the_spread_never_shrinks(events: list[tuple[float, Event]]) -> None:
    robot, at_s, before = DeadReckoning(BEGIN), 0.0, BEGIN
    for pause_s, event in events:
        at_s += pause_s
        for now in (robot.believe(at_s), event(robot, at_s) or robot.believe(at_s)):
            assert now.spread_m >= before.spread_m
            assert now.spread_rad >= before.spread_rad
            before = now


@given(unsighted, speeds, st.booleans())
def test_a_way_a_turn_and_a_jump_make_the_spread_larger(
    events: list[tuple[float, Event]], speed: tuple[float, float], is_jump: bool
) -> None:
    robot = DeadReckoning(BEGIN)
    at_s = played(robot, events) + 1.0
    before = robot.believe(at_s)
    if is_jump:
        robot.jumps(at_s)
    else:
        robot.moves(*speed, at_s)
    after = robot.believe(at_s + 1.0)
    assert after.spread_m > before.spread_m or abs(speed[0]) < 1e-9
    assert after.spread_rad > before.spread_rad or max(map(abs, speed)) < 1e-9 or before.spread_rad == math.pi


@given(unsighted, poses, st.floats(0, 0.2), st.floats(0, 0.1))
def test_a_sighting_brings_the_robot_to_where_the_landmark_shows_it(
    events: list[tuple[float, Event]], pose: FloorPose, spread_m: float, spread_rad: float
) -> None:
    robot = DeadReckoning(BEGIN)
    at_s = played(robot, events)
    robot.sighted(pose, spread_m, spread_rad, at_s)
    believed = robot.believe(at_s)
    assert are_near(believed.pose, pose)
    assert (believed.spread_m, believed.spread_rad, believed.source) == (spread_m, spread_rad, PoseSource.LANDMARK)


@given(poses, speeds, st.floats(0.01, 0.4))
def test_a_sighting_of_a_moment_ago_is_carried_on_by_the_motion_since(
    pose: FloorPose, speed: tuple[float, float], ago_s: float
) -> None:
    early, late = DeadReckoning(BEGIN), DeadReckoning(BEGIN)
    for robot in (early, late):
        robot.moves(*speed, 1.0)
    early.sighted(pose, 0.05, 0.05, 1.0)
    late.believe(1.0 + ago_s)
    late.sighted(pose, 0.05, 0.05, 1.0)
    assert are_near(late.believe(1.0 + ago_s).pose, early.believe(1.0 + ago_s).pose)


def test_a_sighting_of_long_ago_changes_nothing() -> None:
    robot = DeadReckoning(BEGIN)
    robot.believe(10.0)
    robot.sighted(FloorPose(7, 7, 0), 0.01, 0.01, 10.0 - REMEMBERED_S - 0.01)
    assert robot.believe(10.0).pose == HERE


@given(unsighted)
def test_a_robot_that_moves_on_rests_on_reckoning_again(events: list[tuple[float, Event]]) -> None:
    robot = DeadReckoning(BEGIN)
    at_s = played(robot, events)
    robot.sighted(HERE, 0.05, 0.05, at_s)
    robot.moves(0.2, 0.0, at_s + 3.0)
    assert robot.believe(at_s + 4.0).source is PoseSource.DEAD_RECKONING


@given(st.lists(st.tuples(st.floats(-0.2, 0.2), st.floats(-1, 1)), min_size=1, max_size=12), unsighted)
def test_a_robots_own_count_replaces_the_commanded_way(
    steps: list[tuple[float, float]], commands: list[tuple[float, Event]]
) -> None:
    """Whatever was commanded in between, the pose follows the counts."""
    robot = DeadReckoning(BEGIN)
    way_m = turned_rad = at_s = 0.0
    robot.counts(way_m, turned_rad, at_s)
    expected = HERE
    for number, step in enumerate(steps):
        at_s += 0.5
        if number < len(commands) and number % 2:
            robot.moves(0.3, 1.0, at_s - 0.2)
        way_m, turned_rad = way_m + step[0], turned_rad + step[1]
        robot.counts(way_m, turned_rad, at_s)
        expected = expected.moved(*step)
    assert are_near(robot.believe(at_s).pose, expected)


def test_a_first_count_of_less_than_was_commanded_has_counted_since_the_begin() -> None:
    """A robot that starts slowly, and whose first answer comes late."""
    slow, other = DeadReckoning(BEGIN), DeadReckoning(BEGIN)
    for robot in (slow, other):
        robot.moves(0.2, 0.4, 0.0)
    slow.counts(0.03, 0.1, 0.5)
    assert are_near(slow.believe(0.5).pose, HERE.moved(0.03, 0.1))
    other.counts(7.03, 0.1, 0.5)
    assert are_near(other.believe(0.5).pose, HERE.moved(0.1, 0.2))


def test_a_count_that_begins_anew_moves_nothing() -> None:
    robot = DeadReckoning(BEGIN)
    robot.counts(500.0, 3.0, 1.0)
    robot.counts(0.0, 0.0, 1.5)
    assert robot.believe(2.0).pose == HERE
    robot.counts(0.1, 0.0, 2.0)
    assert are_near(robot.believe(2.0).pose, HERE.moved(0.1, 0.0))


@pytest.mark.parametrize("pause_s", [0.5, 3.0, 60.0])
def test_a_robot_that_counts_from_0_again_after_a_restart_stays_where_it_is(pause_s: float) -> None:
    """A walker whose RC, which counts its way, is restarted in the middle of a walk."""
    robot, way_m = DeadReckoning(BEGIN), 0.0
    for number in range(1, 11):
        robot.moves(0.3, 0.0, 0.5 * (number - 1))
        way_m = 0.15 * number
        robot.counts(way_m, 0.0, 0.5 * number)
    again_s = 5.0 + pause_s
    robot.counts(0.0, 0.0, again_s)
    assert are_near(robot.believe(again_s).pose, HERE.moved(way_m, 0.0))
    robot.moves(0.2, 0.0, again_s)
    robot.counts(0.1, 0.0, again_s + 0.5)
    assert are_near(robot.believe(again_s + 0.5).pose, HERE.moved(way_m + 0.1, 0.0))


def test_a_robot_that_backs_to_where_it_began_to_count_is_there() -> None:
    robot = DeadReckoning(BEGIN)
    for at_s, speed_m_s, way_m in ((0.0, 0.8, 0.4), (0.5, 0.8, 0.8), (1.0, -0.8, 0.4), (1.5, -0.8, 0.0)):
        robot.moves(speed_m_s, 0.0, at_s)
        robot.counts(way_m, 0.0, at_s + 0.5)
    assert are_near(robot.believe(2.0).pose, HERE)


@given(st.lists(st.tuples(pauses, hostile), max_size=20))
def test_numbers_that_no_robot_can_have_make_no_pose_that_cannot_be_sent(events: list[tuple[float, Event]]) -> None:
    robot = DeadReckoning(BEGIN)
    at_s = played(robot, [(pause_s, event) for pause_s, event in events])
    now = robot.believe(at_s)
    at, spread = now.pose, now.spread_rad
    pose = Pose("a", now.at_s, at.x_m, at.y_m, at.heading_rad, now.source, now.spread_m, spread)
    assert msgspec.convert(msgspec.to_builtins(pose), Pose) == pose
    assert now.at_s <= at_s + 1e-9


@given(st.lists(st.tuples(st.floats(-5, 5), honest_moves), max_size=10))
def test_time_never_runs_backwards(events: list[tuple[float, Event]]) -> None:
    robot, newest_s = DeadReckoning(BEGIN), 0.0
    for at_s, event in events:
        event(robot, at_s)
        newest_s = max(newest_s, at_s)
        assert robot.believe(-9.0).at_s == newest_s


def test_an_error_of_the_heading_becomes_one_of_the_place_and_goes_on_the_way_back() -> None:
    begin = Doubt.of(0.0, 0.1)
    away = begin.moved(3.0, 4.0, 0.0, 0.0)
    assert away.spread_m == pytest.approx(5.0 * 0.1)
    assert away.moved(-3.0, -4.0, 0.0, 0.0).spread_m == pytest.approx(0.0, abs=1e-6)


@given(
    st.floats(0, 1),
    st.floats(0, 1),
    st.lists(st.tuples(st.floats(-2, 2), st.floats(-2, 2), st.floats(0, 3)), max_size=10),
)
def test_a_doubt_stays_one_of_places_and_directions(
    spread_m: float, spread_rad: float, ways: list[tuple[float, float, float]]
) -> None:
    doubt = Doubt.of(spread_m, spread_rad)
    for x_m, y_m, turned_rad in ways:
        before, doubt = doubt, doubt.moved(x_m, y_m, math.hypot(x_m, y_m), turned_rad)
        assert doubt.hh >= before.hh
        assert doubt.xx >= -1e-9
        assert doubt.yy >= -1e-9
        assert doubt.xy**2 <= doubt.xx * doubt.yy + 1e-6
        assert doubt.larger(0.5, 0.1).spread_m > doubt.spread_m


def sight(ahead_m: float, left_m: float, heading_rad: float = 0.0) -> LandmarkSighting:
    return LandmarkSighting(0.0, "scout1", ahead_m, left_m, heading_rad)


def plan(*at: FloorPose) -> FloorPlan:
    return FloorPlan(9.0, 6.0, [board(f"board{number}", one) for number, one in enumerate(at)])


def test_left_of_a_board_is_left_as_seen_by_a_robot_that_faces_it() -> None:
    """The board looks along x, so its watcher looks along -x, with -y at its left."""
    seen = before_board(FloorPose(0.2, 4.5, 0.0), sight(1.5, 0.3, math.pi / 4))
    assert are_near(seen, FloorPose(1.7, 4.2, math.pi + math.pi / 4))


@given(poses, st.floats(0.3, 2.5), st.floats(-1, 1), st.floats(-0.5, 0.5))
def test_the_one_board_of_a_room_is_the_one_that_is_seen(
    at: FloorPose, ahead_m: float, left_m: float, heading_rad: float
) -> None:
    seen = sight(ahead_m, left_m, heading_rad)
    anywhere = Belief(FloorPose(0, 0, 0), 0.0, 100.0, math.pi)
    assert sighted_from(plan(at), seen, anywhere) == before_board(at, seen)
    assert sighted_from(plan(), seen, anywhere) is None


def test_of_two_boards_that_look_alike_the_plainly_nearer_one_is_seen() -> None:
    west, east = FloorPose(0.0, 3.0, 0.0), FloorPose(9.0, 3.0, math.pi)
    seen = sight(1.0, 0.0)
    at_west = Belief(FloorPose(1.2, 3.0, math.pi), 0.0, 0.3, 0.1)
    assert sighted_from(plan(west, east), seen, at_west) == before_board(west, seen)
    between = Belief(FloorPose(4.4, 3.0, math.pi), 0.0, 0.3, 0.1)
    assert sighted_from(plan(west, east), seen, between) is None
    lost = Belief(FloorPose(1.2, 3.0, math.pi), 0.0, 100.0, math.pi)
    assert sighted_from(plan(west, east), seen, lost) is None


def test_places_are_read_in_meters_and_degrees() -> None:
    assert read_begins("scout1:1,2,90  other1:3.5,0") == {
        "scout1": FloorPose(1.0, 2.0, math.pi / 2),
        "other1": FloorPose(3.5, 0.0, 0.0),
    }
    assert read_begins("") == {}


@pytest.mark.parametrize("text", ["scout1", "scout1:1", ":1,2", "scout1:1,nan", "a:1,2,3,4", "a:1,2 a:2,1", "a:x,y"])
def test_what_is_no_place_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"is no place|two places"):
        read_begins(text)
