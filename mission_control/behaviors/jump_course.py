"""Jump course: drive up to an obstacle, jump, check that the robot is over it, drive on.

Rules of this file: no bus, no clock. Positions and mission time go in, motions and jumps come out.

Laws: after a jump the robot gets no command until it has landed and its spring is wound again. Only the robot's
    position counts: if a person carries it to either side of the obstacle, the course continues from there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum, StrEnum, auto

from mission_control.behaviors.motion import FloorPoint, Motion, Position, Pursuit, turn_to, turned

TAKE_OFF_M = 0.20  # measured: a box 30 cm high and 20 cm deep is cleared from 15 to 32 cm before its front
RUN_UP_M = 0.30  # chosen: a straight way before the take-off, so that the robot arrives with the right heading
DEEPEST_M = 0.20  # measured: a jump carries 60 cm far, and 40 cm beyond the front
AT_TAKE_OFF_M = 0.04  # chosen: keeps the robot well within the measured 17 cm
AIMED_RAD = math.radians(4.0)  # chosen: 4 cm aside at the landing
LANDED_AFTER_S = 3.0  # measured: 0.42 s until the kick is over, 0.7 s of flight, and 2.4 s until the spring is wound
BEYOND_M = 0.06  # chosen: half a body length; then no wheel stands on the obstacle
ARRIVED_M = 0.08  # chosen: less than a body


class JumpStage(StrEnum):
    """Stage of a jump."""

    RUN_UP = "goes to its run-up"
    APPROACH = "goes to where it jumps"
    AIM = "turns towards the obstacle"
    AIRBORNE = "jumps"
    ONWARD = "drives on beyond the obstacle"
    OVER = "is over"
    FAILED = "did not get over"


class Act(Enum):
    """An action besides driving."""

    JUMP = auto()
    WAIT = auto()  # no command, not even a halt, because it would cancel the jump


@dataclass(frozen=True, slots=True)
class Obstacle:
    """The obstacle to jump over.

    Attributes:
        front: Point of its near side at which the robot crosses it.
        heading_rad: Direction of the jump.
        depth_m: Its depth in that direction, at most ``DEEPEST_M``.
    """

    front: FloorPoint
    heading_rad: float
    depth_m: float

    def ahead(self, distance_m: float) -> FloorPoint:
        """Return the place at this distance beyond the front; negative: before it."""
        return FloorPoint(
            self.front.x_m + distance_m * math.cos(self.heading_rad),
            self.front.y_m + distance_m * math.sin(self.heading_rad),
        )

    def passed_m(self, position: Position) -> float:
        """Return the robot's distance beyond the front, in the direction of the jump; negative: before it."""
        x_m, y_m = position.x_m - self.front.x_m, position.y_m - self.front.y_m
        return x_m * math.cos(self.heading_rad) + y_m * math.sin(self.heading_rad)


class JumpCourse:
    """The state of a jump over an obstacle.

    Args:
        attempts: Number of jumps after which it gives up.
        speed_m_s: Speed on straight ways.
        onward_m: Distance to drive beyond the obstacle.
    """

    def __init__(self, obstacle: Obstacle, *, attempts: int, speed_m_s: float, onward_m: float) -> None:
        self._obstacle, self._attempts = obstacle, attempts
        self._goal_m = obstacle.depth_m + max(onward_m, BEYOND_M)
        self.stage = JumpStage.RUN_UP
        """The stage of the jump."""
        self.jumps = 0
        """Number of jumps that the robot obeyed."""
        self.jumped_s = -math.inf
        """Time of the last jump; its landing is ``LANDED_AFTER_S`` later."""
        self._is_seen_landing = False
        self._pursuit = Pursuit(speed_m_s)

    @property
    def is_final(self) -> bool:
        """True when the robot is over the obstacle, or the course has failed."""
        return self.stage in (JumpStage.OVER, JumpStage.FAILED)

    def airborne_s(self, now_s: float) -> float:
        """Return the time for which the robot must still get no command, 0: none."""
        return max(0.0, self.jumped_s + LANDED_AFTER_S - now_s)

    def lands_in(self, airborne_s: float, now_s: float) -> None:
        """Give no command for this time, because the robot still jumps."""
        self.jumped_s = now_s + airborne_s - LANDED_AFTER_S

    def interrupt(self) -> None:
        """Record the loss of the robot; the next decision depends only on its position then."""
        self._is_seen_landing = False
        self._pursuit.interrupt()
        if self.stage is not JumpStage.AIRBORNE and not self.is_final:
            self.stage = JumpStage.RUN_UP

    def resume(self, jumps: int, jumped_s: float) -> None:
        """Continue after these jumps of an earlier course."""
        self.jumps, self.jumped_s = jumps, jumped_s
        if jumped_s > -math.inf:
            self._enter(JumpStage.AIRBORNE)

    def jumped(self) -> None:
        """Record that the robot obeyed the last ``Act.JUMP``."""
        self.jumps += 1

    def jumped_already(self, now_s: float) -> None:
        """Record a jump of the robot that this course has not decided."""
        if not self.is_final:
            self._enter(JumpStage.AIRBORNE)
        self.jumped_s, self._is_seen_landing = now_s, False
        self.jumped()

    def decide(self, position: Position, now_s: float) -> Motion | Act:
        """Return the next motion or action.

        Args:
            now_s: Mission time; it never decreases.
        """
        if self.is_final or self.airborne_s(now_s) > 0:
            return Act.WAIT
        if self.stage is JumpStage.AIRBORNE:
            self._land(position)
        if (motion := self._pursuit.freeing(now_s)) is not None:
            return motion
        if self.stage is not JumpStage.ONWARD and self._is_beyond(position):
            self._enter(JumpStage.ONWARD)
        return self._go_on(position, now_s)

    def _go_on(self, position: Position, now_s: float) -> Motion | Act:
        obstacle = self._obstacle
        match self.stage:
            case JumpStage.OVER | JumpStage.FAILED:
                return Act.WAIT
            case JumpStage.ONWARD:
                goal = obstacle.ahead(self._goal_m)
                if obstacle.passed_m(position) >= self._goal_m or goal.distance_m(position) < ARRIVED_M:
                    self._enter(JumpStage.OVER)
                    return Act.WAIT
                return self._pursuit.go(goal, position, now_s)
            case JumpStage.RUN_UP:
                goal = obstacle.ahead(-TAKE_OFF_M - RUN_UP_M)
                if goal.distance_m(position) < ARRIVED_M:
                    self._enter(JumpStage.APPROACH)
                return self._pursuit.go(goal, position, now_s)
            case JumpStage.APPROACH:
                goal = obstacle.ahead(-TAKE_OFF_M)
                if goal.distance_m(position) < AT_TAKE_OFF_M:
                    self._enter(JumpStage.AIM)
                return self._pursuit.go(goal, position, now_s)
            case _:
                if obstacle.ahead(-TAKE_OFF_M).distance_m(position) > 2 * AT_TAKE_OFF_M:
                    self._enter(JumpStage.RUN_UP)
                elif abs(turned(obstacle.heading_rad - position.heading_rad)) < AIMED_RAD:
                    self._enter(JumpStage.AIRBORNE)
                    self.jumped_s, self._is_seen_landing = now_s, True
                    return Act.JUMP
                return turn_to(position, obstacle.heading_rad)

    def _land(self, position: Position) -> None:
        """Judge the jump; a heading that was reversed in the air means that the robot lies on its back."""
        if self._is_seen_landing and abs(turned(position.heading_rad - self._obstacle.heading_rad)) > math.pi / 2:
            self._pursuit.free()
        if self._is_beyond(position):
            self._enter(JumpStage.ONWARD)
        else:
            self._enter(JumpStage.FAILED if self.jumps >= self._attempts else JumpStage.RUN_UP)

    def _is_beyond(self, position: Position) -> bool:
        return self._obstacle.passed_m(position) >= self._obstacle.depth_m + BEYOND_M

    def _enter(self, stage: JumpStage) -> None:
        self.stage = stage
        self._pursuit.rest()
