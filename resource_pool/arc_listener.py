"""What a decision process does at the begin and end of grants."""

from __future__ import annotations

from typing import Protocol

from backbone.errors import Refusal
from resource_pool.messages import Resumed, Suspended, Suspending


class NotMyArc(Refusal):
    """This decision process does not claim the ARC of the notice."""

    code = "arc.not_mine"
    remedy = "Nothing to do: an ARC whose owner does not know it ends by itself."


class ArcListener(Protocol):
    """A decision process's reactions to the begin and end of grants."""

    async def arc_resumed(self, notice: Resumed) -> None:
        """Continue: commands pass from now on."""

    async def arc_suspending(self, notice: Suspending) -> None:
        """Stop cleanly; return after that, within ``notice.deadline_s``."""

    async def arc_suspended(self, notice: Suspended) -> None:
        """Stop sending commands, because the RCs are gone; keep your state."""
