"""A behavior that shows a picture in color, a grey one and a value, all the time."""

from __future__ import annotations

from typing import Any

import numpy as np
from fake_resource_pool import FakePlacer

from backbone.mission.behavior_orders import behavior_order
from mission_control.behavior import Behavior

BEHAVIOR = "watch1"
SHOWN_EVERY_S = 0.03


class Shower(Behavior[Any]):
    """Counts how often each picture was made."""

    def __init__(self, *arguments: Any) -> None:
        super().__init__(*arguments)
        self.made: dict[str, int] = {}

    async def serve(self) -> None:
        await super().serve()
        self.start_task(self._show(), "show")

    async def _show(self) -> None:
        while True:
            self.views.picture("red", lambda: self._picture("red", np.full((12, 16, 3), (255, 0, 0), np.uint8)))
            self.views.picture("white", lambda: self._picture("white", np.full((12, 16), 255, np.uint8)))
            self.views.value("threshold", 28.0)
            await self.clock.sleep_s(SHOWN_EVERY_S)

    def _picture(self, view: str, picture: Any) -> Any:
        self.made[view] = self.made.get(view, 0) + 1
        return picture


async def shower_at(placer: FakePlacer) -> Shower:
    """Return the behavior, up."""
    placer.classes["shower"] = Shower
    shower: Shower = await placer.launch(
        behavior_order({"type": "shower", "name": BEHAVIOR, "priority": 3}, [("web-test", 10)])
    )
    return shower
