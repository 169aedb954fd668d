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
from backbone.nameserver.messages import Components, ListComponents
from backbone.picture.health import LOOK_EVERY_S, SAY_EVERY_S, MissionHealth, health
from backbone.picture.look import LOOK_TIME_S, look
from backbone.picture.mission import MissionPicture
from backbone.printable import printable_all


class HealthWatch:
    """Examines the mission every ``LOOK_EVERY_S`` and publishes its health under the launcher's address.

    Args:
        changed: Called when ``absences`` changes.
        own: Returns the absences that the launcher reports as an owner.
    """

    def __init__(
        self, bus: Bus, clock: Clock, changed: Callable[[], None], own: Callable[[], list[Absence]] = list
    ) -> None:
        self._bus, self._clock, self._changed, self._own = bus, clock, changed, own
        self.picture = MissionPicture(bus.mission, clock.now_s(), rate=clock.rate)
        """The mission in the last round."""
        self._components: Mapping[str, ComponentState] = {}
        self._listed_s = clock.now_s()
        self._said: MissionHealth | None = None
        self._said_s = 0.0

    def absences(self) -> list[Absence]:
        """Return the absences that the watch found; other owners report theirs in their own states."""
        return list(self.picture.missed)

    async def run(self) -> None:
        """Examine and publish until cancelled; a round that waits for an answer delays no publication."""
        async with asyncio.TaskGroup() as loops:
            loops.create_task(self._look_again_and_again())
            loops.create_task(self._list_again_and_again())
            while True:
                self._say(self._health())
                await self._clock.sleep_s(LOOK_EVERY_S / 2 * self._clock.rate)

    async def _look_again_and_again(self) -> None:
        while True:
            missed, now_s, rate = self.absences(), self._clock.now_s(), self._clock.rate
            await look(self._bus, now_s, before=self.picture, rate=rate, schedule=False, listed=self._listed)
            if self.absences() != missed:
                self._changed()
            await self._clock.sleep_s(LOOK_EVERY_S * self._clock.rate)

    async def _list_again_and_again(self) -> None:
        """Collect the components' reports of absences, also while a round waits for a creator that is cut off."""
        while True:
            await self._clock.sleep_until_s(self._listed_s + 1.5 * LOOK_EVERY_S * self._clock.rate)
            if self._clock.now_s() < self._listed_s + LOOK_EVERY_S * self._clock.rate:
                continue
            with suppress(LinkError, Refusal):  # the round reports it
                answer = await self._bus.ask(NAMESERVER, ListComponents(), Components, within_s=LOOK_TIME_S)
                self._listed(printable_all(answer))
            self._listed_s = self._clock.now_s()

    def _listed(self, listing: Components) -> None:
        self._listed_s = self._clock.now_s()
        self._components = {state.address: state for state in listing.components}

    def _health(self) -> MissionHealth:
        # The launcher's own state in the list is one round old: its absences may have ended.
        others = {at: state for at, state in self._components.items() if at != self._bus.source}
        missed = [*self._own(), *self.picture.missed]
        return health(others, missed, self._clock.now_s(), self._clock.rate)

    def _say(self, said: MissionHealth) -> None:
        now_s = self._clock.now_s()
        if said != self._said or now_s - self._said_s >= SAY_EVERY_S * self._clock.rate:
            self._said, self._said_s = said, now_s
            self._bus.publish(self._bus.source, Conversation.HEALTH, said)
