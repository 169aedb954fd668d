"""Pick-up route: drive near the marked place with a localizer, and the rest of the way by sight.

Rules of this file: no bus, no clock. Positions and mission time go in, motions come out.
"""

from __future__ import annotations

from enum import StrEnum

from mission_control.behaviors.motion import FloorPoint, Motion, Position, Pursuit

NEAR_M = 0.25  # chosen: the mark is found from within 2.5 m, so more precision is useless
AWAY_M = 1.0  # chosen: from farther away the robot first drives near the place


class PickupStage(StrEnum):
    """How the robot navigates."""

    UNKNOWN = "asks where it is"
    TRAVEL = "goes to where the mark can be seen"
    BY_SIGHT = "goes by sight"
    LOOK = "looks whether the mark is still in sight"
    FAILED = "did not find the mark"


class PickupRoute:
    """The state of a return.

    Args:
        near: A place from which the mark is in sight.
        speed_m_s: Speed on the way to it.
        attempts: Number of unsuccessful searches after which the route gives up.
    """

    def __init__(self, near: FloorPoint, *, speed_m_s: float, attempts: int) -> None:
        self._near, self._attempts = near, attempts
        self.stage = PickupStage.UNKNOWN
        """How the robot navigates."""
        self.in_vain = 0
        """Number of unsuccessful searches for the mark."""
        self._pursuit = Pursuit(speed_m_s)

    def interrupt(self) -> None:
        """Record the loss of the robot; its view decides how it continues, or its position then."""
        if self.stage in (PickupStage.BY_SIGHT, PickupStage.LOOK):
            self.stage = PickupStage.LOOK
        elif self.stage is not PickupStage.FAILED:
            self.stage = PickupStage.UNKNOWN
        self._pursuit.interrupt()

    def looked(self, *, is_seen: bool) -> None:
        """Record whether the mark is still in sight after an interruption; if not, the position decides."""
        self.stage = PickupStage.BY_SIGHT if is_seen else PickupStage.UNKNOWN

    def not_found(self) -> None:
        """Record an unsuccessful search all around."""
        self.in_vain += 1
        self.stage = PickupStage.FAILED if self.in_vain >= self._attempts else PickupStage.TRAVEL
        self._pursuit.rest()

    def decide(self, position: Position, now_s: float) -> Motion:
        """Return the next motion; called only in the stages ``UNKNOWN`` and ``TRAVEL``.

        Args:
            now_s: Mission time; it never decreases.
        """
        distance_m = self._near.distance_m(position)
        if self.stage is PickupStage.UNKNOWN:
            self.stage = PickupStage.TRAVEL if distance_m > AWAY_M else PickupStage.BY_SIGHT
        if self.stage is not PickupStage.TRAVEL:
            return Motion()
        if distance_m <= NEAR_M:
            self.stage = PickupStage.BY_SIGHT
            return Motion()
        return self._pursuit.go(self._near, position, now_s)
