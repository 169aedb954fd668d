"""A console that only watches: it hears the schedule and what components tell, and claims nothing."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Generic, TypeVar

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import StoryEvent
from backbone.errors import LinkError
from backbone.keys import Conversation
from backbone.rc_manager.messages import ADDRESS as RC_MANAGER
from backbone.rc_manager.messages import AskSchedule, Schedule
from backbone.wire import Envelope
from ui_console.console_model import ConsoleEvent, LinkTrouble, ScheduleHeard, StoryHeard

REPLY_TIME_S = 1.0  # chosen: a person waits this long for a picture

P = TypeVar("P", bound=msgspec.Struct)


class Observer(Component[P], Generic[P]):
    """Tells a face what it hears.

    Args:
        show: Called in the event loop with each event, in order.
        watches: False for one that is content with its own events.
    """

    def __init__(
        self, launch: Launch, bus: Bus, clock: Clock, *, show: Callable[[ConsoleEvent], None], watches: bool = True
    ) -> None:
        super().__init__(launch, bus, clock)
        self.show, self._watches = show, watches

    async def connect(self) -> None:
        """Listen to the schedule, and to what components tell of themselves."""
        if not self._watches:
            return
        self.bus.subscribe(RC_MANAGER, Conversation.SCHEDULE, Schedule, self._heard_schedule, latest=True)
        self.bus.subscribe("*/*", Conversation.LOG, StoryEvent, self._heard_story)

    async def serve(self) -> None:
        """Ask for the schedule as it is; later ones are heard."""
        if not self._watches:
            return
        try:
            schedule = await self.bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S)
        except LinkError as error:
            self.show(LinkTrouble(self.clock.now_s(), str(error)))
            return
        self.schedule_changed(schedule)

    def schedule_changed(self, schedule: Schedule) -> None:
        """Take note of a schedule."""
        self.show(ScheduleHeard(self.clock.now_s(), schedule))

    def _heard_schedule(self, envelope: Envelope[Any]) -> None:
        self.schedule_changed(envelope.body)

    def _heard_story(self, envelope: Envelope[Any]) -> None:
        self.show(StoryHeard(self.clock.now_s(), envelope.body))
