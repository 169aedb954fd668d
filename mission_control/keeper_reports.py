"""KeeperReports: the reports of a behavior to the console that ordered it; the behavior ends with the console.

If a console acknowledges a report, it runs and knows the order. If the console is gone, does not answer, or no longer
knows the order, the behavior ends, so that no order outlives its console.
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

EVERY_S = 0.3  # chosen: several times within SILENT_S; machine seconds
REPLY_TIME_S = 0.9  # chosen: as ARCs allow for their owners' heartbeat; machine seconds
SILENT_S = 1.2  # chosen: covers one lost report; machine seconds
GONE_S = 0.5  # chosen: as ARCs do with their owners: a robot is free within a second of its console's death


class KeeperReports:
    """Sends the newest report at each change, and regularly.

    Args:
        keeper: Address of the console.
        report: Returns the newest report.
    """

    def __init__(self, bus: Bus, clock: Clock, keeper: str, report: Callable[[], ChildReport]) -> None:
        self._bus, self._clock, self._keeper, self._report = bus, clock, keeper, report
        self._news, self._noted = asyncio.Event(), asyncio.Event()

    def send(self) -> None:
        """Send a report soon."""
        self._news.set()

    async def wait_noted(self) -> None:
        """Wait until the console has acknowledged a report: it runs and knows the order."""
        await self._noted.wait()

    async def run(self) -> str:
        """Report until the console is gone, silent, or does not know the order; return the reason, for people."""
        keeper, why = PeerMonitor(self._bus, self._keeper, gone_after_s=GONE_S), [f"{self._keeper} is gone"]
        try:
            await first_of(keeper.wait_gone(), self._report_while_noted(why))
        finally:
            keeper.close()
        return why[-1]

    async def _report_while_noted(self, why: list[str]) -> None:
        """Report; add the reason when no answer arrives or the order is unknown."""
        noted_s = self._clock.now_s()
        while True:
            self._news.clear()
            asked_s = self._clock.now_s()
            try:
                await self._bus.ask(self._keeper, self._report(), ReportNoted, within_s=REPLY_TIME_S)
            except Refusal as refusal:
                why.append(refusal.detail)
                return
            except LinkError as error:
                log.info("%s did not note the report: %s", self._keeper, error)
                if self._clock.now_s() - noted_s >= SILENT_S * self._clock.rate:
                    why.append(f"{self._keeper} is silent")
                    return
            else:
                noted_s = asked_s
                self._noted.set()
            await set_within(self._news, EVERY_S)
