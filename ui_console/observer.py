"""A console that only watches: it hears what the mission tells, and claims nothing."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, Generic, TypeVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from resource_pool.arc_client import StopState
from ui_console.console_events import ConsoleEvent, ScheduleHeard
from ui_console.feed import ConsoleFeed, FeedEvent

P = TypeVar("P", bound=msgspec.Struct)


class Observer(Component[P], Generic[P]):
    """Tells a face what it hears, and lends it the verbs that need no grant.

    Args:
        show: Called in the event loop with each event, in order.
        watches: False for one that is content with its own events.
        user: Who sits at it, for the record; empty: the console's name.
    """

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        *,
        show: Callable[[ConsoleEvent], None],
        watches: bool = True,
        user: str = "",
    ) -> None:
        super().__init__(launch, bus, clock)
        self.show, self._watches = show, watches
        self.user = user or launch.name
        self.feed = ConsoleFeed(bus, clock, self._heard)
        """What it listens by, and the verbs that need no grant."""

    # ------------------------------------------------------------------ verbs that need no grant
    async def stop_robot(self, robot: str, reason: str = "") -> bool:
        """Stop a robot, whoever holds it; return whether that is certain."""
        self.tell(robot, f"{self.user} stops it{f': {reason}' if reason else ''}")
        return not await self.feed.stop_robots([robot], reason, self.user)

    async def stop_all(self, reason: str = "") -> list[str]:
        """Stop every robot of the mission, whoever holds it; return those of which it is not certain.

        Those that are known are stopped at once, before anybody is asked whether there are more.
        """
        known = self.feed.robots
        self.tell("robots", f"{self.user} stops all: {', '.join(sorted(known)) or 'whatever there is'}")
        unsure, found = await asyncio.gather(self.feed.stop_robots(known, reason, self.user), self.feed.find_robots())
        return unsure + await self.feed.stop_robots(found - known, reason, self.user)

    async def lift_stop(self, stop: StopState) -> bool:
        """Let a robot move again that was stopped; return whether it may."""
        self.tell(stop.rc, f"{self.user} lifts stop {stop.number} by {stop.by}")
        return await self.feed.lift(stop, self.user)

    async def set_parameter(self, name: str, parameter: str, value: Any) -> bool:
        """Have a component run with another value; return whether it does."""
        is_set = await self.feed.set_parameter(name, parameter, value, self.user)
        self.tell(name, f"{self.user} {'set' if is_set else 'could not set'} {parameter} to {value!r}")
        return is_set

    async def why(self, name: str) -> list[str]:
        """Return for people why this robot, ARC, behavior, console or component is as it is."""
        return await self.feed.why(name)

    # ------------------------------------------------------------------ the component's hooks
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
