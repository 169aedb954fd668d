"""The mission behind a link that was lost: the same one, or a later one of the same name."""

from __future__ import annotations

from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import AskTime, MissionTime
from backbone.errors import LinkError, Refusal

REPLY_TIME_S = 2.0  # chosen: a slow wireless link answers within this
INEXACT_S = REPLY_TIME_S / 2  # by so much a clock of another machine may be wrong from the start
DRIFT = 1e-4  # chosen: twice the drift of a machine's usual quartz, 50 ppm


async def was_started_again(bus: Bus, clock: Clock) -> bool:
    """Ask the nameserver for the time until it answers; return whether its mission is a later one than the clock's.

    The time of a later mission is behind the clock. A restarted hub goes on with the time of its mission. If that is
    ahead of the clock, this machine slept, and its clock is set.
    """
    while True:
        asked_s = clock.now_s()
        try:
            told = await bus.ask(NAMESERVER, AskTime(), MissionTime, within_s=REPLY_TIME_S)
        except (LinkError, Refusal):  # it is not up yet
            await clock.sleep_s(REPLY_TIME_S * clock.rate)
            continue
        now_s, inexact_s = clock.now_s(), INEXACT_S * clock.rate + asked_s * DRIFT
        if isinstance(clock, MissionClock) and told.at_s > now_s + inexact_s:
            clock.set_to(told.at_s + (now_s - asked_s) / 2)
        return told.at_s < asked_s - inexact_s
