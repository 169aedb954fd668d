"""The running context switches: at most one for each ARC, each reported to the schedule manager when it is done."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine, Iterable

from backbone.rc_manager.context_switch import ContextSwitch
from backbone.rc_manager.failures import Failures
from backbone.rc_manager.rc_watch import RcWatch, Service
from backbone.rc_manager.switch_times import SwitchTimes
from backbone.scheduling.events import ConnectArc, Freed, Opened, OpenFailed, RevokeArc
from backbone.waiting import end_tasks


class ArcSwitches:
    """Carries out the schedule manager's instructions for ARCs.

    Args:
        service: The RC manager.
        context_switch: Connects and revokes.
        failures: Gets the ARCs that do not open their gates.
        rcs: Gets the names of RCs that failed.
        grace_s: Time that an ARC has to stop cleanly.

    Attributes:
        failed_again: ARCs whose last two or more connections failed because they did not open their gates.
    """

    def __init__(
        self, service: Service, failures: Failures, context_switch: ContextSwitch, rcs: RcWatch, grace_s: float
    ) -> None:
        self._service, self._failures, self._context_switch = service, failures, context_switch
        self._rcs, self._grace_s = rcs, grace_s
        self._under_way: dict[str, asyncio.Task[None]] = {}
        self._in_vain: dict[str, tuple[str, ...]] = {}
        self.failed_again: set[str] = set()
        self._times = SwitchTimes()

    def __contains__(self, arc: str) -> bool:
        """Return whether a switch of this ARC is running."""
        return arc in self._under_way

    @property
    def tasks(self) -> list[asyncio.Task[None]]:
        """The tasks of the running switches."""
        return [*self._under_way.values()]

    def statistics(self) -> dict[str, float]:
        """Return numbers and times of switches."""
        return self._times.statistics()

    def remedy(self, arc: str) -> str:
        """Return the remedy for an ARC that did not open its gate; empty: its host and those of its RCs answer soon."""
        return self._rcs.remedy_of_hosts(self._in_vain.get(arc, ()))

    def forget(self, arc: str) -> None:
        """Forget why the ARC did not open its gate, because it did so now or has ended."""
        self.failed_again.discard(arc)
        self._rcs.forget_hosts(self._in_vain.pop(arc, ())[:1])

    def connect(self, order: ConnectArc) -> None:
        """Connect the ARC to its RCs."""
        self._begin(order.arc, lambda: self._connect(order))

    def revoke(self, order: RevokeArc) -> None:
        """Take the RCs from the ARC."""
        self._times.revoked(order.epochs, order.by, self._service.clock.now_s())
        self._begin(order.arc, lambda: self._revoke(order))

    def _begin(self, arc: str, work: Callable[[], Coroutine[object, None, None]]) -> None:
        """Run the work after ending the work that still runs for this ARC."""
        before = self._under_way.get(arc)

        async def in_turn() -> None:
            if before is not None and not before.done():
                await end_tasks(before)
            await work()
            if self._under_way.get(arc) is asyncio.current_task():
                del self._under_way[arc]

        self._under_way[arc] = self._service.start_task(in_turn(), f"switch {arc}")

    async def _connect(self, order: ConnectArc) -> None:
        vain = await self._context_switch.connect(order, self._release_s(order.epochs))
        if vain is None:
            self._rcs.connected(order.epochs)
            self._failures.end(order.arc)
            self.forget(order.arc)
            self._times.granted(order.epochs, order.arc, order.settle_s, self._service.clock.now_s())
            self._service.happened(Opened(order.arc))
            return
        if vain.failed:
            self._rcs.failed(vain.failed)
        else:
            self._failures.begin(order.arc)
            if order.arc in self._in_vain:
                self.failed_again.add(order.arc)
            self._in_vain[order.arc] = (order.arc, *order.epochs)
            self._rcs.measure_hosts(self._in_vain[order.arc])
        for rc in vain.unconfirmed:
            self._rcs.does_not_answer(rc)
        self._service.happened(OpenFailed(order.arc, vain.failed))
        if vain.failed:
            self._rcs.meet_in_a_while(vain.failed)

    async def _revoke(self, order: RevokeArc) -> None:
        for rc in await self._context_switch.revoke(order, self._grace_s + self._release_s(order.epochs)):
            self._rcs.does_not_answer(rc)
        self._service.happened(Freed(order.arc))

    def _release_s(self, rcs: Iterable[str]) -> float:
        return max(self._rcs.resources[rc].disconnect_s for rc in rcs)
