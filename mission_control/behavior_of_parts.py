"""The interface of a behavior that its parts need: its ARC, its acting, its reports and its children."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine, Mapping, Sequence
from typing import Protocol

import msgspec

from backbone.component.component_of_parts import ComponentOfParts
from backbone.mission.behavior_nodes import BehaviorNode, PathStep
from mission_control.children import Decision
from mission_control.gated_bus import GatedBus
from mission_control.messages import BehaviorStatus


class BehaviorOfParts(ComponentOfParts, Protocol):
    """A behavior, as its parts see it; see ``BehaviorHooks`` for its decisions."""

    gate: GatedBus
    status: BehaviorStatus
    feedback: str
    payload: dict[str, object]
    child_nodes: dict[str, BehaviorNode]
    """Name of a child → its present node."""

    @property
    def path(self) -> Sequence[PathStep]:
        """Present names and priorities from the mission's root to the behavior."""

    @property
    def parameters(self) -> msgspec.Struct:
        """Its parameters, from the tree and its own."""

    @property
    def rcs(self) -> Mapping[str, str]:
        """Role → name of the granted RCs."""

    @property
    def is_ordered(self) -> bool:
        """True: an operator ordered it."""

    @property
    def suspended_because(self) -> str:
        """Why the behavior is not at work."""

    def begin_task(self, work: Coroutine[object, None, None], name: str) -> asyncio.Task[None] | None:
        """Run work as a task, unless the behavior is ending."""

    def suspension_changed(self) -> None:
        """Called when the reason of its suspension may have changed."""

    def finish(self, status: BehaviorStatus, payload: Mapping[str, object] | None = None) -> None:
        """Finish."""

    async def child_finished(self, child: str, status: BehaviorStatus, payload: Mapping[str, object]) -> Decision:
        """Decide what follows the end of a child."""

    async def children_finished(self, status: BehaviorStatus, payload: Mapping[str, object]) -> None:
        """Conclude after the end of all children."""

    def keep_memory(self) -> None:
        """Keep its state for the next process."""

    def rules_applied(self) -> None:
        """Called after the rules have handled an event."""
