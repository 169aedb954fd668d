"""Health watch: the launcher computes the mission's health and publishes it on change and every second."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from contextlib import suppress

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import Absence, ComponentState
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Appeared, Components, Disappeared, ListComponents
from backbone.picture.health import LOOK_EVERY_S, SAY_EVERY_S, HealthWord, MissionHealth, health
from backbone.picture.look import LOOK_TIME_S, look
from backbone.picture.mission import MissionPicture
from backbone.printable import printable_all
from backbone.waiting import end_tasks, set_within
from backbone.wire import Envelope

MOMENT_S = 0.01  # chosen: a rest shorter than the clock's rounding would never pass; machine seconds
SMALL_MISSION = 100  # chosen: as many components are listed in 50 kB, twice a second
REST_S = 5.0  # chosen: heartbeats, tokens and states show every fault but one: a service that beats without answering


class HealthWatch:
    """Examines the mission and publishes its health under the launcher's address.

    While something is absent, it examines every ``LOOK_EVERY_S``; a mission with more than ``SMALL_MISSION`` components
    less often, in proportion, and at news. In a healthy mission it waits for news. It also examines every ``REST_S``,
    to find a service that beats and does not answer.

    Args:
        changed: Called when ``absences`` changes.
        own: Returns the absences that the launcher reports as an owner; call ``notice`` when they change.
    """

    def __init__(
        self, bus: Bus, clock: Clock, changed: Callable[[], None], own: Callable[[], list[Absence]] = list
    ) -> None:
        self._bus, self._clock, self._changed, self._own = bus, clock, changed, own
        self.picture = MissionPicture(bus.mission, clock.now_s(), rate=clock.rate)
        """The mission in the last round."""
        self._components: Mapping[str, ComponentState] = {}
        self._news = asyncio.Event()
        self._said: MissionHealth | None = None
        self._said_s = 0.0

    def absences(self) -> list[Absence]:
        """Return the absences that the watch found; other owners report theirs in their own states.

        The mission's start is none of them: the launcher knows when it is over, before the nameserver's list says so.
        """
        return [absence for absence in self.picture.missed if not absence.is_start]

    def notice(self) -> None:
        """Examine and publish soon, because something has changed."""
        self._news.set()
        self._news = asyncio.Event()

    async def run(self) -> None:
        """Examine and publish until cancelled; a round that waits for an answer delays no publication."""
        hearing = [
            self._bus.subscribe("*/*", Conversation.STATUS, ComponentState, self._heard_state),
            self._bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, lambda _: self.notice()),
        ]
        try:
            async with asyncio.TaskGroup() as loops:
                loops.create_task(self._look_again_and_again())
                while True:
                    news = self._news
                    self._say()
                    due_s = self._due_in_s()
                    if self._is_sound:
                        await set_within(news, due_s)
                    else:
                        await self._clock.sleep_s(min(LOOK_EVERY_S / 2, due_s) * self._clock.rate)
        finally:
            for subscription in hearing:
                subscription.close()

    async def _look_again_and_again(self) -> None:
        while True:
            missed, now_s, rate, news = self.absences(), self._clock.now_s(), self._clock.rate, self._news
            listing = asyncio.create_task(self._list_meanwhile(), name="list meanwhile")
            try:
                await look(self._bus, now_s, before=self.picture, rate=rate, schedule=False, listed=self._listed)
            finally:
                await end_tasks(listing)
            self._say()
            if self.absences() != missed:
                self._changed()
            await self._clock.sleep_s(LOOK_EVERY_S * rate)
            more_s = LOOK_EVERY_S * (len(self._components) / SMALL_MISSION - 1.0)
            await set_within(news, REST_S if self._is_sound else min(REST_S, max(0.0, more_s)))

    @property
    def _is_sound(self) -> bool:
        return not self.picture.problems and self._health().word is HealthWord.OK

    def _heard_state(self, envelope: Envelope[ComponentState]) -> None:
        state = envelope.body
        known = self._components.get(state.address)
        if known is None or (known.state, known.absent) != (state.state, state.absent):
            self.notice()

    async def _list_meanwhile(self) -> None:
        """Collect the components' reports of absences while a round waits for a creator that is cut off."""
        while True:
            await self._clock.sleep_s(1.5 * LOOK_EVERY_S * self._clock.rate)
            with suppress(LinkError, Refusal):  # the round reports it
                answer = await self._bus.ask(NAMESERVER, ListComponents(), Components, within_s=LOOK_TIME_S)
                self._listed(printable_all(answer))

    def _listed(self, listing: Components) -> None:
        self._components = {state.address: state for state in listing.components}
        self._say()

    def _health(self) -> MissionHealth:
        # The launcher's own state in the list is one round old: its absences may have ended.
        others = {at: state for at, state in self._components.items() if at != self._bus.source}
        missed = [*self._own(), *self.absences()]
        return health(others, missed, self._clock.now_s(), self._clock.rate)

    def _due_in_s(self) -> float:
        """Return how long the last published health suffices if nothing changes, at least ``MOMENT_S``."""
        return max(MOMENT_S, SAY_EVERY_S - (self._clock.now_s() - self._said_s) / self._clock.rate)

    def _say(self) -> None:
        said, now_s = self._health(), self._clock.now_s()
        if said != self._said or now_s - self._said_s >= SAY_EVERY_S * self._clock.rate:
            self._said, self._said_s = said, now_s
            self._bus.publish(self._bus.source, Conversation.HEALTH, said)
