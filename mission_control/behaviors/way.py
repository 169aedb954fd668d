"""Way: drive to one place, and detect that the robot does not get there; keep a distance from a followed body.

Rules of this file: no bus, no clock. Positions and mission time go in, motions come out.
"""

from __future__ import annotations

import math

from mission_control.behaviors.motion import (
    MOST_RAD_S,
    SLOW_PER_S,
    STILL,
    TURN_FIRST_RAD,
    TURN_PER_S,
    FloorPoint,
    Motion,
    Position,
)
from mission_control.behaviors.patrol_route import LONGEST_STEP_S, PatrolRoute

ATTEMPTS = 3  # chosen: a robot that three shakes do not free is not freed by a fourth
GAIN_M = 0.1  # chosen: if the robot is nearer by its length than at the last shake, it makes progress
FACING_RAD = math.radians(10.0)  # chosen: any camera of the follower then has the followed body in view


class Way:
    """The state of a way to one place.

    Args:
        reached_within_m: Distance that counts as reached.
        within_s: Time after which it fails; only time of grants counts; 0: never.
    """

    def __init__(self, place: FloorPoint, *, speed_m_s: float, reached_within_m: float, within_s: float) -> None:
        self.place = place
        """The goal."""
        self.failure = ""
        """Why the robot does not get there, for people; empty: no failure so far."""
        self._route = PatrolRoute([place], rounds=1, speed_m_s=speed_m_s, reached_within_m=reached_within_m, rest_s=0.0)
        self._within_s = within_s
        self._driven_s = 0.0
        self._decided_s: float | None = None
        self._freed = self._in_vain = 0
        self._stuck_m = math.inf
        self._last: FloorPoint | None = None

    @property
    def is_there(self) -> bool:
        """True once the place was reached; stays True."""
        return self._route.is_over

    @property
    def is_over(self) -> bool:
        """True once the place was reached, or the way has failed."""
        return self.is_there or bool(self.failure)

    def interrupt(self) -> None:
        """Record the loss of the robot; the next decision continues from its position then."""
        self._decided_s = None
        self._route.interrupt()

    def decide(self, position: Position, now_s: float) -> Motion:
        """Return the next motion; no motion once the way is over.

        Args:
            now_s: Mission time; it never decreases.
        """
        if self.is_over:
            return STILL
        if self._decided_s is None and self._last is not None and self._last.distance_m(position) > GAIN_M:
            self._in_vain, self._stuck_m = 0, math.inf  # a person has moved it: the earlier shakes say nothing here
        self._last = FloorPoint(position.x_m, position.y_m)
        passed_s = 0.0 if self._decided_s is None else min(now_s - self._decided_s, LONGEST_STEP_S)
        self._driven_s, self._decided_s = self._driven_s + passed_s, now_s
        motion = self._route.decide(position, now_s)
        if self.is_there:
            return STILL
        left_m = self.place.distance_m(position)
        if self._route.freed > self._freed:
            self._freed = self._route.freed
            self._in_vain = 1 if left_m < self._stuck_m - GAIN_M else self._in_vain + 1
            self._stuck_m = min(self._stuck_m, left_m)
        if self._in_vain > ATTEMPTS:
            self.failure = f"it gets no nearer: {left_m:.2f} m are left, and {ATTEMPTS} shakes did not free it"
        elif self._within_s and self._driven_s >= self._within_s:
            self.failure = f"{left_m:.2f} m are left after {self._within_s:g} s"
        return STILL if self.failure else motion


def keep_distance(
    position: Position, target: FloorPoint, distance_m: float, *, speed_m_s: float, tolerance_m: float
) -> Motion:
    """Return the motion that brings the robot to this distance from the target, facing it, and keeps it there.

    It turns on the spot while the target is far from straight ahead, goes forward if it is too far away and backward if
    it is too near.

    Args:
        speed_m_s: Fastest speed.
        tolerance_m: Tolerance; the robot stands still while the distance is within it and the target is ahead.
    """
    off_m, bearing_rad = target.distance_m(position) - distance_m, target.bearing_rad(position)
    is_near = abs(off_m) <= tolerance_m
    if is_near and abs(bearing_rad) <= FACING_RAD:
        return STILL
    turn_rad_s = max(-MOST_RAD_S, min(MOST_RAD_S, TURN_PER_S * bearing_rad))
    if is_near or abs(bearing_rad) > TURN_FIRST_RAD:
        return Motion(0.0, turn_rad_s)
    forward_m_s = max(-speed_m_s, min(speed_m_s, SLOW_PER_S * off_m)) * math.cos(bearing_rad)
    return Motion(forward_m_s, turn_rad_s)
