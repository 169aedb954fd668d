"""HoldEnds: brings an RC's resource into its safe state at every end of a hold, and records failures.

Rules of this file:

* If a hold did not end safely, the RC retries the safe state before the next connection.
* A command that goes on although it was cancelled may act on the resource at any time. The resource is not safe before
  its end, and is brought into its safe state then.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Sequence
from typing import Protocol, TypeVar

from backbone.component.component_of_parts import ComponentOfParts
from backbone.component.messages import LogLevel
from backbone.errors import LinkError, Refusal, complaint, waiting_place
from backbone.waiting import only_bugs
from resource_pool.drivers.interface import HardwareFault
from resource_pool.holds import Hold, HoldTable
from resource_pool.orders_in_progress import OrdersInProgress

log = logging.getLogger(__name__)

T = TypeVar("T")
SAFE_WITHIN_S = 0.4  # chosen: below the RC manager's limit, so that the RC manager gets the reason; machine seconds
ANSWERS_WITHIN_S = 0.8  # chosen: for so long an ARC waits for the answer to a command; machine seconds
FAULTS = (Refusal, LinkError, TimeoutError)
"""Of a hook of a hold: the hardware, or a component that the hook asked, does not obey. All others are bugs."""


class RcOfHolds(ComponentOfParts, Protocol):
    """The interface of the RC that ``HoldEnds`` needs."""

    holds: HoldTable

    async def make_safe(self, hold: Hold) -> None:
        """Bring the resource of this hold into its safe state."""


class HoldEnds:
    """Ends holds that have left the table.

    Attributes:
        faults: Number of attempts that did not reach the safe state.
        orders: The commands that the RC is carrying out.
        changing: Held while a hold begins or ends.
    """

    def __init__(self, rc: RcOfHolds) -> None:
        self.faults, self.orders = 0, OrdersInProgress(rc.name)
        self.changing = asyncio.Lock()
        self._rc = rc
        self._unsafe: dict[str, Hold] = {}
        self._remark = ""
        self._late: dict[asyncio.Task[object], str] = {}
        self._told_late: tuple[str, int] | None = None

    def left(self) -> list[Hold]:
        """Return the ended holds after which the resource is still unsafe."""
        return list(self._unsafe.values())

    def unsafe(self, arc: str) -> Hold | None:
        """Return the ended hold of this ARC if the resource is still unsafe after it."""
        return self._unsafe.get(arc)

    async def carry_out(self, hold: Hold, work: Awaitable[T]) -> T:
        """Return the result of a command's work.

        Raises:
            StaleEpoch: The hold ended first; the work was cancelled.
            HardwareFault: The work went on nevertheless, and the resource is not safe after it.
        """
        task = asyncio.current_task()
        assert task is not None  # noqa: S101  a coroutine runs in a task
        late = asyncio.get_running_loop().call_later(ANSWERS_WITHIN_S, self._note_late, hold, task)
        try:
            return await self.orders.run(hold, work)
        finally:
            late.cancel()
            if self._late.pop(task, None) is not None:
                self.report_holders()
            if self.orders.went_on():
                async with self.changing:
                    if self._unsafe.get(hold.arc) is hold:
                        await self.end(hold, "its last command has ended")

    async def end(self, hold: Hold, reason: str) -> None:
        """Bring the resource of the ended hold into its safe state.

        Raises:
            HardwareFault: The resource is not safe; the RC retries before the next connection.
            Exception: A bug in ``make_safe``, which ends the RC; the resource is not safe.
        """
        rc = self._rc
        self._unsafe[hold.arc] = hold
        try:
            async with asyncio.timeout(SAFE_WITHIN_S):
                have_ended = await self.orders.cut_off(hold)
                await only_bugs(rc.make_safe(hold), f"make_safe of {rc.name}")
            if not have_ended:
                raise HardwareFault("a command goes on although it was cancelled")
        except Exception as error:
            detail = detail_of(error)
            self.faults += 1
            rc.publish_event(hold.arc, f"disconnected ({reason}), but {rc.name} is not safe: {detail}", LogLevel.ALARM)
            self.report_holders()
            if not isinstance(error, FAULTS):
                raise
            raise HardwareFault(f"{rc.name} is not safe after {hold.arc}: {detail}", arc=hold.arc) from error
        del self._unsafe[hold.arc]
        rc.story.note(hold.arc, f"disconnected: {reason}")
        self.report_holders()

    async def end_all(self, ended: Sequence[Hold], reason: str) -> None:
        """End these holds, each of them even if another one fails.

        Raises:
            Exception: The first bug in ``make_safe``. If the hardware fails, nothing is raised.
        """
        bugs: list[Exception] = []
        for hold in ended:
            try:
                await self.end(hold, reason)
            except HardwareFault as fault:
                log.warning("%s", fault)
            except Exception as bug:
                bugs.append(bug)
        if bugs:
            raise bugs[0]

    async def make_up(self) -> None:
        """Retry the safe state for every hold for which it failed.

        Raises:
            HardwareFault: The resource is still not safe.
        """
        for hold in self.left():
            await self.end(hold, "made up for")

    def remark(self, line: str) -> None:
        """Show this line of the driver after the holders from now on."""
        if line != self._remark:
            self._remark = line
            self.report_holders()

    def _note_late(self, hold: Hold, task: asyncio.Task[object]) -> None:
        """Report a command that goes on; once for each hold in the log."""
        place = waiting_place(task.get_coro())
        told = f"a command has not ended within {ANSWERS_WITHIN_S} s{place and f' ({place})'}"
        self._late[task] = told
        if self._told_late != (hold.arc, hold.epoch):
            self._told_late = hold.arc, hold.epoch
            self._rc.publish_event(self._rc.name, f"{told}; its ARC {hold.arc} got no answer", LogLevel.WARNING)
        self.report_holders()

    def report_holders(self) -> None:
        """Report the ARCs that hold the RC, those whose holds did not end safely, and a command that goes on."""
        holders = ", ".join(hold.arc for hold in self._rc.holds.holds())
        unsafe = f", not safe after {', '.join(self._unsafe)}" if self._unsafe else ""
        remarks = [self._remark, *list(self._late.values())[:1]]
        remark = "".join(f"; {line}" for line in remarks if line)
        self._rc.report(f"held by {holders}{unsafe}{remark}" if holders else f"free{unsafe}{remark}")
        self._rc.changed()  # the same ARC may hold the RC with a new epoch


def detail_of(error: Exception) -> str:
    """Return why a hook of a hold failed, as part of a sentence."""
    match error:
        case Refusal():
            return error.detail
        case TimeoutError():
            return f"nothing within {SAFE_WITHIN_S} s"
        case LinkError():
            return str(error)
        case _:
            return complaint(error)
