"""Names keeper: the launcher maintains the file of the mission's names, which shells use for completion."""

from __future__ import annotations

import asyncio
import logging
from pathlib import Path

from backbone import run_names
from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import ComponentState
from backbone.component_database.messages import TypeCount
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.nameserver.messages import Appeared, Components, Disappeared, ListComponents
from backbone.picture.look import LOOK_TIME_S, types_of
from backbone.picture.mission import MissionPicture
from backbone.picture.names import names_in
from backbone.printable import printable_all
from backbone.rc_manager.messages import AskSchedule
from backbone.run_names import MissionNames
from backbone.scheduling.views import Schedule
from backbone.wire import Envelope, Message

log = logging.getLogger(__name__)

WRITE_EVERY_S = 0.5  # chosen: no person types the name of a new component sooner; seconds of the machine
LIST_AGAIN_S = 10.0  # chosen: soon enough to add an operator who signed in, or a name whose message was lost


class NamesKeeper:
    """Subscribes to components, asks the RC manager for its RCs, and writes the names after each change.

    Args:
        directory: The run folder.
    """

    def __init__(self, bus: Bus, clock: Clock, directory: Path) -> None:
        self._bus, self._clock, self._directory = bus, clock, directory
        self._picture = MissionPicture(bus.mission)
        self._types: list[TypeCount] = []
        self._written: MissionNames | None = None
        self._news = asyncio.Event()
        self._has_old_schedule = True

    async def run(self) -> None:
        """Keep the file up to date until cancelled; write at most once in ``WRITE_EVERY_S``."""
        hearing = [
            self._bus.subscribe("*/*", Conversation.STATUS, ComponentState, self._heard),
            self._bus.subscribe(NAMESERVER, Conversation.EVENTS, Appeared | Disappeared, self._heard),
        ]
        try:
            async with asyncio.TaskGroup() as loops:
                loops.create_task(self._list_again_and_again())
                while True:
                    await self._news.wait()
                    self._news.clear()
                    if self._has_old_schedule:
                        await self._ask_schedule()
                    self._write()
                    await self._clock.sleep_s(WRITE_EVERY_S * self._clock.rate)
        finally:
            for subscription in hearing:
                subscription.close()

    async def _list_again_and_again(self) -> None:
        while True:
            try:
                listed = await self._bus.ask(NAMESERVER, ListComponents(), Components, within_s=LOOK_TIME_S)
                self._picture.take(printable_all(listed))
                if not self._types:
                    self._types = await types_of(self._bus)
            except (LinkError, Refusal) as error:  # the health watch reports it
                log.info("the names are as they were: %s", error)
            self._has_old_schedule = True
            self._news.set()
            await self._clock.sleep_s(LIST_AGAIN_S * self._clock.rate)

    async def _ask_schedule(self) -> None:
        """Ask once after components came or went: RCs change only then, but the schedule changes all the time."""
        self._has_old_schedule = False
        try:
            schedule = await self._bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=LOOK_TIME_S)
        except (LinkError, Refusal) as error:
            log.info("the names of RCs are as they were: %s", error)
        else:
            self._picture.take(printable_all(schedule))

    def _heard(self, envelope: Envelope[Message]) -> None:
        match printable_all(envelope.body):
            case Appeared(component=component):
                self._picture.take(component)
                self._has_old_schedule = True
            case Disappeared() as said:
                self._picture.take(said)
                self._has_old_schedule = True
            case ComponentState() as said:
                self._picture.take(said)
        self._news.set()

    def _write(self) -> None:
        names = names_in(self._picture, self._types)
        if names == self._written:
            return
        try:
            run_names.write(self._directory, names)
            self._written = names
        except OSError as error:  # shells then ask the mission itself
            log.info("the names are not written: %s", error)
            self._written = None
