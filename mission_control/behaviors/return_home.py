"""Return home: drive a robot straight to its first position that the localizer knew.

In mission.xml: as for ``go_to``.
"""

from __future__ import annotations

from mission_control.behaviors.go_to import Goer, WayParameters
from mission_control.behaviors.motion import FloorPoint


class ReturnHome(Goer[WayParameters]):
    """Succeeds at home, from any start; fails if the robot gets no nearer, or is too slow."""

    parameters_type = WayParameters

    async def place(self, robot: str) -> FloorPoint:
        """Ask the localizer for the robot's home; see ``Goer``."""
        return await self.locate_home(self.parameters.localizer, robot)
