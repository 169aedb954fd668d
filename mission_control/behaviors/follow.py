"""Follow: keep a robot at a distance from another body, facing it; the same localizer must know both.

The robot drives straight towards the body, and backs off if the body comes nearer. The behavior ends only by an order,
or if the localizer no longer knows one of the two.

In mission.xml: an ARC of kind ``drive`` (or more), the localizer's name, and the body's.
"""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from backbone.errors import Refusal
from mission_control.behavior import BehaviorParameters
from mission_control.behaviors.driver import DECIDE_EVERY_S, Driver, Lost
from mission_control.behaviors.motion import DrivingSpeed, FloorPoint, NamedBody, NamedLocalizer
from mission_control.behaviors.way import keep_distance

TOLERANCE_SHARE = 0.1  # chosen: of the distance; with less the robot would move all the time


class FollowsItself(Refusal):
    """The robot should follow itself."""

    code = "follow.itself"
    remedy = "Name another body as the target, or hold another robot."


class FollowParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Parameters of ``Follow``.

    Attributes:
        target: The localizer's name of the body to follow: another robot, or in a simulated room also a person.
        localizer: Component that tracks both: its name if it is in the resource pool, else its address.
        distance_m: Distance to keep between the middles of the two.
        speed_m_s: Fastest speed.
    """

    target: NamedBody
    localizer: NamedLocalizer
    distance_m: Annotated[float, msgspec.Meta(ge=0.2, le=10)] = 0.5
    speed_m_s: DrivingSpeed = 0.2


class Follow(Driver[FollowParameters]):
    """Never ends by itself; fails if the localizer does not know the robot or the target."""

    parameters_type = FollowParameters
    never = Driver.never | {Lost.code}
    away_m = math.inf
    """Distance from the target at the last decision."""

    async def drive_on(self, robot: str) -> None:
        """Decide ten times a second from both positions; see ``Driver.drive_on``."""
        while True:
            given = self.parameters
            if given.target == robot:
                self.give_up(FollowsItself(f"{robot} is the target of {self.name}"))
                return
            self.report(f"{robot} follows {given.target}")
            of_target = await self.locate(given.localizer, given.target)
            position = await self.locate(given.localizer, robot)
            target = FloorPoint(of_target.x_m, of_target.y_m)
            self.away_m = target.distance_m(position)
            tolerance_m = TOLERANCE_SHARE * given.distance_m
            await self.move(
                keep_distance(position, target, given.distance_m, speed_m_s=given.speed_m_s, tolerance_m=tolerance_m)
            )
            await self.clock.sleep_s(DECIDE_EVERY_S)

    def statistics(self) -> dict[str, float]:
        """Return the base's counters, and the distance; negative: not known yet."""
        return {**super().statistics(), "away_m": self.away_m if math.isfinite(self.away_m) else -1.0}
