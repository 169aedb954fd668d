"""The claim of a console, derived from its parameters."""

from __future__ import annotations

from typing import Annotated

import msgspec

from backbone.bus.interface import Bus
from backbone.naming import component_of
from resource_pool.arc_client import ROBOT, PathNode, arc_name, claim_parameters
from ui_console.model.profile import Sight

ANY_ROBOT = "any robot"
ANY_CAMERA = {ROBOT: ["camera"]}


class TeleoperationParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of ``Teleoperation``.

    Attributes:
        robot: Robot to claim; empty: any free one with a camera.
        kind: Component type of the ARC; empty: one for the robot, by ``sight``.
        sight: Pictures that the operator needs of the robot.
        priority: Among the consoles and the mission; larger is higher.
        minimum_runtime_s: Shortest useful time, seconds; matters only among ARCs of equal priority.
        away_after_s: Time without an operator's action after which the console releases the robot for useful work;
            machine seconds; 0: never.
    """

    robot: str = ""
    kind: str = ""
    sight: Sight = Sight.PICTURES
    priority: int = 100
    minimum_runtime_s: float = 5.0
    away_after_s: Annotated[float, msgspec.Meta(ge=0)] = 0.0

    def arc(self, bus: Bus) -> str:
        """Return the name of the ARC of the console whose bus this is."""
        return arc_name(bus, self.kind)

    def claim(self, address: str) -> dict[str, object]:
        """Return the parameters of the ARC of the console at this address."""
        return claim_parameters(
            address,
            path=[PathNode(component_of(address), self.priority)],
            minimum_runtime_s=self.minimum_runtime_s,
            wish={ROBOT: self.robot} if self.robot else {},
            features={} if self.robot else ANY_CAMERA,
            console=True,
        )
