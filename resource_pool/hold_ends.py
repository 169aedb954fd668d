"""HoldEnds: brings the resource of an RC into its safe state at every end of a hold, and remembers where this failed.

Rule of this file: a hold that did not end safely is made up for before the next connection.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Sequence
from typing import Protocol

from backbone.component.messages import LogLevel
from backbone.component.story import StoryBook
from resource_pool.drivers.interface import HardwareFault
from resource_pool.holds import Hold, HoldTable

log = logging.getLogger(__name__)

SAFE_WITHIN_S = 0.4  # chosen: below the RC manager's limit, so that the reason reaches it; machine seconds


class RcOfHolds(Protocol):
    """The RC, as the ends of its holds need it."""

    holds: HoldTable
    story: StoryBook

    @property
    def name(self) -> str:
        """Its name."""

    async def make_safe(self, hold: Hold) -> None:
        """Bring the resource of this hold into its safe state."""

    def report(self, feedback: str) -> None:
        """Set the feedback."""

    def changed(self) -> None:
        """Note that the published state may have changed."""

    def publish_event(self, subject: str, what: str, level: LogLevel = ...) -> None:
        """Publish an event."""


class HoldEnds:
    """Ends holds that have left the table.

    Attributes:
        faults: Safe states that were not reached at an attempt.
    """

    def __init__(self, rc: RcOfHolds) -> None:
        self.faults = 0
        self._rc = rc
        self._unsafe: dict[str, Hold] = {}
        self._remark = ""

    def unsafe(self, arc: str) -> Hold | None:
        """Return the ended hold of this ARC, if the resource is not safe after it."""
        return self._unsafe.get(arc)

    async def end(self, hold: Hold, reason: str) -> None:
        """Bring the resource of the ended hold into its safe state.

        Raises:
            HardwareFault: It is not safe; the RC tries again before the next connection.
        """
        rc = self._rc
        self._unsafe[hold.arc] = hold
        try:
            async with asyncio.timeout(SAFE_WITHIN_S):
                await rc.make_safe(hold)
        except (HardwareFault, TimeoutError) as error:
            detail = error.detail if isinstance(error, HardwareFault) else f"nothing within {SAFE_WITHIN_S} s"
            self.faults += 1
            rc.publish_event(hold.arc, f"disconnected ({reason}), but {rc.name} is not safe: {detail}", LogLevel.ALARM)
            self.report_holders()
            raise HardwareFault(f"{rc.name} is not safe after {hold.arc}: {detail}", arc=hold.arc) from error
        del self._unsafe[hold.arc]
        rc.story.note(hold.arc, f"disconnected: {reason}")
        self.report_holders()

    async def end_all(self, ended: Sequence[Hold], reason: str) -> None:
        """End these holds; a fault of the hardware at one of them stops neither the others nor the caller."""
        for hold in ended:
            try:
                await self.end(hold, reason)
            except HardwareFault as fault:
                log.warning("%s", fault)

    async def make_up(self) -> None:
        """Bring the resource into its safe state where this failed.

        Raises:
            HardwareFault: It is still not safe.
        """
        for hold in list(self._unsafe.values()):
            await self.end(hold, "made up for")

    def remark(self, line: str) -> None:
        """Report this line of the driver behind the holders from now on."""
        if line != self._remark:
            self._remark = line
            self.report_holders()

    def report_holders(self) -> None:
        """Report who holds the RC, and after whom it is not safe."""
        holders = ", ".join(hold.arc for hold in self._rc.holds.holds())
        unsafe = f", not safe after {', '.join(self._unsafe)}" if self._unsafe else ""
        remark = f"; {self._remark}" if self._remark else ""
        self._rc.report(f"held by {holders}{unsafe}{remark}" if holders else f"free{unsafe}{remark}")
        self._rc.changed()  # the holder may be the same with a new epoch
