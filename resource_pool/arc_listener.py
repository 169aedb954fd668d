"""Callbacks of a decision process for the begin and end of grants."""

from __future__ import annotations

from typing import Protocol

from backbone.errors import Refusal
from resource_pool.messages import Resumed, Suspended, Suspending


class NotMyArc(Refusal):
    """A notice came from an ARC that this decision process has not claimed."""

    code = "arc.not_mine"
    remedy = "Nothing to do: an ARC whose owner does not know it ends by itself."


class ArcListener(Protocol):
    """Callbacks of a decision process for the begin and end of grants."""

    async def arc_resumed(self, notice: Resumed) -> None:
        """The grant has begun: commands pass from now on."""

    async def arc_suspending(self, notice: Suspending) -> None:
        """The grant is about to end: bring the robot to a clean stop, then return, within ``notice.deadline_s``."""

    async def arc_suspended(self, notice: Suspended) -> None:
        """The grant has ended and the RCs are revoked: send no more commands, but keep your state."""
