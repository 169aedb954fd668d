"""Laws of motion tracks: which motions arrive does not matter, if the RC can be asked for the others."""

from __future__ import annotations

import math
from functools import partial
from itertools import accumulate

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.dead_reckoning import STILL, Belief, DeadReckoning, FloorPose
from resource_pool.messages import COMMAND_TIMEOUT_S, Applied
from resource_pool.motion_track import UNSEEN_M_S, UNSEEN_RAD_S, Known, MotionTrack
from resource_pool.published_motions import LastMove, Motions

BEGIN_S = 10.0
BEGIN = Known(Belief(FloorPose(1.0, 2.0, 0.5), BEGIN_S, 0.02, 0.03), STILL, 0, BEGIN_S)

speeds = st.tuples(st.floats(-0.4, 0.4), st.floats(-3, 3))
Happening = tuple[float, float] | FloorPose
"""Speeds of a motion, or the pose of a sighting."""
poses = st.builds(FloorPose, st.floats(-5, 5), st.floats(-5, 5), st.floats(-3, 3))
courses = st.lists(st.tuples(st.floats(0.01, 1.0), speeds | poses, st.booleans()), min_size=1, max_size=25)
"""Pause, what happens then, and whether it arrives if it is a motion."""


def moving(number: int, at_s: float, forward_m_s: float = 0.2, turn_rad_s: float = 0.0) -> Applied:
    return Applied("scout1", 7, at_s, "move", {"forward_m_s": forward_m_s, "turn_rad_s": turn_rad_s}, number)


def seen(pose: FloorPose, at_s: float, robot: DeadReckoning) -> None:
    robot.sighted(pose, 0.05, 0.05, at_s)


def play(track: MotionTrack, at_s: float, told: Applied | FloorPose) -> None:
    if isinstance(told, Applied):
        track.moved(told)
    else:
        track.happened(at_s, partial(seen, told, at_s))


def numbered(course: list[tuple[float, Happening, bool]]) -> list[tuple[float, Applied | FloorPose, bool]]:
    """Return time, message and whether it arrives of each happening."""
    played: list[tuple[float, Applied | FloorPose, bool]] = []
    number = 0
    for at_s, (_, what, arrives) in zip(accumulate((one[0] for one in course), initial=BEGIN_S), course, strict=False):
        if isinstance(what, tuple):
            number += 1
            played.append((at_s, moving(number, at_s, *what), arrives))
        else:
            played.append((at_s, what, True))
    return played


def motions_of(course: list[tuple[float, Applied | FloorPose, bool]], since_s: float) -> Motions:
    """Return the answer of the RC."""
    return Motions(0.0, [told for _, told, _ in course if isinstance(told, Applied) and told.at_s >= since_s])


def are_equal(one: Belief, other: Belief) -> bool:
    return (
        one.pose.distance_m(other.pose) < 1e-6
        and math.cos(one.pose.heading_rad - other.pose.heading_rad) > 1 - 1e-9
        and math.isclose(one.spread_m, other.spread_m, abs_tol=1e-6)
        and math.isclose(one.spread_rad, other.spread_rad, abs_tol=1e-6)
    )


@given(courses)
def test_recovered_motions_count_as_if_they_had_arrived(course: list[tuple[float, Happening, bool]]) -> None:
    whole, gappy = MotionTrack(BEGIN), MotionTrack(BEGIN)
    played = numbered(course)
    for at_s, told, arrives in played:
        play(whole, at_s, told)
        if arrives:
            play(gappy, at_s, told)
    gappy.recover(motions_of(played, gappy.last_s))
    assert not gappy.has_gap
    end_s = played[-1][0] + 1.0
    assert are_equal(whole.believe(end_s), gappy.believe(end_s))
    for one in motions_of(played, 0.0).motions:
        gappy.moved(one)  # on their way all the time
    assert are_equal(whole.believe(end_s), gappy.believe(end_s))


@given(courses, st.floats(0, 3), st.floats(0.01, 0.3))
def test_motions_that_arrive_late_count_at_their_own_times(
    course: list[tuple[float, Happening, bool]], late_s: float, looked_at_each_s: float
) -> None:
    """A cut shorter than the link's lease loses nothing: all that waited arrives at once."""
    whole, late = MotionTrack(BEGIN), MotionTrack(BEGIN)
    played = [one for one in numbered(course) if isinstance(one[1], Applied)]
    now_s = BEGIN_S
    for at_s, told, _ in played:
        play(whole, at_s, told)
        while now_s < at_s + late_s:
            now_s += looked_at_each_s
            late.believe(now_s)
        play(late, at_s, told)
    end_s = max(now_s, whole.last_s) + 1.0
    one, other = whole.believe(end_s), late.believe(end_s)
    assert one.pose.distance_m(other.pose) < 1e-6
    assert math.cos(one.pose.heading_rad - other.pose.heading_rad) > 1 - 1e-9


@given(courses, st.integers(0, 24), st.floats(0, 5))
def test_a_track_that_ends_anywhere_is_continued_by_the_next(
    course: list[tuple[float, Happening, bool]], ends_after: int, later_s: float
) -> None:
    """It may end long after the last motion that it took: a host that is cut off takes none."""
    whole, former = MotionTrack(BEGIN), MotionTrack(BEGIN)
    played = [one for one in numbered(course) if isinstance(one[1], Applied)]
    for number, (at_s, told, _) in enumerate(played):
        play(whole, at_s, told)
        if number < ends_after:
            play(former, at_s, told)
    former.believe(former.last_s + later_s)
    saved = msgspec.msgpack.encode(former.known)
    nxt = MotionTrack(msgspec.msgpack.decode(saved, type=Known))
    nxt.recover(motions_of(played, nxt.last_s))
    end_s = BEGIN_S + 30.0
    one, other = whole.believe(end_s), nxt.believe(end_s)
    assert one.pose.distance_m(other.pose) < 1e-6
    assert math.cos(one.pose.heading_rad - other.pose.heading_rad) > 1 - 1e-9


@given(courses)
def test_motions_that_nobody_has_make_the_spread_larger(course: list[tuple[float, Happening, bool]]) -> None:
    track, known_s = MotionTrack(BEGIN), BEGIN_S
    for at_s, told, arrives in numbered(course):
        if arrives:
            play(track, at_s, told)
            if track.has_gap:
                track.give_up()
                after = track.believe(at_s)
                assert after.spread_m >= UNSEEN_M_S * (at_s - known_s) - 1e-9
                assert after.spread_rad >= min(math.pi, UNSEEN_RAD_S * (at_s - known_s)) - 1e-9
            known_s = at_s
    assert not track.has_gap


def test_later_motions_wait_for_the_lost_ones() -> None:
    track = MotionTrack(BEGIN)
    track.moved(moving(1, 11.0))
    track.moved(moving(3, 11.2))
    track.moved(moving(4, 11.3))
    assert (track.has_gap, track.last_s) == (True, 11.0)
    track.recover(Motions(0.0, [moving(1, 11.0), moving(2, 11.1, 0.0, 1.0), moving(3, 11.2)]))
    assert (track.has_gap, track.last_s) == (False, 11.3)


def test_a_motion_that_is_lost_while_others_are_recovered_leaves_a_gap() -> None:
    track = MotionTrack(BEGIN)
    track.moved(moving(1, 11.0))
    track.moved(moving(3, 11.2))
    track.moved(moving(5, 11.4))
    track.recover(Motions(0.0, [moving(1, 11.0), moving(2, 11.1), moving(3, 11.2)]))
    assert (track.has_gap, track.last_s) == (True, 11.2)


def test_a_restarted_rc_counts_from_1_again() -> None:
    track = MotionTrack(BEGIN)
    for number in (1, 2):
        track.moved(moving(number, 11.0 + number / 10))
    before = track.believe(12.0)
    track.moved(moving(1, 12.0))
    track.moved(moving(2, 12.1))
    assert not track.has_gap
    assert track.believe(12.0).spread_m < before.spread_m + 0.01


@pytest.mark.parametrize("first", [1, 57])
def test_a_time_between_two_processes_of_the_rc_is_unknown_if_motions_were_lost(first: int) -> None:
    track = MotionTrack(msgspec.structs.replace(BEGIN, number=8))
    track.moved(moving(9, 11.0))
    track.moved(moving(first + 1, 14.1))
    assert track.has_gap
    track.recover(Motions(13.0, [moving(first, 14.0), moving(first + 1, 14.1)]))
    unseen_s = 2.0 if first == 1 else 3.0
    assert (track.has_gap, track.last_s) == (False, 14.1)
    assert UNSEEN_M_S * unseen_s <= track.believe(14.1).spread_m < UNSEEN_M_S * unseen_s + 0.05


@pytest.mark.parametrize(
    ("left_s", "unseen_s"), [(11.05, 0.05), (13.0, 2.0), (30.0, 0.0)], ids=["it fell", "it was cut off", "at rest"]
)
def test_the_unknown_time_ends_when_the_former_process_left(left_s: float, unseen_s: float) -> None:
    for lost in ([], [moving(1, 41.0, 0.0)]):
        track = MotionTrack(msgspec.structs.replace(BEGIN, number=8))
        track.moved(moving(9, 11.0, 0.0))
        track.rc_left(left_s)
        track.recover(Motions(40.0, lost))
        assert not track.has_gap
        assert track.believe(42.0).spread_m == pytest.approx(math.hypot(0.02, UNSEEN_M_S * unseen_s))


@pytest.mark.parametrize(
    ("before", "unseen_s"),
    [
        (LastMove(5.0, 11.0), 0.0),
        (LastMove(5.0), 0.0),
        (LastMove(5.0, 11.1), 0.1 + 2 * COMMAND_TIMEOUT_S),
        (LastMove(5.0, 12.9), 2.0),
        (LastMove(11.5), 2.0),
        (None, 2.0),
    ],
    ids=["the last motion was heard", "none", "one was not heard", "long after", "the radio is new", "not known"],
)
def test_the_unknown_time_ends_with_the_last_packet_that_moves_it(before: LastMove | None, unseen_s: float) -> None:
    track = MotionTrack(msgspec.structs.replace(BEGIN, number=8))
    track.moved(moving(9, 11.0, 0.0))
    track.rc_left(13.0)
    track.recover(Motions(40.0, [], before))
    assert track.believe(42.0).spread_m == pytest.approx(math.hypot(0.02, UNSEEN_M_S * unseen_s))
    track.moved(moving(1, 43.0, 0.0))
    assert not track.has_gap


def test_one_whose_link_was_cut_does_not_know_when_the_former_process_left() -> None:
    track = MotionTrack(msgspec.structs.replace(BEGIN, number=8))
    track.moved(moving(9, 11.0, 0.0))
    track.rc_left(30.0)
    track.was_deaf()
    track.recover(Motions(40.0, []))
    assert track.believe(42.0).spread_m == pytest.approx(math.hypot(0.02, UNSEEN_M_S * 29.0))


def test_a_restarted_rc_without_a_motion_means_that_none_is_lost_after_its_begin() -> None:
    track = MotionTrack(BEGIN)
    track.moved(moving(5, 11.0))
    track.give_up()
    track.recover(Motions(11.5, []))
    spread_m = track.believe(12.0).spread_m
    track.recover(Motions(11.5, []))
    track.moved(moving(1, 12.0, 0.0))
    assert not track.has_gap
    assert track.believe(12.0).spread_m == spread_m


def test_motions_without_numbers_are_taken_as_they_come() -> None:
    track = MotionTrack(BEGIN)
    for at_s in (11.0, 11.1, 11.2):
        track.moved(moving(0, at_s))
    assert (track.has_gap, track.last_s) == (False, 11.2)
