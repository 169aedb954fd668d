"""Motion: computes a robot's motion from its position and its goal.

Rules of this file: no bus, no clock; times are mission seconds.

Positions are meters and radians in the room's frame, seen from above: x to the right, y up. A heading of 0 is along x;
left turns are positive.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

from msgspec import Meta

from backbone.ranges import LONGEST_MENTION

MOST_M_S = 0.30  # chosen: below the motors' 0.35 m/s, so that a reserve for steering is left
NEAREST_M = 0.02  # chosen: the error of tracking from above and a robot of 11 cm allow no less
MOST_RAD_S = 1.5  # chosen: a quarter turn a second; ten decisions a second turn it 9 degrees at most in between
TURN_PER_S = 2.5  # chosen: an error of heading shrinks to a tenth in a second; ten decisions cause no overshoot
SLOW_PER_S = 1.5  # chosen: the robot slows down over the last 0.2 m before a place and stops without overshoot
FARTHEST_M = 1000.0  # chosen: the largest room
MOST_TIMES = 100_000  # chosen: once a minute for ten weeks
PATIENCE_S = 4.0  # chosen: a turn round takes two seconds
TURN_FIRST_RAD = math.radians(50.0)  # chosen: beyond it a robot turns on the spot, so that its path stays short

DrivingSpeed = Annotated[float, Meta(gt=0, le=MOST_M_S)]
"""A speed on the way, as a parameter."""
Reach = Annotated[float, Meta(ge=NEAREST_M, le=FARTHEST_M)]
"""A distance from a place that counts as reached."""
Coordinate = Annotated[float, Meta(ge=-FARTHEST_M, le=FARTHEST_M)]
"""A place along one side of the room; ``check`` compares those below with the mission's room."""
AlongWidth = Annotated[Coordinate, Meta(extra_json_schema={"along": "width"})]
AlongDepth = Annotated[Coordinate, Meta(extra_json_schema={"along": "depth"})]
Attempts = Annotated[int, Meta(ge=1, le=MOST_TIMES)]
"""A number of attempts."""
Times = Annotated[int, Meta(ge=0, le=MOST_TIMES)]
"""A number of repetitions; 0: endless."""
NamedLocalizer = Annotated[
    str, Meta(min_length=1, max_length=LONGEST_MENTION, extra_json_schema={"names": "localizer"})
]
"""A localizer by its name if it is in the resource pool, else by its address; ``check`` searches for it."""
NamedBody = Annotated[str, Meta(min_length=1, max_length=LONGEST_MENTION, extra_json_schema={"names": "body"})]
"""A body that a localizer tracks; ``check`` searches for it if the project ships the localizer."""


@dataclass(frozen=True, slots=True)
class Position:
    """Position of a robot: meters, and its heading in radians."""

    x_m: float
    y_m: float
    heading_rad: float


@dataclass(frozen=True, slots=True)
class FloorPoint:
    """A place on the floor, meters."""

    x_m: float
    y_m: float

    def distance_m(self, position: Position) -> float:
        """Return the robot's distance from this place."""
        return math.hypot(self.x_m - position.x_m, self.y_m - position.y_m)

    def bearing_rad(self, position: Position) -> float:
        """Return the bearing of this place from the robot: 0 is straight ahead, left is positive, -pi to pi."""
        return turned(math.atan2(self.y_m - position.y_m, self.x_m - position.x_m) - position.heading_rad)


@dataclass(frozen=True, slots=True)
class Motion:
    """Motion of a robot: forward in meters a second, turning in radians a second, left is positive."""

    forward_m_s: float = 0.0
    turn_rad_s: float = 0.0


STILL = Motion()


def read_places(text: str) -> list[FloorPoint]:
    """Return the places in a text like ``1,1 3.5,1``.

    Raises:
        ValueError: The text has no place, or a place is not a pair of numbers.

    Example:
        >>> read_places("1,1 3.5,0.5")
        [FloorPoint(x_m=1.0, y_m=1.0), FloorPoint(x_m=3.5, y_m=0.5)]
    """
    places = []
    for pair in text.split():
        try:
            x_m, y_m = (float(number) for number in pair.split(","))
        except ValueError:
            raise ValueError(f"{pair!r} is no place: write x,y in meters, as in 1,1 3.5,1") from None
        if not (math.isfinite(x_m) and math.isfinite(y_m)):
            raise ValueError(f"{pair!r} is no place: write finite numbers")
        places.append(FloorPoint(x_m, y_m))
    if not places:
        raise ValueError("there is no place: write x,y in meters for each, as in 1,1 3.5,1")
    return places


def turned(angle_rad: float) -> float:
    """Return the angle normalized to -pi to pi."""
    return math.atan2(math.sin(angle_rad), math.cos(angle_rad))


def head_for(position: Position, place: FloorPoint, speed_m_s: float) -> Motion:
    """Return the motion that drives the robot to the place and stops it there.

    It turns on the spot while the place is far from straight ahead, and slows down before it arrives.

    Args:
        speed_m_s: Speed on a straight way, above 0; ``MOST_M_S`` at most.
    """
    bearing_rad = place.bearing_rad(position)
    turn_rad_s = _within(TURN_PER_S * bearing_rad, MOST_RAD_S)
    if abs(bearing_rad) > TURN_FIRST_RAD:
        return Motion(0.0, turn_rad_s)
    fastest_m_s = min(speed_m_s, MOST_M_S, SLOW_PER_S * place.distance_m(position))
    return Motion(fastest_m_s * math.cos(bearing_rad), turn_rad_s)


def turn_to(position: Position, heading_rad: float) -> Motion:
    """Return the motion on the spot that brings the robot to this heading."""
    return Motion(0.0, _within(TURN_PER_S * turned(heading_rad - position.heading_rad), MOST_RAD_S))


class Maneuver:
    """A fixed sequence of motions, from the first call on.

    Args:
        steps: Motions and their durations in seconds.
    """

    def __init__(self, steps: Sequence[tuple[Motion, float]]) -> None:
        self._steps = tuple(steps)
        self._begun_s: float | None = None

    def motion(self, now_s: float) -> Motion | None:
        """Return the motion for this time, None after the last."""
        if self._begun_s is None:
            self._begun_s = now_s
        left_s = now_s - self._begun_s
        for motion, lasts_s in self._steps:
            if left_s < lasts_s:
                return motion
            left_s -= lasts_s
        return None


def shake_free() -> Maneuver:
    """Return the maneuver that frees a stuck robot.

    The robot drives back and forth at full speed. If it lies on its back, its tail throws it upright; if it is stuck at
    an obstacle, it gets away. Measured: one attempt rights the robot after every landing of a jump.
    """
    return Maneuver([(Motion(-0.35), 0.3), (Motion(0.35), 0.3), (STILL, 0.5)])


class Watchdog:
    """Detects a robot that does not get nearer to its goal.

    Args:
        patience_s: Time in which it must get ``STEP_M`` nearer; longer if it drives slowly.
        speed_m_s: Speed at which it is driven, above 0.
    """

    STEP_M = 0.02  # chosen: half a wheel; tracking from above is more accurate

    def __init__(self, patience_s: float, speed_m_s: float = MOST_M_S) -> None:
        self._patience_s = max(patience_s, 2 * self.STEP_M / speed_m_s)
        self.rest()

    def rest(self) -> None:
        """Restart the time, because the goal changed or the robot was not driven to it for a while."""
        self._nearest_m = self._since_s = self._last_m = math.inf
        self._last_s, self._is_paused = -math.inf, False

    def pause(self) -> None:
        """Stop the time until the next decision; it restarts if the robot's distance has changed by then."""
        self._is_paused = True

    def is_stuck(self, distance_m: float, now_s: float) -> bool:
        """Return True if the robot has not come nearer within ``patience_s``; called at every decision."""
        if self._is_paused and abs(distance_m - self._last_m) >= self.STEP_M:
            self.rest()
        elif self._is_paused:
            self._since_s, self._is_paused = self._since_s + now_s - self._last_s, False
        self._last_m, self._last_s = distance_m, now_s
        if distance_m <= self._nearest_m - self.STEP_M:
            self._nearest_m, self._since_s = distance_m, now_s
        return now_s - self._since_s >= self._patience_s


class Pursuit:
    """Drives a robot to goals, and shakes it free when it is stuck.

    Args:
        speed_m_s: Speed on straight ways.
    """

    def __init__(self, speed_m_s: float) -> None:
        self._speed_m_s = speed_m_s
        self._watchdog = Watchdog(PATIENCE_S, speed_m_s)
        self._freeing: Maneuver | None = None
        self.freed = 0
        """Number of times that a stuck robot was shaken free."""

    def rest(self) -> None:
        """Restart the time until the robot counts as stuck; see ``Watchdog.rest``."""
        self._watchdog.rest()

    def interrupt(self) -> None:
        """Record the loss of the robot; the next motion is from its position then."""
        self._freeing = None
        self._watchdog.pause()

    def free(self) -> None:
        """Shake the robot free from the next decision on."""
        self._freeing = shake_free()

    def freeing(self, now_s: float) -> Motion | None:
        """Return the motion that shakes the robot free; None: it is not being shaken."""
        motion = self._freeing.motion(now_s) if self._freeing is not None else None
        if motion is None:
            self._freeing = None
        return motion

    def go(self, goal: FloorPoint, position: Position, now_s: float) -> Motion:
        """Return the motion towards the goal, or the one that frees a stuck robot."""
        if self._freeing is None and self._watchdog.is_stuck(goal.distance_m(position), now_s):
            self.free()
            self._watchdog.rest()
            self.freed += 1
        return self.freeing(now_s) or head_for(position, goal, self._speed_m_s)


def _within(value: float, most: float) -> float:
    return max(-most, min(most, value))
