"""KeeperReports: a behavior that a console ordered reports to it, and ends with it.

The console that notes a report lives and knows the order. A console that is gone, answers nothing, or does not know the
order any more ends the behavior, so that no order outlives its console.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable

from backbone.bus.interface import Bus, Clock
from backbone.component.peer_monitor import PeerMonitor
from backbone.errors import LinkError, Refusal
from backbone.waiting import first_of, set_within
from mission_control.messages import ChildReport, ReportNoted

log = logging.getLogger(__name__)

EVERY_S = 0.3  # chosen: as the heartbeats of ARCs; machine seconds
REPLY_TIME_S = 0.9  # chosen: as an ARC gives its owner for a beat
SILENT_S = 1.2  # chosen: one unanswered report and the start of a second; a console's screen never takes that long
GONE_S = 0.5  # chosen: as ARCs do with their owners: a robot is free within a second of its console's death


class KeeperReports:
    """Sends the newest report at each change and regularly.

    Args:
        bus: Bus of the behavior.
        clock: The mission's clock.
        keeper: Address of the console.
        report: Returns the newest report.
        end: Ends the behavior, for the reason it is called with.
    """

    def __init__(
        self, bus: Bus, clock: Clock, keeper: str, report: Callable[[], ChildReport], end: Callable[[str], None]
    ) -> None:
        self._bus, self._clock, self._keeper, self._report, self._end = bus, clock, keeper, report, end
        self._news = asyncio.Event()

    def send(self) -> None:
        """Send a report soon."""
        self._news.set()

    async def run(self) -> None:
        """Report until the console is gone, silent, or does not know the order; then end the behavior."""
        keeper = PeerMonitor(self._bus, self._keeper, gone_after_s=GONE_S)
        why = [f"its console {self._keeper} is gone"]
        try:
            await first_of(keeper.wait_gone(), self._report_until_unknown(why))
        finally:
            keeper.close()
        self._end(why[-1])

    async def _report_until_unknown(self, why: list[str]) -> None:
        """Report until no answer comes or the order is unknown; add the reason then."""
        noted_s = self._clock.now_s()
        while True:
            self._news.clear()
            asked_s = self._clock.now_s()
            try:
                await self._bus.ask(self._keeper, self._report(), ReportNoted, within_s=REPLY_TIME_S)
            except Refusal as refusal:
                why.append(f"its console does not know it: {refusal.detail}")
                return
            except LinkError as error:
                log.info("%s did not note the report: %s", self._keeper, error)
                if self._clock.now_s() - noted_s >= SILENT_S * self._clock.rate:
                    why.append(f"its console {self._keeper} is silent")
                    return
            else:
                noted_s = asked_s
            await set_within(self._news, EVERY_S)
