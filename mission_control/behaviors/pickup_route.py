"""Pick-up route: to the neighborhood of the marked place with a localizer, the rest of the way by sight.

Rules of this file: no bus, no clock. Positions and mission time go in, motions come out.
"""

from __future__ import annotations

from enum import StrEnum

from mission_control.behaviors.motion import FloorPoint, Maneuver, Motion, Position, Watchdog, head_for, shake_free

NEAR_M = 0.25  # chosen: the mark is found within 2.5 m, so more precision is useless
AWAY_M = 1.0  # chosen: a robot left further away than this goes to the neighborhood first
PATIENCE_S = 4.0  # chosen: a turn round takes two seconds


class PickupStage(StrEnum):
    """How the robot navigates."""

    UNKNOWN = "asks where it is"
    TRAVEL = "goes to where the mark can be seen"
    BY_SIGHT = "goes by sight"
    FAILED = "did not find the mark"


class PickupRoute:
    """The state of a return.

    Args:
        near: A place from which the mark is in sight.
        speed_m_s: Speed on the way to it.
        attempts: Number of vain searches after which it gives up.
    """

    def __init__(self, near: FloorPoint, *, speed_m_s: float, attempts: int) -> None:
        self._near, self._speed_m_s, self._attempts = near, speed_m_s, attempts
        self._stage = PickupStage.UNKNOWN
        self._in_vain = 0
        self._watchdog = Watchdog(PATIENCE_S)
        self._freeing: Maneuver | None = None

    @property
    def stage(self) -> PickupStage:
        """How the robot navigates."""
        return self._stage

    @property
    def in_vain(self) -> int:
        """Number of vain searches for the mark."""
        return self._in_vain

    def interrupt(self) -> None:
        """Record the loss of the robot; the next decision depends on its position then."""
        if self._stage is not PickupStage.FAILED:
            self._stage = PickupStage.UNKNOWN
        self._freeing = None
        self._watchdog.rest()

    def not_found(self) -> None:
        """Record a vain search all around."""
        self._in_vain += 1
        self._stage = PickupStage.FAILED if self._in_vain >= self._attempts else PickupStage.TRAVEL
        self._watchdog.rest()

    def decide(self, position: Position, now_s: float) -> Motion:
        """Return the next motion; called only in the stages ``UNKNOWN`` and ``TRAVEL``.

        Args:
            now_s: Mission time; it never decreases.
        """
        distance_m = self._near.distance_m(position)
        if self._stage is PickupStage.UNKNOWN:
            self._stage = PickupStage.TRAVEL if distance_m > AWAY_M else PickupStage.BY_SIGHT
        if self._stage is not PickupStage.TRAVEL:
            return Motion()
        if distance_m <= NEAR_M:
            self._stage = PickupStage.BY_SIGHT
            return Motion()
        if self._freeing is None and self._watchdog.is_stuck(distance_m, now_s):
            self._freeing = shake_free()
        if self._freeing is not None:
            motion = self._freeing.motion(now_s)
            if motion is not None:
                return motion
            self._freeing = None
            self._watchdog.rest()
        return head_for(position, self._near, self._speed_m_s)
