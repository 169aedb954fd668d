"""MetricsWatch: overhears the RC manager, and asks all components for their own numbers.

It overhears only the RC manager, as a recorder does. So no component waits for it, and no other component sends copies.
"""

from __future__ import annotations

import logging
from typing import TypeVar

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.interface import Bus, Clock, Told
from backbone.component.messages import AskStatistics, Statistics
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.metrics.tally import Tally
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import component_of
from backbone.rc_manager.messages import AskSchedule, AskUtilization, Leases, TraceLine
from backbone.scheduling.views import Schedule, Utilization
from backbone.wire import Envelope, Message, Reader

REPLY_TIME_S = 2.0  # chosen: a slow wireless link answers within this
ASK_EACH_S = 10.0  # chosen: shorter than Prometheus' usual scrape, and a question to each component costs nothing
MOST_WAITING_BYTES = 4 * 1024 * 1024  # chosen: a thousand schedules of a large mission
TOLD_IN = frozenset({Conversation.SCHEDULE, Conversation.LEASES, Conversation.EVENTS})

Answer = TypeVar("Answer", bound=Message)
log = logging.getLogger(__name__)


class MetricsWatch:
    """Watches a mission until ``run`` is cancelled.

    Args:
        bus: Bus of the mission; not closed.

    Attributes:
        tally: The tally of all overheard messages.
        utilization: RC → share of the last minute.
        statistics: Component and name → its newest number.
    """

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus, self._clock = bus, clock
        self._told = Reader(Told)
        self._news: Reader[Schedule | Leases | TraceLine] = Reader(Schedule | Leases | TraceLine)
        self.tally = Tally()
        self.utilization: dict[str, float] = {}
        self.statistics: dict[tuple[str, str], float] = {}
        self._subscribed = bus.overhear(Conversation.TOLD, self._heard, MOST_WAITING_BYTES, RC_MANAGER)

    @property
    def dropped(self) -> int:
        """Number of messages that were lost because the watch was too slow."""
        return self._subscribed.dropped

    async def run(self) -> None:
        """Ask for numbers repeatedly."""
        while True:
            await self._ask()
            await self._clock.sleep_s(ASK_EACH_S * self._clock.rate)

    async def _ask(self) -> None:
        schedule = await self._asked(RC_MANAGER, AskSchedule(), Schedule)
        if schedule is not None:
            self.tally.take_schedule(schedule)
        shares = await self._asked(RC_MANAGER, AskUtilization(), Utilization)
        self.utilization = {one.rc: one.minute for one in shares.rcs} if shares is not None else {}
        found = await self._asked(NAMESERVER, ListComponents(), Components)
        numbers: dict[tuple[str, str], float] = {}
        for address in [one.address for one in found.components] if found is not None else []:
            answer = await self._asked(address, AskStatistics(), Statistics)
            if answer is not None:
                numbers |= {(component_of(address), name): float(value) for name, value in answer.values.items()}
        self.statistics = numbers

    async def _asked(self, address: str, question: Message, reply: type[Answer]) -> Answer | None:
        try:
            return await self._bus.ask(address, question, reply, within_s=REPLY_TIME_S)
        except (LinkError, Refusal) as error:
            log.info("%s has no numbers: %s", address, error)
            return None

    def _heard(self, _key: str, raw: bytes) -> None:
        try:
            for copies in self._told.read(raw).body.copies:
                for quoted in copies.messages if copies.conversation in TOLD_IN else []:
                    self._take(self._news.read(quoted))
        except Refusal as error:
            log.info("not counted: %s", error)

    def _take(self, said: Envelope[Schedule | Leases | TraceLine]) -> None:
        match said.body:
            case Schedule():
                self.tally.take_schedule(said.body)
            case Leases():
                self.tally.take_leases(said.body, said.stamp_s)
            case TraceLine(line=line):
                self.tally.take_line(line)
