"""RC of a Scout: wheel speeds, jump, video transmitter.

Source: IROS 2001, section 2; RAM 2002, "Robots for Surveillance and Reconnaissance".
"""

from __future__ import annotations

import math
from collections.abc import Mapping

from backbone.errors import Refusal
from resource_pool.commands import Command, Drive, Halt, Jump, SwitchTransmitter
from resource_pool.drivers.interface import ScoutProtocol
from resource_pool.holds import Hold
from resource_pool.rcs.robot import Robot, RobotParameters


class NotFinite(Refusal):
    """A wheel speed is no finite number."""

    code = "scout.not_finite"
    remedy = "Send finite wheel speeds; those beyond the motor's limit are clipped."


class Scout(Robot[RobotParameters]):
    """Two wheels and a spring foot."""

    commands = Drive | Halt | Jump | SwitchTransmitter
    _protocol: ScoutProtocol

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Drive, halt, jump, or switch the transmitter."""
        match order:
            case Drive(left_rad_s=left, right_rad_s=right) if not (math.isfinite(left) and math.isfinite(right)):
                raise NotFinite(f"{self.name}: wheel speeds {left} and {right} rad/s")
            case Drive(left_rad_s=left, right_rad_s=right):
                left, right = self._protocol.clip_wheel_speed(left), self._protocol.clip_wheel_speed(right)
                await self.move(hold, order, self._protocol.drive(left, right), is_moving=bool(left or right))
                return {"left_rad_s": left, "right_rad_s": right}
            case Jump():
                await self.move_once(hold, order, self._protocol.jump(), "jump")
                return {}
            case _:
                return await super().obey(hold, order)
