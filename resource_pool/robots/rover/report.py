"""The rover's report: its radio reply as single values, one for each gauge."""

from __future__ import annotations

from backbone.ranges import Measure, Meters, Radians, Share
from backbone.wire import Message
from resource_pool.robots.rover.body import TRACK_M
from resource_pool.robots.rover.link import decode_reply

_CM = 0.01


class RoverReport(Message, frozen=True):
    """State of the rover.

    Attributes:
        battery_share: Charge of its battery, 0 to 1.
        closed: How far the paddles are closed, 0 to 1.
        lift: How far the lift is up, 0 to 1.
        is_holding: True if something keeps the paddles from closing further.
        is_blocked: True if a front bumper stopped the rover; back off or turn.
        front_bumper: Pressed.
        left_tip: Bumper at the tip of the left paddle, pressed.
        right_tip: The same of the right paddle.
        rear_bumper: Pressed.
        left_wheel_m: Way of the left wheel since power-on; backward is negative.
        right_wheel_m: Way of the right wheel.
        roll_rad_s: Angular velocity about forward.
        pitch_rad_s: About left.
        yaw_rad_s: About up.
        forward_m_s2: Acceleration forward.
        left_m_s2: Acceleration to the left.
        sonar_0_m: Distance measured by the leftmost sonar; the largest value means this distance or more.
        sonar_1_m: The next one to the right.
        sonar_2_m: The next one to the right.
        sonar_3_m: Nearly straight ahead, on the left.
        sonar_4_m: Nearly straight ahead, on the right.
        sonar_5_m: The next one to the right.
        sonar_6_m: The next one to the right.
        sonar_7_m: The rightmost.
        way_m: Way of the rover's middle since power-on, by wheel odometry; backward is negative.
        turned_rad: Turn since power-on, by wheel odometry; left is positive.
    """

    battery_share: Share
    closed: Share
    lift: Share
    is_holding: bool
    is_blocked: bool
    front_bumper: bool
    left_tip: bool
    right_tip: bool
    rear_bumper: bool
    left_wheel_m: Meters
    right_wheel_m: Meters
    roll_rad_s: Measure
    pitch_rad_s: Measure
    yaw_rad_s: Measure
    forward_m_s2: Measure
    left_m_s2: Measure
    sonar_0_m: Meters
    sonar_1_m: Meters
    sonar_2_m: Meters
    sonar_3_m: Meters
    sonar_4_m: Meters
    sonar_5_m: Meters
    sonar_6_m: Meters
    sonar_7_m: Meters
    way_m: Meters
    turned_rad: Radians


def report_of(payload: bytes) -> RoverReport:
    """Return the report in the rover's reply.

    Raises:
        MalformedPacket: The bytes are not a reply of a rover.
    """
    reply = decode_reply(payload)
    bumpers = reply.bumpers
    way: tuple[float, ...] = ((reply.left_m + reply.right_m) / 2, (reply.right_m - reply.left_m) / TRACK_M)
    return RoverReport(
        reply.battery,
        reply.closed,
        reply.lift,
        reply.is_holding,
        reply.is_blocked,
        bumpers.front,
        bumpers.left_tip,
        bumpers.right_tip,
        bumpers.rear,
        reply.left_m,
        reply.right_m,
        *reply.gyroscope_rad_s,
        *reply.acceleration_m_s2,
        *(_CM * range_cm for range_cm in reply.sonars_cm),
        *way,
    )
