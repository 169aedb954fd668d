"""The long updates of a unit with its own thread: shows the present one, and publishes events of begin and end."""

from __future__ import annotations

from collections.abc import Callable

from backbone.component.component import Component
from backbone.component.messages import LogLevel
from backbone.component.recurring import Recurring
from backbone.spoken import counted
from mission_control.modules.execution_unit import Computing
from mission_control.modules.orders import UnitParameters

LONG_UPDATE_S = 5.0  # chosen: longer than a slow planner computes; seconds of the machine
CALM = 4.0  # chosen: a module that is slow in nearly each round is news once; as a multiple of ``LONG_UPDATE_S``


class LongUpdates:
    """Watches the present ``update`` of one unit.

    Args:
        component: Component that runs the unit.
        computing: Returns the present ``update``; None: no module computes.
        changed: Called when ``text`` may have changed.

    Attributes:
        text: The ``update`` that has run for ``LONG_UPDATE_S`` or longer; empty: there is none.
    """

    def __init__(
        self,
        component: Component[UnitParameters],
        computing: Callable[[], Computing | None],
        changed: Callable[[], None],
    ) -> None:
        self._component, self._computing, self._changed = component, computing, changed
        self._long: Computing | None = None
        self.text = ""

    async def watch(self) -> None:
        """Look at the present ``update`` again and again; an event names the module whose ``update`` does not end."""
        clock, recurring = self._component.clock, Recurring(CALM * LONG_UPDATE_S * self._component.clock.rate)
        while True:
            before = self._computing()
            await clock.sleep_s(LONG_UPDATE_S * clock.rate)
            self._seen(before if before is self._computing() else None, recurring, clock.now_s())

    def _seen(self, long: Computing | None, recurring: Recurring, now_s: float) -> None:
        ended, self._long = self._long, long
        if ended is not None and ended is not long:
            recurring.goes(ended.module, now_s)
        self.text = "" if long is None else f"{long.module} computes since {long.round_s:.3f} s"
        if long is not None and long is not ended and recurring.comes(long.module):
            told = f"update does not end; it computes since {long.round_s:.3f} s"
            self._component.publish_event(long.module, told, LogLevel.WARNING)
        for module, count in recurring.over(now_s).items():
            told = f"update ends in time again; it was late {counted(count, 'time')}"
            self._component.publish_event(module, told, LogLevel.NOTICE)
        self._changed()
