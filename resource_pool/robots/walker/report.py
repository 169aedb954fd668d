"""The walker's report: its radio status and the state of its motion control, as single values."""

from __future__ import annotations

from typing import Any

import msgspec

from backbone.ranges import Meters, Radians, Share, Speed, TurnRate
from resource_pool.robots.walker.gait import LEGS
from resource_pool.robots.walker.link import JOINTS, decode_status
from resource_pool.robots.walker.motion import StateOfMotion

GRIP_SHARE = 0.81  # measured: share of the feet's way that is not lost by slip, in a trot on the simulated floor


class WalkerReport(msgspec.Struct, frozen=True):
    """State of the walker.

    Attributes:
        battery_share: Charge of its battery, 0 to 1.
        roll_rad: Tilt to the right.
        pitch_rad: Tilt forward, nose down.
        turn_rad_s: Measured turning speed, left is positive.
        phase: Phase of the gait, 0 to 1.
        commanded_m_s: Forward speed of the last command, clipped.
        commanded_rad_s: Turning speed of the last command, clipped.
        expected_m_s: Forward speed that results from the feet now.
        expected_rad_s: Turning speed that results from the feet now.
        way_m: Way since the begin of its RC, corrected for slip; backward is negative.
        turned_rad: Turn since the begin of its RC; left is positive.
        front_left_foot: True if the foot carries weight.
        front_right_foot: Same.
        hind_left_foot: Same.
        hind_right_foot: Same.
        front_left_abduction_rad: Measured angle; all angles are 0 while the walker stands.
        front_left_hip_rad: Measured angle.
        front_left_knee_rad: Measured angle.
        front_right_abduction_rad: Measured angle.
        front_right_hip_rad: Measured angle.
        front_right_knee_rad: Measured angle.
        hind_left_abduction_rad: Measured angle.
        hind_left_hip_rad: Measured angle.
        hind_left_knee_rad: Measured angle.
        hind_right_abduction_rad: Measured angle.
        hind_right_hip_rad: Measured angle.
        hind_right_knee_rad: Measured angle.
    """

    battery_share: Share
    roll_rad: Radians
    pitch_rad: Radians
    turn_rad_s: TurnRate
    phase: Share
    commanded_m_s: Speed
    commanded_rad_s: TurnRate
    expected_m_s: Speed
    expected_rad_s: TurnRate
    way_m: Meters
    turned_rad: Radians
    front_left_foot: bool
    front_right_foot: bool
    hind_left_foot: bool
    hind_right_foot: bool
    front_left_abduction_rad: Radians
    front_left_hip_rad: Radians
    front_left_knee_rad: Radians
    front_right_abduction_rad: Radians
    front_right_hip_rad: Radians
    front_right_knee_rad: Radians
    hind_left_abduction_rad: Radians
    hind_left_hip_rad: Radians
    hind_left_knee_rad: Radians
    hind_right_abduction_rad: Radians
    hind_right_hip_rad: Radians
    hind_right_knee_rad: Radians


def report_of(payload: bytes, motion: StateOfMotion) -> WalkerReport:
    """Return the status in the walker's reply, with the motion control's state at this time.

    Raises:
        MalformedPacket: The bytes are not a status.
    """
    status = decode_status(payload)
    feet = {f"{leg}_foot": on_floor for leg, on_floor in zip(LEGS, status.on_floor, strict=True)}
    angles = {f"{joint}_rad": angle_rad for joint, angle_rad in zip(JOINTS, status.joints_rad, strict=True)}
    parts: dict[str, Any] = {**feet, **angles}
    return WalkerReport(
        battery_share=status.battery,
        roll_rad=status.roll_rad,
        pitch_rad=status.pitch_rad,
        turn_rad_s=status.turn_rad_s,
        phase=motion.phase,
        commanded_m_s=motion.commanded.forward_m_s,
        commanded_rad_s=motion.commanded.turn_rad_s,
        expected_m_s=motion.expected.forward_m_s,
        expected_rad_s=motion.expected.turn_rad_s,
        way_m=GRIP_SHARE * motion.way_m,
        turned_rad=motion.heading_rad,
        **parts,
    )
