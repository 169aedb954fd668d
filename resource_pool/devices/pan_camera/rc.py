"""RC of a camera on a stand: sends video, and pans if it has a motor."""

from __future__ import annotations

from collections.abc import Mapping
from typing import ClassVar

from backbone.ranges import Radians
from resource_pool.commands import Command, Halt, SwitchTransmitter, clipped
from resource_pool.devices.pan_camera.body import MOST_PAN_RAD, encode_look
from resource_pool.drivers.interface import HardwareFault
from resource_pool.drivers.simulated import SimulatedRobotProtocol
from resource_pool.holds import Hold
from resource_pool.rcs.robot import RobotParameters, RobotRc


class Look(Command, frozen=True):
    """Turn the camera to this angle and keep it there.

    Attributes:
        pan_rad: From straight ahead; to the left is positive.
    """

    pan_rad: Radians

    moves: ClassVar[bool] = True


class PanProtocol(SimulatedRobotProtocol):
    """Encodes the packets of a camera that pans."""

    def look(self, pan_rad: float) -> bytes:
        """Return the packet that turns the camera to this angle."""
        return encode_look(pan_rad)


class FixedProtocol(PanProtocol):
    """Encodes the packets of a fixed camera."""

    def look(self, pan_rad: float) -> bytes:  # noqa: ARG002
        """Refuse to pan."""
        raise HardwareFault(f"{self._site.resource} is fixed", remedy="Command the camera that pans.")


class VideoCamera(RobotRc[RobotParameters]):
    """A camera with transmitter, reached through a command radio like a robot."""

    commands = Look | Halt | SwitchTransmitter
    driver_protocol = PanProtocol
    limits: ClassVar[Mapping[str, tuple[float, float]]] = {"pan_rad": (-MOST_PAN_RAD, MOST_PAN_RAD)}
    _protocol: PanProtocol

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Turn the camera, halt, or switch the transmitter."""
        if not isinstance(order, Look):
            return await super().obey(hold, order)
        values = clipped(order, self.limits)
        await self.move_once(hold, order, self._protocol.look(**values), "look")
        return values
