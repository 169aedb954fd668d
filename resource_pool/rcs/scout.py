"""RC of a Scout: wheel speeds, jump, video transmitter.

Source: IROS 2001, section 2; RAM 2002, "Robots for Surveillance and Reconnaissance".
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import ClassVar

from backbone.component.abilities import CameraForm
from backbone.errors import Refusal
from resource_pool.commands import Command, Drive, Halt, Jump, Move, SwitchTransmitter
from resource_pool.drivers.interface import ScoutProtocol, ScoutReports
from resource_pool.holds import Hold
from resource_pool.rcs.robot import RobotParameters, RobotRc
from scout_model.dimensions import HORIZONTAL_VIEW_RAD, TRACK_M, WHEEL_RADIUS_M, WHEEL_SPEED_LIMIT_RAD_S
from scout_model.scout import motion_of_wheels, wheels_rad_s

MOST_M_S = WHEEL_SPEED_LIMIT_RAD_S * WHEEL_RADIUS_M
MOST_TURN_RAD_S = 2 * MOST_M_S / TRACK_M
REST_TILT_RAD = math.radians(5.5)  # measured: the folded foot lifts the camera, which is built in at 4 degrees


class NotFinite(Refusal):
    """A wheel speed is no finite number."""

    code = "scout.not_finite"
    remedy = "Send finite wheel speeds; those beyond the motor's limit are clipped."


class Scout(RobotRc[RobotParameters]):
    """Two wheels and a spring foot."""

    body_class = "scout_model.scout:Scout"
    driver_protocol = ScoutProtocol
    commands = Move | Drive | Halt | Jump | SwitchTransmitter
    reports = ScoutReports
    camera = CameraForm(
        forward_m=0.019, height_m=WHEEL_RADIUS_M + 0.006, tilt_rad=REST_TILT_RAD, across_rad=HORIZONTAL_VIEW_RAD
    )
    limits: ClassVar[Mapping[str, tuple[float, float]]] = {
        "forward_m_s": (-MOST_M_S, MOST_M_S),
        "turn_rad_s": (-MOST_TURN_RAD_S, MOST_TURN_RAD_S),
        "left_rad_s": (-WHEEL_SPEED_LIMIT_RAD_S, WHEEL_SPEED_LIMIT_RAD_S),
        "right_rad_s": (-WHEEL_SPEED_LIMIT_RAD_S, WHEEL_SPEED_LIMIT_RAD_S),
    }
    _protocol: ScoutProtocol

    async def obey(self, hold: Hold, order: Command) -> Mapping[str, float]:
        """Move, drive, halt, jump, or switch the transmitter."""
        match order:
            case Move(forward_m_s=forward, turn_rad_s=turn):
                return await self._turn_wheels(hold, order, *wheels_rad_s(forward, turn))
            case Drive(left_rad_s=left, right_rad_s=right):
                return await self._turn_wheels(hold, order, left, right)
            case Jump():
                await self.move_once(hold, order, self._protocol.jump(), "jump")
                return {}
            case _:
                return await super().obey(hold, order)

    def motion_of(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """Return the motion that the wheels make; see ``RobotRc``."""
        if "left_rad_s" not in values:
            return {}
        forward_m_s, turn_rad_s = motion_of_wheels(values["left_rad_s"], values["right_rad_s"])
        return {"forward_m_s": forward_m_s, "turn_rad_s": turn_rad_s}

    async def _turn_wheels(self, hold: Hold, order: Command, left: float, right: float) -> Mapping[str, float]:
        if not (math.isfinite(left) and math.isfinite(right)):
            raise NotFinite(f"{self.name}: wheel speeds {left} and {right} rad/s")
        left, right = self._protocol.clip_wheel_speed(left), self._protocol.clip_wheel_speed(right)
        await self.move(hold, order, self._protocol.drive(left, right), is_moving=bool(left or right))
        return {"left_rad_s": left, "right_rad_s": right}
