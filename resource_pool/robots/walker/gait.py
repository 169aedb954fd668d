"""Gait: computes the foot positions of a trot or a walk from the requested forward and turning speed.

Each foot follows a closed curve. On the floor it moves straight back at the trunk's forward speed (on a circle if the
trunk turns); in the air it returns along a hump. A gait consists of the curve's parameters and the phases of the four
feet.

Rules of this file:

* Feet are positions of the feet's middles in the trunk's frame: x forward, y left, z up, origin between the hips.
* A request never makes a foot jump. Speed and lift change at limited rates, and all curves meet in the standing
  posture, so that start, stop and change are smooth at any phase.
* A foot has the floor's speed when it lifts off and when it touches down.
* While the gait rests, its feet are exactly ``STANDING``.

Source: Hengst, Ibbotson, Pham, Sammut, "Omnidirectional Locomotion for Quadruped Robots", RoboCup 2001: each foot
treads as a wheel would that is steered for the wanted motion; Petters, Thomas, von Stryk, RoboFrame, 2006, section IV:
"parameterized curves for foot and hip trajectories".
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import ClassVar

from backbone.errors import Refusal

LEGS = ("front_left", "front_right", "hind_left", "hind_right")
HIP_X_M = 0.085  # body.xml
TRACK_Y_M = 0.08  # body.xml: shoulder and thigh
STANDING_HEIGHT_M = 0.12  # body.xml: from a hip down to the middle of its foot

Foot = tuple[float, float, float]
Feet = tuple[Foot, Foot, Foot, Foot]

MAX_FORWARD_M_S = 0.3  # measured: at 0.35 one of thirty disturbed walks ended with a fall, here none
MAX_TURN_RAD_S = 1.8  # chosen: the feet then have two thirds of their speed at the forward limit
ACCELERATION_M_S2 = 0.8  # chosen: full speed after one period of the trot
TURN_ACCELERATION_RAD_S2 = 5.0  # chosen: same
RISE_S = 0.25  # chosen: so each foot's first step is lower than its second


class ImpossibleGait(Refusal):
    """A parameter of a gait is outside its range."""

    code = "walker.gait"
    remedy = "Choose each parameter inside its range."


class ImpossibleMove(Refusal):
    """A requested speed is no finite number."""

    code = "walker.move"
    remedy = "Request finite speeds; those beyond the limits are clipped."


@dataclass(frozen=True, slots=True)
class TrunkSpeed:
    """A requested or expected motion of the trunk; turning left is positive."""

    forward_m_s: float = 0.0
    turn_rad_s: float = 0.0


@dataclass(frozen=True, slots=True)
class GaitParameters:
    """Parameters of a gait. The defaults are the best in speed and direction of some 300 gaits that were measured.

    Attributes:
        period_s: Duration of one cycle of a foot.
        duty: Share of the period during which a foot is on the floor.
        lift_m: Height of the hump.
        height_m: From the hips down to the feet on the floor.
        half_length_m: From the trunk's middle forward to the front feet, and back to the hind feet.
        half_width_m: From the trunk's middle to the feet of one side.
        lead_s: Time by which the feet's targets lead the wanted motion on the floor, because servos lag.
        longest_stride_m: Longest way of a foot on the floor; a request that needs more is slowed down.
        sway_m: Amplitude of the hips' sideways swing, once per cycle.
        sway_phase: Phase at which the hips are farthest to the right, 0 to 1.
        phases: Phase at which each of ``LEGS`` touches down, 0 to 1.

    Raises:
        ImpossibleGait: A parameter is outside its range.
    """

    period_s: float = 0.38
    duty: float = 0.65
    lift_m: float = 0.02
    height_m: float = STANDING_HEIGHT_M
    half_length_m: float = HIP_X_M
    half_width_m: float = TRACK_Y_M
    lead_s: float = 0.03
    longest_stride_m: float = 0.09
    sway_m: float = 0.0
    sway_phase: float = 0.0
    phases: tuple[float, float, float, float] = (0.0, 0.5, 0.5, 0.0)

    RANGES: ClassVar[dict[str, tuple[float, float]]] = {
        "period_s": (0.3, 2.0),
        "duty": (0.5, 0.9),
        "lift_m": (0.005, 0.035),
        "height_m": (0.10, 0.12),
        "half_length_m": (0.075, 0.095),
        "half_width_m": (0.07, 0.09),
        "lead_s": (0.0, 0.04),
        "longest_stride_m": (0.01, 0.09),
        "sway_m": (0.0, 0.025),
        "sway_phase": (0.0, 1.0),
    }
    """Limits of each number; within them the legs can reach every foot position."""

    def __post_init__(self) -> None:
        for name, (least, most) in self.RANGES.items():
            value = getattr(self, name)
            if not least <= value <= most:
                raise ImpossibleGait(f"{name} is {value}, not {least} to {most}", parameter=name, value=float(value))
        if not all(0.0 <= phase < 1.0 for phase in self.phases):
            raise ImpossibleGait(f"phases are {self.phases}, not 0 to 1 each")


TROT = GaitParameters()
"""Trot: diagonal legs move together; faster than the walk."""
WALK = GaitParameters(
    period_s=0.8,
    duty=0.82,
    longest_stride_m=0.07,
    sway_m=0.02,
    sway_phase=0.73,
    phases=(0.0, 0.5, 0.75, 0.25),
)
"""One foot in the air at a time: hind left, front left, hind right, front right; the hips over the other three.

This gait is slow and steady.
"""

STANDING: Feet = (
    (HIP_X_M, TRACK_Y_M, -STANDING_HEIGHT_M),
    (HIP_X_M, -TRACK_Y_M, -STANDING_HEIGHT_M),
    (-HIP_X_M, TRACK_Y_M, -STANDING_HEIGHT_M),
    (-HIP_X_M, -TRACK_Y_M, -STANDING_HEIGHT_M),
)
"""The feet of a robot that stands: all joint angles are 0."""


def clip(move: TrunkSpeed, gait: GaitParameters) -> TrunkSpeed:
    """Return the motion that the gait makes for a request: the same curve, slower if the request is too fast.

    Raises:
        ImpossibleMove: A speed is not finite.

    Example:
        >>> clip(TrunkSpeed(1.0, 0.0), TROT)
        TrunkSpeed(forward_m_s=0.3, turn_rad_s=0.0)
    """
    if not (math.isfinite(move.forward_m_s) and math.isfinite(move.turn_rad_s)):
        raise ImpossibleMove(f"a request of {move.forward_m_s} m/s and {move.turn_rad_s} rad/s")
    forward_m_s = max(-MAX_FORWARD_M_S, min(MAX_FORWARD_M_S, move.forward_m_s))
    turn_rad_s = max(-MAX_TURN_RAD_S, min(MAX_TURN_RAD_S, move.turn_rad_s))
    outer_m_s = math.hypot(abs(forward_m_s) + abs(turn_rad_s) * gait.half_width_m, turn_rad_s * gait.half_length_m)
    fastest_m_s = gait.longest_stride_m / (gait.duty * gait.period_s)
    share = min(1.0, fastest_m_s / outer_m_s) if outer_m_s > 0.0 else 1.0
    return TrunkSpeed(forward_m_s * share, turn_rad_s * share)


class Gait:
    """The feet of one walker; at rest at the beginning."""

    def __init__(self, parameters: GaitParameters = TROT) -> None:
        self.parameters = parameters
        self.commanded = TrunkSpeed()
        """The last request, clipped."""
        self.expected = TrunkSpeed()
        """The motion that results from the feet now."""
        self.phase = 0.0
        """Phase of the gait, 0 to 1."""
        self._rise = 0.0

    @property
    def is_resting(self) -> bool:
        """Whether the feet stand still."""
        return self._rise == 0.0 and self.commanded == TrunkSpeed()

    def request(self, move: TrunkSpeed) -> None:
        """Approach this motion from now on.

        Raises:
            ImpossibleMove: A speed is not finite; the last request stays in force.
        """
        self.commanded = clip(move, self.parameters)

    def advance(self, elapsed_s: float) -> Feet:
        """Advance by this time and return the feet.

        Args:
            elapsed_s: Time since the last call, not negative.
        """
        self.expected = TrunkSpeed(
            _approach(self.expected.forward_m_s, self.commanded.forward_m_s, ACCELERATION_M_S2 * elapsed_s),
            _approach(self.expected.turn_rad_s, self.commanded.turn_rad_s, TURN_ACCELERATION_RAD_S2 * elapsed_s),
        )
        is_moving = self.commanded != TrunkSpeed() or self.expected != TrunkSpeed()
        self._rise = _approach(self._rise, float(is_moving), elapsed_s / RISE_S)
        self.phase = (self.phase + elapsed_s / self.parameters.period_s) % 1.0 if self._rise > 0.0 else 0.0
        return self._feet()

    def _feet(self) -> Feet:
        front_left, front_right, hind_left, hind_right = (self._foot(leg) for leg in range(4))
        return front_left, front_right, hind_left, hind_right

    def _foot(self, leg: int) -> Foot:
        if self._rise == 0.0:
            return STANDING[leg]
        gait, stood = self.parameters, STANDING[leg]
        home = (
            math.copysign(gait.half_length_m, stood[0]),
            math.copysign(gait.half_width_m, stood[1]),
            -gait.height_m,
        )
        x_m, y_m, z_m = (still + self._rise * (own - still) for still, own in zip(stood, home, strict=True))
        along, up = _round((self.phase - gait.phases[leg]) % 1.0, gait.duty)
        # The foot is where the floor below its home will be after this time, if the trunk keeps its motion.
        ahead_s = along * gait.duty * gait.period_s - gait.lead_s
        turn_rad = self.expected.turn_rad_s * ahead_s
        chord_m = self.expected.forward_m_s * ahead_s * _chord_of_arc(turn_rad)
        x_m, y_m = (
            x_m * math.cos(turn_rad) - y_m * math.sin(turn_rad) + chord_m * math.cos(turn_rad / 2),
            x_m * math.sin(turn_rad) + y_m * math.cos(turn_rad) + chord_m * math.sin(turn_rad / 2),
        )
        sway_m = gait.sway_m * math.cos(math.tau * (self.phase - gait.sway_phase))
        return x_m, y_m + self._rise * sway_m, z_m + self._rise * gait.lift_m * up


def _approach(value: float, wanted: float, most: float) -> float:
    """Return the value moved towards the wanted one by at most this much."""
    return max(value - most, min(value + most, wanted))


def _chord_of_arc(angle_rad: float) -> float:
    """Return the length of the chord of an arc of length 1 over this angle."""
    return 2.0 * math.sin(angle_rad / 2) / angle_rad if angle_rad else 1.0


def _round(phase: float, duty: float) -> tuple[float, float]:
    """Return a foot's place in its cycle: 0.5 in front to -0.5 behind, and its height, 0 to 1.

    In the air the foot follows the cubic whose speed at both ends equals the speed on the floor.
    """
    if phase < duty:
        return 0.5 - phase / duty, 0.0
    part = (phase - duty) / (1.0 - duty)
    slope = (duty - 1.0) / duty
    smooth = part * part * (3.0 - 2.0 * part)
    along = smooth - 0.5 + slope * part * (1.0 - part) * (1.0 - 2.0 * part)
    return along, math.sin(math.pi * part) ** 2
