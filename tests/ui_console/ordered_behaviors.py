"""A behavior to order in tests: drives ahead for some seconds, then is done, or fails."""

from __future__ import annotations

from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.driver import DECIDE_EVERY_S, Driver
from mission_control.messages import BehaviorStatus


class AheadParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Named as those of ``go_to``.

    Attributes:
        x_m: Seconds to drive; 0: for ever.
        y_m: Below 0: it fails at the end.
        localizer: Not asked.
    """

    x_m: float = 0.0
    y_m: float = 0.0
    localizer: str = ""


class Ahead(Driver[AheadParameters]):
    """Drives straight on while it has the robot."""

    parameters_type = AheadParameters
    driven_s = 0.0

    async def drive_on(self, robot: str) -> None:
        while True:
            if self.parameters.x_m and self.driven_s >= self.parameters.x_m:
                is_done = self.parameters.y_m >= 0
                self.finish(
                    BehaviorStatus.SUCCESS if is_done else BehaviorStatus.FAILURE,
                    {"detail": f"{robot} {'is there' if is_done else 'sees a wall'}"},
                )
                return
            await self.held.move(0.1)
            self.driven_s += DECIDE_EVERY_S
            await self.clock.sleep_s(DECIDE_EVERY_S)
