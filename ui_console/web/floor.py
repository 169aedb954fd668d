"""The plan of the floor for pages: encoded once for all pages, and again after each change."""

from __future__ import annotations

import asyncio
import base64

from resource_pool.arc_client import FloorPlan
from ui_console.model.map import FloorView
from ui_console.model.views import view_json
from ui_console.web.pictures import plan_jpeg


class FloorSection:
    """The section of the view that has the plan."""

    def __init__(self) -> None:
        self.body = b"null"
        """As JSON."""
        self._plan: FloorPlan | None = None

    async def follow(self, plan: FloorPlan | None) -> None:
        """Set ``body`` to this plan; its picture is encoded in a thread, so that no command waits for it."""
        if plan is not self._plan:
            image = await asyncio.to_thread(plan_jpeg, plan.image) if plan is not None else b""
            self._plan, self.body = plan, _packed(plan, image)


def _packed(plan: FloorPlan | None, image: bytes) -> bytes:
    if plan is None:
        return b"null"
    return view_json(FloorView(plan.width_m, plan.depth_m, plan.shapes, base64.b64encode(image).decode()))
