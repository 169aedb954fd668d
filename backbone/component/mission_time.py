"""The mission behind a link that was lost: the same one, or a later one of the same name."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import AskTime, MissionTime
from backbone.errors import LinkError, Refusal

REPLY_TIME_S = 2.0  # chosen: a slow wireless link answers within this
INEXACT_S = REPLY_TIME_S / 2  # by so much a clock of another machine may be wrong from the start
DRIFT = 1e-4  # chosen: twice the drift of a machine's usual quartz, 50 ppm


@dataclass(frozen=True, slots=True)
class TimeHeard:
    """The mission's time by its nameserver.

    Attributes:
        asked_s: Time of the question by the clock of the component that asked.
        at_s: The mission's time on receipt of the answer, if question and answer took equally long.
        inexact_s: The most by which a clock that is right may differ from it, in mission time.
    """

    told: MissionTime
    asked_s: float
    at_s: float
    inexact_s: float


async def ask_time(bus: Bus, clock: Clock) -> TimeHeard:
    """Ask the nameserver for the time until it answers."""
    loop = asyncio.get_running_loop()  # its time is not set while an answer is on its way; the clock may be
    while True:
        asked_s, began_s = clock.now_s(), loop.time()
        try:
            told = await bus.ask(NAMESERVER, AskTime(), MissionTime, within_s=REPLY_TIME_S)
        except (LinkError, Refusal):  # it is not up yet
            await clock.sleep_s(REPLY_TIME_S * clock.rate)
            continue
        at_s = told.at_s + (loop.time() - began_s) / 2 * clock.rate
        return TimeHeard(told, asked_s, at_s, INEXACT_S * clock.rate + asked_s * DRIFT)


class MissionStart:
    """The start of a mission that a component follows; a later start with its name is another mission.

    Args:
        clock_origin_monotonic_s: As in ``MissionTime``; 0: not known.
    """

    def __init__(self, clock_origin_monotonic_s: float = 0.0) -> None:
        self._origin_s = clock_origin_monotonic_s

    def is_over(self, heard: TimeHeard) -> bool:
        """Return whether the time is that of a later start.

        The time alone decides only if a start is not known: a mission whose first host slept is behind, too.
        """
        if self._origin_s and heard.told.clock_origin_monotonic_s:
            return heard.told.clock_origin_monotonic_s != self._origin_s
        return heard.told.at_s < heard.asked_s - heard.inexact_s

    def follow(self, heard: TimeHeard, clock: Clock) -> None:
        """Follow the start of this time; the clock shows it also if the machine or the mission's first host slept."""
        self._origin_s = heard.told.clock_origin_monotonic_s
        if isinstance(clock, MissionClock) and abs(heard.at_s - clock.now_s()) > heard.inexact_s:
            clock.set_to(heard.at_s)
