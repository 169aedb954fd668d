"""Laws of the servo law: within its limits, the same on both sides, and it arrives from wherever it may begin."""

from __future__ import annotations

import math

import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from landmark_pictures import polar

from mission_control.vision.servo_law import (
    BEARING_SHARE,
    FOCAL_PX,
    HALF_VIEW_PX,
    HALT,
    SEARCH_TURN_RAD_S,
    SPEED_M_S,
    SPEED_SLEW_M_S2,
    STOP_M,
    TURN_RAD_S,
    TURN_SLEW_RAD_S2,
    Approach,
    SpeedCommand,
    Stage,
    back_off_to_m,
    bearing_limit_rad,
    has_arrived,
    slewed,
    steer,
)
from mission_control.vision.skeleton_tracking import TrackingPhase
from mission_control.vision.target_pose import TargetPose

FRAME_S = 1 / 30
HALF_VIEW_RAD = math.atan(HALF_VIEW_PX / FOCAL_PX)
stages = st.sampled_from(list(Stage))
commands = st.builds(SpeedCommand, st.floats(-SPEED_M_S, SPEED_M_S), st.floats(-TURN_RAD_S, TURN_RAD_S))
places = st.tuples(st.floats(0.3, 2.5), st.floats(-60.0, 60.0), st.floats(-20.0, 20.0))


def at(range_m: float, off_axis_deg: float, bearing_deg: float = 0.0) -> TargetPose:
    return TargetPose(*polar(range_m, off_axis_deg, bearing_deg), 0.0, 0.0, np.eye(4))


class Robot:
    """A robot that obeys its commands and knows its pose while the target is in its view."""

    def __init__(self, pose: TargetPose) -> None:
        self.pose = pose
        self.approach = Approach()
        self.stages: list[Stage] = []
        self.lost = 0

    def step(self) -> SpeedCommand:
        half_target_rad = math.atan(0.08 / max(self.pose.ahead_m, 0.01))
        is_seen = abs(self.pose.bearing_rad) + half_target_rad * math.cos(self.pose.off_axis_rad) < HALF_VIEW_RAD
        self.lost += not is_seen and bool(self.stages) and self.stages[-1] is not Stage.SEARCHING
        phase, pose = (TrackingPhase.TRACKING, self.pose) if is_seen else (TrackingPhase.ACQUIRING, None)
        command = self.approach.step(phase, pose, FRAME_S)
        self.pose = self.pose.moved(command.forward_m_s * FRAME_S, command.turn_rad_s * FRAME_S)
        self.stages.append(self.approach.stage)
        return command

    def run(self, limit_s: float = 120.0) -> None:
        while self.approach.stage is not Stage.ARRIVED and len(self.stages) < limit_s / FRAME_S:
            self.step()


@given(place=places, stage=stages, last=commands, elapsed_s=st.floats(0.0, 0.5))
def test_a_command_is_within_the_limits_and_follows_the_last_without_a_jerk(
    place: tuple[float, float, float], stage: Stage, last: SpeedCommand, elapsed_s: float
) -> None:
    command = steer(at(*place), stage, last, elapsed_s)
    assert abs(command.forward_m_s) <= SPEED_M_S
    assert abs(command.turn_rad_s) <= TURN_RAD_S
    assert abs(command.forward_m_s - last.forward_m_s) <= SPEED_SLEW_M_S2 * elapsed_s + 1e-9
    assert abs(command.turn_rad_s - last.turn_rad_s) <= TURN_SLEW_RAD_S2 * elapsed_s + 1e-9


@given(place=places, stage=stages, last=commands)
def test_on_the_other_side_it_steers_the_other_way(
    place: tuple[float, float, float], stage: Stage, last: SpeedCommand
) -> None:
    range_m, off_axis, bearing = place
    here = steer(at(range_m, off_axis, bearing), stage, last, FRAME_S)
    mirrored = SpeedCommand(last.forward_m_s, -last.turn_rad_s)
    there = steer(at(range_m, -off_axis, -bearing), stage, mirrored, FRAME_S)
    assert there.forward_m_s == pytest.approx(here.forward_m_s, abs=1e-9)
    assert there.turn_rad_s == pytest.approx(-here.turn_rad_s, abs=1e-9)


@given(last=commands, wanted=commands)
def test_a_wanted_command_is_reached_and_kept(last: SpeedCommand, wanted: SpeedCommand) -> None:
    for _ in range(60):
        last = slewed(wanted, last, FRAME_S)
    assert last == wanted


@given(range_m=st.floats(0.2, 3.0))
def test_the_whole_target_stays_in_the_picture_however_near(range_m: float) -> None:
    limit_rad = bearing_limit_rad(range_m)
    assert 0 <= limit_rad <= math.atan(BEARING_SHARE * HALF_VIEW_PX / FOCAL_PX)
    assert FOCAL_PX * (math.tan(limit_rad) + 0.08 / range_m) <= HALF_VIEW_PX or limit_rad == 0


@settings(max_examples=share(25))
@given(range_m=st.floats(0.7, 2.5), off_axis=st.floats(-45.0, 45.0), heading=st.floats(-180.0, 180.0))
def test_from_anywhere_within_two_and_a_half_metres_and_45_degrees_it_arrives(
    range_m: float, off_axis: float, heading: float
) -> None:
    robot = Robot(at(range_m, off_axis, heading))
    robot.run()
    assert robot.approach.stage is Stage.ARRIVED
    assert has_arrived(robot.pose)
    assert math.hypot(robot.pose.left_m, robot.pose.ahead_m - STOP_M) < 0.05
    assert abs(robot.pose.heading_rad) < math.radians(10.0)
    assert robot.lost == 0


def test_far_off_the_line_it_backs_off_and_approaches_again() -> None:
    """RAM 2002, figure 8: forward, rotate, back off, approach again."""
    robot = Robot(at(1.5, 40.0))
    robot.run()
    order = [stage for number, stage in enumerate(robot.stages) if number == 0 or robot.stages[number - 1] is not stage]
    assert order[:5] == [Stage.SEARCHING, Stage.FORWARD, Stage.SETTLING, Stage.BACKING, Stage.FORWARD]
    assert order[-2:] == [Stage.SETTLING, Stage.ARRIVED]
    assert robot.approach.approaches >= 2


def test_on_the_line_it_goes_straight_there() -> None:
    robot = Robot(at(2.0, 0.0))
    robot.run()
    assert Stage.BACKING not in robot.stages
    assert robot.approach.approaches == 1


@given(off_axis=st.floats(2.0, 45.0))
def test_the_further_off_the_line_the_further_it_backs_off(off_axis: float) -> None:
    assert STOP_M < back_off_to_m(at(0.45, off_axis)) <= back_off_to_m(at(0.45, off_axis + 1.0)) <= 1.4


@settings(max_examples=share(15))
@given(
    when=st.lists(st.integers(0, 900), min_size=1, max_size=3),
    turned_rad=st.floats(-2.0, 2.0),
    start=st.integers(0, 40),
)
def test_taken_away_at_any_moment_it_arrives_after_it_is_resumed(
    when: list[int], turned_rad: float, start: int
) -> None:
    robot = Robot(at(1.8, start))
    for frame in range(3600):
        if frame in when:
            robot.pose = robot.pose.moved(0.0, turned_rad)
            robot.approach.resumed()
            robot.stages.clear()
            assert abs(robot.approach.step(TrackingPhase.ACQUIRING, None, 0.0).forward_m_s) == 0.0
        robot.step()
    assert robot.approach.stage is Stage.ARRIVED


def test_a_lost_target_stops_the_robot_and_is_looked_for_where_it_went() -> None:
    approach = Approach()
    for _ in range(20):
        approach.step(TrackingPhase.TRACKING, at(1.5, 10.0, -9.0), FRAME_S)
    assert approach.stage is Stage.FORWARD
    moving = approach.step(TrackingPhase.TRACKING, at(1.5, 10.0, -9.0), FRAME_S)
    stopping = [approach.step(TrackingPhase.SEARCHING, None, FRAME_S) for _ in range(20)]
    assert abs(moving.turn_rad_s) > 0
    assert stopping[-1] == HALT
    assert approach.stage is Stage.FORWARD
    turns = [approach.step(TrackingPhase.ACQUIRING, None, FRAME_S).turn_rad_s for _ in range(60)]
    assert approach.stage is Stage.SEARCHING
    assert min(turns) == -SEARCH_TURN_RAD_S
    assert max(turns) <= 0


def test_a_burst_of_bad_pictures_does_not_start_a_search() -> None:
    approach = Approach()
    for _ in range(20):
        approach.step(TrackingPhase.TRACKING, at(1.5, 10.0), FRAME_S)
    for _ in range(8):
        approach.step(TrackingPhase.SEARCHING, None, FRAME_S)
    assert approach.step(TrackingPhase.TRACKING, at(1.5, 10.0), FRAME_S).forward_m_s >= 0
    assert approach.stage is Stage.FORWARD


def test_without_a_target_it_looks_all_around_standing_still_between_steps() -> None:
    """RAM 2002: it rotates a few degrees and tries again."""
    approach, heading_rad, looked_at = Approach(), 0.0, []
    for _ in range(1200):
        command = approach.step(TrackingPhase.ACQUIRING, None, FRAME_S)
        assert command.forward_m_s == 0.0
        if command == HALT:
            looked_at.append(heading_rad)
        heading_rad += command.turn_rad_s * FRAME_S
    steps = np.diff(np.unique(np.round(looked_at, 3)))
    assert heading_rad > 2 * math.pi
    assert steps.max() < math.radians(20.0)
    assert approach.searched_rad == pytest.approx(heading_rad, rel=0.2)


def test_who_is_stuck_while_backing_off_approaches_again() -> None:
    approach, near = Approach(), at(STOP_M, 20.0)
    for _ in range(12):
        approach.step(TrackingPhase.TRACKING, near, FRAME_S)
    seen = []
    for _ in range(30 * 40):
        approach.step(TrackingPhase.TRACKING, near, FRAME_S)
        seen.append(approach.stage)
    assert Stage.BACKING in seen
    assert Stage.FORWARD in seen[seen.index(Stage.BACKING) :]
