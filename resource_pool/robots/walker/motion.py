"""Motion control of a walker: a request goes in, joint targets and the state of motion come out.

Pure: no bus, no random numbers, no clock except the argument ``now_s``. The same requests at the same times give the
    same targets.

Source: Petters, Thomas, von Stryk, RoboFrame, 2006, section IV: the MotionControl module executes requests of the
behavior "using inverse kinematics" and "provides information on the robot's current state of motion (e.g. speed,
direction, position of joints)".
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from resource_pool.robots.walker.gait import TROT, Gait, GaitParameters, TrunkSpeed
from resource_pool.robots.walker.kinematics import Kinematics
from resource_pool.robots.walker.link import Angles

STEP_S = 0.02  # chosen: 50 Hz, twenty steps in a period of the trot
LONGEST_STEP_S = 0.1  # chosen: after a delay the control continues from its last phase instead of leaping


@dataclass(frozen=True, slots=True)
class StateOfMotion:
    """State of the motion control, computed without sensors.

    Attributes:
        phase: Phase of the gait, 0 to 1.
        is_resting: Whether the feet stand still.
        commanded: The last request, clipped to the gait's limits.
        expected: The motion that results from the feet now.
        x_m: Way since the beginning by dead reckoning; x is forward at the beginning.
        y_m: Same, to the left.
        heading_rad: Heading relative to the beginning; full turns are counted.
        way_m: Length of that way; backward is negative.
        joints_rad: The last targets.
    """

    phase: float
    is_resting: bool
    commanded: TrunkSpeed
    expected: TrunkSpeed
    x_m: float
    y_m: float
    heading_rad: float
    way_m: float
    joints_rad: Angles


class MotionControl:
    """The motion control of one walker; at rest at the beginning."""

    def __init__(self, parameters: GaitParameters = TROT) -> None:
        self._gait = Gait(parameters)
        self._kinematics = Kinematics()
        self._stepped_s: float | None = None
        self._x_m = self._y_m = self._heading_rad = self._way_m = 0.0
        self._joints_rad: Angles = self._kinematics.joints(self._gait.advance(0.0))

    def request(self, move: TrunkSpeed) -> None:
        """Approach this motion from the next step on.

        Raises:
            ImpossibleMove: A speed is not finite; the last request stays in force.
        """
        self._gait.request(move)

    def rest(self) -> None:
        """Reset to standing, because the board has put the legs down by itself; dead reckoning continues."""
        self._gait = Gait(self._gait.parameters)
        self._stepped_s = None
        self._joints_rad = self._kinematics.joints(self._gait.advance(0.0))

    def step(self, now_s: float) -> Angles:
        """Return the joint targets at this time, in the order of ``JOINTS``.

        Args:
            now_s: Not earlier than the last step's. A gap longer than ``LONGEST_STEP_S`` counts as ``LONGEST_STEP_S``.
        """
        gap_s = 0.0 if self._stepped_s is None else now_s - self._stepped_s
        elapsed_s = max(0.0, min(LONGEST_STEP_S, gap_s))
        self._stepped_s = now_s
        self._joints_rad = self._kinematics.joints(self._gait.advance(elapsed_s))
        motion = self._gait.expected
        middle_rad = self._heading_rad + motion.turn_rad_s * elapsed_s / 2
        self._x_m += motion.forward_m_s * elapsed_s * math.cos(middle_rad)
        self._y_m += motion.forward_m_s * elapsed_s * math.sin(middle_rad)
        self._heading_rad += motion.turn_rad_s * elapsed_s
        self._way_m += motion.forward_m_s * elapsed_s
        return self._joints_rad

    def state(self) -> StateOfMotion:
        """Return the state of motion after the last step."""
        gait = self._gait
        return StateOfMotion(
            gait.phase,
            gait.is_resting,
            gait.commanded,
            gait.expected,
            self._x_m,
            self._y_m,
            self._heading_rad,
            self._way_m,
            self._joints_rad,
        )
