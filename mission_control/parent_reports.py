"""ParentReports: keeps the parent of a behavior informed of its newest state."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine

from backbone.bus.interface import Bus, Clock
from backbone.component.peer_monitor import PeerMonitor
from backbone.errors import LinkError, Refusal
from mission_control.child_keeper import AGAIN_AFTER_S, REPLY_TIME_S, end_task
from mission_control.messages import ChildReport, ReportNoted

log = logging.getLogger(__name__)


class ParentReports:
    """Sends the newest report until the parent acknowledges it; older reports that did not arrive are dropped.

    Args:
        parent: Address of the parent.
        report: Returns the newest report.
        begin: Runs work as a task, unless the behavior is ending.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        parent: str,
        report: Callable[[], ChildReport],
        begin: Callable[[Coroutine[object, None, None], str], asyncio.Task[None] | None],
    ) -> None:
        self._bus, self._clock, self._report, self._begin = bus, clock, report, begin
        self._parent = PeerMonitor(bus, parent)
        self._sending: asyncio.Task[None] | None = None
        self._is_due = False

    def send(self) -> None:
        """Send a report soon."""
        self._is_due = True
        if self._sending is None:
            self._sending = self._begin(self._send_while_due(), "report")

    async def conclude(self) -> None:
        """Send the last report until the parent has acknowledged it."""
        sending, self._sending = self._sending, None
        await end_task(sending)
        await self._send_until_noted()

    async def _send_while_due(self) -> None:
        while self._is_due:
            self._is_due = False
            await self._send_until_noted()
        self._sending = None

    async def _send_until_noted(self) -> None:
        while True:
            await self._parent.wait_there()
            if await self._is_noted(self._report()):
                return
            await self._clock.sleep_s(AGAIN_AFTER_S * self._clock.rate)

    async def _is_noted(self, report: ChildReport) -> bool:
        """Send the report once; return True if the parent acknowledged or refused it."""
        try:
            await self._bus.ask(self._parent.address, report, ReportNoted, within_s=REPLY_TIME_S)
        except LinkError as error:
            log.info("%s did not get the report: %s", self._parent.address, error)
            return False
        except Refusal as refusal:
            log.warning("%s refused the report: %s", self._parent.address, refusal)
        return True
