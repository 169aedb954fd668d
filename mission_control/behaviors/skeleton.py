"""Skeleton: the smallest working behavior. Copy it, rename it, name it in mission.xml.

In mission.xml: a component type ``skeleton`` of class ``mission_control.behaviors.skeleton:Skeleton``,
and a behavior of that type with a priority, its parameters and the ARC it needs.
"""

from __future__ import annotations

from mission_control.behavior import Behavior, BehaviorParameters
from mission_control.messages import BehaviorStatus


class SkeletonParameters(BehaviorParameters, frozen=True, kw_only=True):
    """Own parameters, each with a unit in its name, a default and a line here.

    Attributes:
        turns: Number of turns until success.
        speed_rad_s: Speed of the wheels.
    """

    turns: int = 3
    speed_rad_s: float = 4.0


class Skeleton(Behavior[SkeletonParameters]):
    """Turns on the spot a few times, one second each, then has succeeded."""

    parameters_type = SkeletonParameters
    needs_arc = "drive"
    turned = 0  # survives suspensions, as all state on self does

    async def act(self) -> None:
        """Command the robot: begins with each grant, is cancelled at its end."""
        assert self.arc is not None, "a skeleton needs an ARC that can drive: <arc kind='drive' …/>"  # noqa: S101
        while self.turned < self.parameters.turns:
            self.report(f"turn {self.turned + 1} of {self.parameters.turns}")  # one line for people
            for _tenth in range(10):  # a command expires after half a second, so repeat it
                await self.arc.drive(self.parameters.speed_rad_s, -self.parameters.speed_rad_s)
                await self.clock.sleep_s(0.1)  # mission time; nothing else sleeps
            self.turned += 1
        await self.arc.halt()
        self.finish(BehaviorStatus.SUCCESS, {"turned": self.turned})  # gives the ARC back, reports to the parent
