"""Servo law: speeds of driving and turning that approach the landmark without losing it from the narrow view.

If the robot keeps the target a little beside the middle of its picture, it moves on a curve towards the zero-angle
line: forward with the target on the side towards the line, backward with the target on the other side. So the approach
is forward. If it ends off the line, the robot backs off on such a curve and approaches again. Speeds are limited so
that the picture moves less from frame to frame than the reach of tracking. They change slowly, because a jerk tilts the
camera.

Source: RAM 2002, "Visual Servoing" and figure 8: forward, rotate, back off, approach again, until the
robot is on the zero-angle line that lines it up with the target; a turn that is too fast loses the target.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

from mission_control.vision.skeleton_tracking import TrackingPhase
from mission_control.vision.target_pose import TargetPose

STOP_M = 0.45  # chosen: the nearest place from which the landmark fits into the picture with a margin
SPEED_M_S = 0.20  # chosen: a 2 m approach takes ten seconds
CREEP_M_S = 0.05  # chosen: for the last centimetres
TURN_RAD_S = 0.5  # chosen: moves the picture by 7 pixels a frame, half of what tracking reaches
SPEED_SLEW_M_S2 = 0.6  # measured: more tilts the body so that the picture jumps by 20 pixels
TURN_SLEW_RAD_S2 = 4.5  # measured: same
BEARING_SHARE = 0.62  # measured: of the half view; farther out a disc is lost when the body sways
OFF_AXIS_GAIN = 1.5  # chosen: the angle off the line shrinks with this power of the distance
BEARING_GAIN_HZ = 2.5  # chosen: with 0.1 s from picture to wheel it does not oscillate
STRAIGHT_RAD = math.radians(12.0)  # chosen: with a larger error of the bearing, turn before driving
HALF_VIEW_PX, FOCAL_PX = 160.0, 439.6  # the Scout's camera; a test holds them to target_pose
TARGET_HALF_M = 0.11  # chosen: half the T, and the white that a skeleton and its search need
FARTHEST_BACK_M = 1.4  # chosen: from there one approach corrects ten degrees; farther needs more room
NEAREST_BACK_M = 0.75  # chosen: a shorter way leaves no room to steer
ARRIVED_ASIDE_M, ARRIVED_AHEAD_M = 0.025, 0.02  # chosen: half of the permitted 5 cm
ARRIVED_HEADING_RAD = math.radians(6.0)  # chosen: half of the permitted 10 degrees
ARRIVED_BEARING_RAD = math.radians(2.0)  # chosen: the remaining error is less than a pixel of heading
STEADY_FRAMES = 10  # chosen: a third of a second of still pictures makes a pose reliable
SETTLING_S = 4.0  # chosen: time to turn by 30 degrees, creep 5 cm, and look
BACKING_S = 20.0  # chosen: twice the time of the longest way back; an obstacle may be behind the robot
HOLD_S = 0.8  # chosen: longer than nearly every burst of bad pictures; only after it look elsewhere
LOOK_S = 0.5  # chosen: the body comes to rest, and one clean picture comes between two bad bursts
SEARCH_STEP_RAD = math.radians(15.0)  # chosen: "a few degrees"; two views overlap by more than the target's width
SEARCH_TURN_RAD_S = 0.8  # chosen: the target is not tracked meanwhile


class Stage(StrEnum):
    """Phases of an approach."""

    SEARCHING = "searching"
    FORWARD = "forward"
    BACKING = "backing"
    SETTLING = "settling"
    ARRIVED = "arrived"


@dataclass(frozen=True, slots=True)
class SpeedCommand:
    """Command to the robot until the next one.

    Attributes:
        forward_m_s: Speed of its middle.
        turn_rad_s: Counter-clockwise is positive.
    """

    forward_m_s: float
    turn_rad_s: float


HALT = SpeedCommand(0.0, 0.0)


def _clip(value: float, limit: float) -> float:
    return max(-limit, min(limit, value))


def slewed(wanted: SpeedCommand, last: SpeedCommand, elapsed_s: float) -> SpeedCommand:
    """Return the command nearest to the wanted one that causes no jerk."""
    forward_m_s = last.forward_m_s + _clip(wanted.forward_m_s - last.forward_m_s, SPEED_SLEW_M_S2 * elapsed_s)
    turn_rad_s = last.turn_rad_s + _clip(wanted.turn_rad_s - last.turn_rad_s, TURN_SLEW_RAD_S2 * elapsed_s)
    return SpeedCommand(forward_m_s, turn_rad_s)


def bearing_limit_rad(range_m: float) -> float:
    """Return the largest bearing of the target at which all of it is in the picture, from this distance.

    Example:
        >>> bearing_limit_rad(0.45) < bearing_limit_rad(2.0)
        True
    """
    half_target_px = FOCAL_PX * TARGET_HALF_M / max(range_m, 0.01)
    return math.atan(max(0.0, min(BEARING_SHARE * HALF_VIEW_PX, HALF_VIEW_PX - half_target_px)) / FOCAL_PX)


def steer(pose: TargetPose, stage: Stage, last: SpeedCommand, elapsed_s: float, stop_m: float = STOP_M) -> SpeedCommand:
    """Return the next command.

    Args:
        stage: Stage of the approach; in ``SEARCHING`` and ``ARRIVED`` the robot is brought to rest.
        elapsed_s: Time since then.
        stop_m: Distance of the robot's place from the board.

    Returns:
        Within ``SPEED_M_S`` and ``TURN_RAD_S``, if the last one was, and within the slew limits of it.
    """
    limit_rad = bearing_limit_rad(pose.range_m)
    aside_rad = _clip(OFF_AXIS_GAIN * pose.off_axis_rad, limit_rad)
    to_go_m = pose.ahead_m - stop_m
    match stage:
        case Stage.FORWARD:
            wanted_rad, speed_m_s = aside_rad, max(CREEP_M_S, min(SPEED_M_S, to_go_m))
        case Stage.BACKING:
            wanted_rad, speed_m_s = -aside_rad, -SPEED_M_S
        case Stage.SETTLING:
            wanted_rad, speed_m_s = 0.0, _clip(to_go_m, CREEP_M_S)
        case _:
            return slewed(HALT, last, elapsed_s)
    error_rad = pose.bearing_rad - wanted_rad
    speed_m_s *= max(0.0, 1.0 - abs(error_rad) / STRAIGHT_RAD)
    # Driving past the target changes its bearing; the second term compensates for that.
    turn_rad_s = BEARING_GAIN_HZ * error_rad + speed_m_s * math.sin(pose.bearing_rad) / max(pose.range_m, 0.1)
    return slewed(SpeedCommand(speed_m_s, _clip(turn_rad_s, TURN_RAD_S)), last, elapsed_s)


def has_arrived(pose: TargetPose, stop_m: float = STOP_M) -> bool:
    """Return whether the robot is at its place and faces the board, judged from a picture."""
    return (
        abs(pose.left_m) <= ARRIVED_ASIDE_M
        and abs(pose.ahead_m - stop_m) <= ARRIVED_AHEAD_M
        and abs(pose.heading_rad) <= ARRIVED_HEADING_RAD
        and abs(pose.bearing_rad) <= ARRIVED_BEARING_RAD
    )


def back_off_to_m(pose: TargetPose, stop_m: float = STOP_M) -> float:
    """Return the distance from the board to back off to, so that the way back and the next approach reach the line."""
    slope = math.tan(bearing_limit_rad(pose.range_m))
    needed = 1.5 * abs(pose.off_axis_rad) / (2 * max(slope, 0.05))
    return min(FARTHEST_BACK_M, max(NEAREST_BACK_M, stop_m * math.exp(min(needed, 3.0))))


class Approach:
    """The stages of one approach; time and tracking results go in, commands come out.

    Args:
        stop_m: Distance of the robot's place from the board.
    """

    def __init__(self, stop_m: float = STOP_M) -> None:
        self._stop_m = stop_m
        self.stage = Stage.SEARCHING
        """Phase of the approach."""
        self._next_stage = Stage.FORWARD
        self._last = HALT
        self._side = 1.0
        self._steady_frames = 0
        self._since_s = 0.0
        self._unseen_s = 0.0
        self._back_to_m = FARTHEST_BACK_M
        self.approaches = 0
        self.searched_rad = 0.0

    def resumed(self) -> None:
        """Search the target again; the robot stands still, and may have been moved."""
        self._last = HALT
        self._search()

    def step(self, phase: TrackingPhase, pose: TargetPose | None, elapsed_s: float) -> SpeedCommand:
        """Return the next command.

        Args:
            phase: Phase of the tracker at the last picture.
            pose: Pose of the robot if ``phase`` is ``TRACKING``.
            elapsed_s: Time since the last step.
        """
        self._since_s += elapsed_s
        if phase is not TrackingPhase.TRACKING or pose is None:
            self._last = self._blind(phase, elapsed_s)
            return self._last
        self._unseen_s = 0.0
        self._side = 1.0 if pose.bearing_rad >= 0 else -1.0
        self._count_steady()
        self._advance(pose)
        self._last = steer(pose, self.stage, self._last, elapsed_s, self._stop_m)
        return self._last

    def _blind(self, phase: TrackingPhase, elapsed_s: float) -> SpeedCommand:
        """Stop; after a while without the target, search by turning in steps."""
        self._steady_frames = 0
        self._unseen_s += elapsed_s
        if self.stage is not Stage.SEARCHING:
            if self._unseen_s >= HOLD_S and phase is TrackingPhase.ACQUIRING and self.stage is not Stage.ARRIVED:
                self._search()
            return slewed(HALT, self._last, elapsed_s)
        turning_s = SEARCH_STEP_RAD / SEARCH_TURN_RAD_S
        if self._unseen_s % (LOOK_S + turning_s) < LOOK_S:
            return slewed(HALT, self._last, elapsed_s)
        self.searched_rad += SEARCH_TURN_RAD_S * elapsed_s
        return slewed(SpeedCommand(0.0, self._side * SEARCH_TURN_RAD_S), self._last, elapsed_s)

    def _count_steady(self) -> None:
        is_still = abs(self._last.forward_m_s) < 0.02 and abs(self._last.turn_rad_s) < 0.05
        self._steady_frames = self._steady_frames + 1 if is_still else 0

    def _advance(self, pose: TargetPose) -> None:
        match self.stage:
            case Stage.SEARCHING:
                if self._steady_frames >= STEADY_FRAMES:
                    self.searched_rad = 0.0
                    self._enter(self._next_stage)
            case Stage.FORWARD:
                if pose.ahead_m <= self._stop_m + ARRIVED_AHEAD_M:
                    self.approaches += 1
                    self._enter(Stage.SETTLING)
            case Stage.SETTLING:
                self._settle(pose)
            case Stage.BACKING:
                if pose.ahead_m >= self._back_to_m or self._since_s >= BACKING_S:
                    self._enter(Stage.FORWARD)
            case Stage.ARRIVED:
                return

    def _settle(self, pose: TargetPose) -> None:
        if self._steady_frames >= STEADY_FRAMES and has_arrived(pose, self._stop_m):
            self._enter(Stage.ARRIVED)
        elif self._since_s >= SETTLING_S:
            self._back_to_m = back_off_to_m(pose, self._stop_m)
            self._enter(Stage.BACKING)

    def _search(self) -> None:
        if self.stage in (Stage.FORWARD, Stage.BACKING):
            self._next_stage = self.stage
        elif self.stage is not Stage.SEARCHING:
            self._next_stage = Stage.FORWARD
        self._unseen_s = 0.0
        self._enter(Stage.SEARCHING)

    def _enter(self, stage: Stage) -> None:
        self.stage, self._since_s, self._steady_frames = stage, 0.0, 0
