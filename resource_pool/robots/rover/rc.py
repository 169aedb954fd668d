"""RC of a rover: speeds, gripper, video transmitter.

In the safe state wheels and transmitter are off; the gripper goes on to its last place, and keeps its grip. An
operator's stop also stops the gripper, if an ARC holds the rover.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from backbone.component.abilities import CameraForm
from backbone.ranges import Share
from resource_pool.commands import Command, Halt, Move, SwitchTransmitter, clipped
from resource_pool.drivers.interface import MalformedReply
from resource_pool.drivers.simulated import SimulatedRobotProtocol
from resource_pool.holds import Hold
from resource_pool.rcs.robot import RobotParameters, RobotRc
from resource_pool.robots.rover.body import LIFT_M, LIFT_M_S, TOP_M_S, TOP_RAD_S, WHEEL_RADIUS_M
from resource_pool.robots.rover.link import GripPacket, MovePacket, StopPacket, encode
from resource_pool.robots.rover.report import RoverReport, report_of
from scout_model.dimensions import CAMERA_TILT_RAD, HORIZONTAL_VIEW_RAD
from scout_model.errors import MalformedPacket


class Grip(Command, frozen=True):
    """Move paddles and lift to these positions, and keep them there.

    Attributes:
        closed: How far the paddles are closed, 0 to 1.
        lift: How far the lift is up, 0 to 1.
    """

    closed: Share
    lift: Share

    moves: ClassVar[bool] = True


class RoverProtocol(SimulatedRobotProtocol):
    """Encodes the rover's packets. The mission file names this class as ``protocol`` of the resource."""

    def move(self, forward_m_s: float, turn_rad_s: float) -> bytes:
        """Return the packet for these speeds."""
        return encode(MovePacket(forward_m_s, turn_rad_s))

    def grip(self, closed: float, lift: float) -> bytes:
        """Return the packet for these positions of paddles and lift."""
        return encode(GripPacket(closed, lift))

    def read(self, payload: bytes) -> RoverReport:
        """Decode the rover's reply; see ``ReplyReader``."""
        try:
            return report_of(payload)
        except MalformedPacket as error:
            raise MalformedReply(str(error)) from error


class RoverRc(RobotRc[RobotParameters]):
    """Two wheels and a gripper."""

    commands = Move | Halt | Grip | SwitchTransmitter
    reports = RoverReport
    camera = CameraForm(
        forward_m=0.165, height_m=WHEEL_RADIUS_M + 0.1275, tilt_rad=CAMERA_TILT_RAD, across_rad=HORIZONTAL_VIEW_RAD
    )
    body_class = "resource_pool.robots.rover.body:Rover"
    driver_protocol = RoverProtocol
    moves_on_s = LIFT_M / LIFT_M_S  # the lift is slower than the paddles
    limits: ClassVar[Mapping[str, tuple[float, float]]] = {
        "forward_m_s": (-TOP_M_S, TOP_M_S),
        "turn_rad_s": (-TOP_RAD_S, TOP_RAD_S),
        "closed": (0.0, 1.0),
        "lift": (0.0, 1.0),
    }
    _protocol: RoverProtocol

    def stop_packet(self) -> bytes:
        """Return the packet that stops wheels and gripper."""
        return encode(StopPacket())

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Move, halt, grip, or switch the transmitter."""
        values = clipped(order, self.limits)
        match order:
            case Move():
                await self.move(hold, order, self._protocol.move(**values), is_moving=any(values.values()))
            case Grip():
                await self.move_once(hold, order, self._protocol.grip(**values), "grip", goes_on=True)
            case _:
                return await super().obey(hold, order)
        return values
