"""Pick-up route: to the neighborhood of the marked place by tracking from above, the rest of the way by sight.

Rules of this file: no bus, no clock. Positions and mission time go in, motions come out.
"""

from __future__ import annotations

from enum import StrEnum

from mission_control.behaviors.motion import Maneuver, Motion, Place, Position, Watchdog, head_for, shake_free

NEAR_M = 0.25  # chosen: the mark is found from anywhere within 2.5 m, so nothing is gained by more care
AWAY_M = 1.0  # chosen: a robot left further away than this goes to the neighborhood first
PATIENCE_S = 4.0  # chosen: turning round takes two seconds


class Stage(StrEnum):
    """How the robot finds its way."""

    UNKNOWN = "asks where it is"
    TRAVEL = "goes to where the mark can be seen"
    BY_SIGHT = "goes by sight"
    FAILED = "did not find the mark"


class PickupRoute:
    """The state of a return.

    Args:
        near: From here the mark is in sight.
        speed_m_s: On the way there.
        attempts: After so many searches there in vain it gives up.
    """

    def __init__(self, near: Place, *, speed_m_s: float, attempts: int) -> None:
        self._near, self._speed_m_s, self._attempts = near, speed_m_s, attempts
        self._stage = Stage.UNKNOWN
        self._in_vain = 0
        self._watchdog = Watchdog(PATIENCE_S)
        self._freeing: Maneuver | None = None

    @property
    def stage(self) -> Stage:
        """How the robot finds its way."""
        return self._stage

    @property
    def in_vain(self) -> int:
        """How often the mark was looked for and not found."""
        return self._in_vain

    def interrupt(self) -> None:
        """Note that the robot is not held any more; where it is then says how to go on."""
        if self._stage is not Stage.FAILED:
            self._stage = Stage.UNKNOWN
        self._freeing = None
        self._watchdog.rest()

    def not_found(self) -> None:
        """Note that the mark was looked for all around and not seen."""
        self._in_vain += 1
        self._stage = Stage.FAILED if self._in_vain >= self._attempts else Stage.TRAVEL
        self._watchdog.rest()

    def decide(self, position: Position, now_s: float) -> Motion:
        """Return how to move; asked only while the stage is ``UNKNOWN`` or ``TRAVEL``.

        Args:
            position: Where the robot is now.
            now_s: Mission time, never before an earlier call's.
        """
        distance_m = self._near.distance_m(position)
        if self._stage is Stage.UNKNOWN:
            self._stage = Stage.TRAVEL if distance_m > AWAY_M else Stage.BY_SIGHT
        if self._stage is not Stage.TRAVEL:
            return Motion()
        if distance_m <= NEAR_M:
            self._stage = Stage.BY_SIGHT
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
