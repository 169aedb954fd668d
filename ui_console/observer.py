"""A console that only watches: it hears what the mission tells, and claims nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Generic, TypeVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from ui_console.console_events import ConsoleEvent, ScheduleHeard
from ui_console.feed import ConsoleFeed, FeedEvent

P = TypeVar("P", bound=msgspec.Struct)


class Observer(Component[P], Generic[P]):
    """Tells a face what it hears, and lends it the verbs that need no grant.

    Args:
        show: Called in the event loop with each event, in order.
        watches: False for one that is content with its own events.
    """

    def __init__(
        self, launch: Launch, bus: Bus, clock: Clock, *, show: Callable[[ConsoleEvent], None], watches: bool = True
    ) -> None:
        super().__init__(launch, bus, clock)
        self.show, self._watches = show, watches
        self.feed = ConsoleFeed(bus, clock, self._heard)
        """What it listens by, and the verbs that need no grant."""

    async def connect(self) -> None:
        """Listen to what the mission tells."""
        if self._watches:
            self.feed.listen()

    async def serve(self) -> None:
        """Hear how things are, and then what changes."""
        if self._watches:
            await self.feed.run()

    def schedule_heard(self) -> None:
        """Take note that there is a new schedule. When: after it was shown."""

    def _heard(self, event: FeedEvent) -> None:
        self.show(event)
        if isinstance(event, ScheduleHeard):
            self.schedule_heard()
