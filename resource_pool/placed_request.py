"""The request of an ARC at the RC manager: sent, changed, withdrawn, and sent to the next RC manager."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Iterable, Mapping

import msgspec

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.errors import LinkError, Refusal
from backbone.rc_manager.messages import ChangeRuntime, CurrentRequest, Done, SetIdle, Withdraw
from backbone.scheduling.requests import Scheduled, SchedulingRequest, UnknownRequest
from backbone.scheduling.run_times import require_runtime
from backbone.wire import Message
from resource_pool.arc_request import set_of
from resource_pool.arc_slice import RC_REPLY_S

log = logging.getLogger(__name__)

REQUEST_EACH_S, REQUEST_WITHIN_S = 30.0, 60.0  # chosen: the RC manager may first ask for the start of RCs
RUN_TIMES = frozenset({"minimum_runtime_s", "maximum_runtime_s"})  # parameters that may change while an ARC runs


class PlacedRequest:
    """The request of an ARC, and the set of RCs that the RC manager chose.

    Attributes:
        request: The request; None until it is made.
        rcs: Role → name of the chosen RCs; empty until they are chosen.
        waits_since_s: Mission time of its place in line, see ``CurrentRequest``.
        sending: Task that sends changed run times; cancelled by the next change.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        arc: str,
        *,
        changed: Callable[[Mapping[str, object]], None],
        note: Callable[[str, str], object],
    ) -> None:
        """Create the record without a request.

        Args:
            bus: For the RC manager.
            changed: Changes these parameters of the ARC, so that they show the present request.
            note: Subject, event → the story.
        """
        self.request: SchedulingRequest | None = None
        self.rcs: dict[str, str] = {}
        self.waits_since_s = clock.now_s()
        self.sending: asyncio.Task[None] | None = None
        self._sets: list[dict[str, str]] = []
        self._bus, self._clock, self._arc, self._changed, self._note = bus, clock, arc, changed, note

    def make(self, request: SchedulingRequest, sets: list[dict[str, str]]) -> None:
        """Create the request for one of these sets."""
        self.request, self._sets = request, sets

    def choose(self, rcs: Iterable[str]) -> None:
        """Record the set that the RC manager chose.

        Raises:
            NotMySet: The set is no alternative of the request.
        """
        self.rcs = set_of(self._arc, self._sets, rcs)

    def rc_of(self, role: str) -> str:
        """Return the name of the chosen RC of this role; empty if no RC is chosen."""
        return self.rcs.get(role, "")

    async def send(self) -> Scheduled:
        """Send the request, again if it was changed meanwhile, and return its place.

        Raises:
            Refusal: The RC manager refused the request.
            LinkError: The RC manager did not answer.
        """
        while True:
            request = self.request
            assert request is not None  # noqa: S101  made in connect
            scheduled = await ask_until_answered(
                self._bus,
                self._clock,
                RC_MANAGER,
                request,
                Scheduled,
                each_s=REQUEST_EACH_S,
                within_s=REQUEST_WITHIN_S,
            )
            if request == self.request:
                return scheduled

    async def withdraw_all(self) -> bool:
        """Withdraw the holds that the RC manager has on record; return False if it is gone: the next one asks."""
        gone = Withdraw(self._arc, "lease")
        try:
            await ask_until_answered(
                self._bus, self._clock, RC_MANAGER, gone, Done, each_s=RC_REPLY_S, within_s=REQUEST_WITHIN_S
            )
        except Refusal as unknown:  # the RC manager has restarted meanwhile
            log.info("not withdrawn: %s", unknown)
        except LinkError:
            return False
        return True

    async def withdraw(self) -> None:
        """Give the set back; without an answer its RCs are freed by the ARC's death, or when their leases expire."""
        if self.request is None:
            return
        try:
            await self._bus.ask(RC_MANAGER, Withdraw(self._arc, "self"), Done, within_s=RC_REPLY_S)
        except (LinkError, Refusal) as error:
            log.info("not withdrawn: %s", error)

    def current(self, epochs: Mapping[str, int], granted_s: float, extended_until_s: float) -> CurrentRequest:
        """Return the request, its holds and its extended slice, for the recovery of a restarted RC manager.

        Raises:
            UnknownRequest: There is no request yet.
        """
        if self.request is None:
            raise UnknownRequest(f"{self._arc} has no request yet")
        rcs = list(self.rcs.values())
        return CurrentRequest(self.request, rcs, dict(epochs), granted_s, self.waits_since_s, extended_until_s)

    def slice_ended(self, granted_s: float) -> None:
        """Take the last place in line, unless the slice that was granted then ended early."""
        now_s = self._clock.now_s()
        if self.request is not None and now_s >= granted_s + self.request.minimum_runtime_s:
            self.waits_since_s = now_s

    async def set_idle(self, idle: bool) -> None:
        """Stop or resume the request for run time; see ``_change``."""
        if self.request is not None and self.request.idle and not idle:
            self.waits_since_s = self._clock.now_s()
        await self._change(SetIdle(self._arc, idle), idle=idle)

    async def set_run_times(self, least_s: float, most_s: float) -> None:
        """Request slices of this length; see ``_change``.

        Raises:
            MissingRuntime: No slice can have these run times.
        """
        require_runtime(self._arc, least_s, most_s)
        change = ChangeRuntime(self._arc, least_s, most_s)
        await self._change(change, minimum_runtime_s=least_s, maximum_runtime_s=most_s)

    async def _change(self, wish: Message, **changed: bool | float) -> None:
        """Change the request; the present RC manager and later ones get the change.

        Raises:
            Refusal: The RC manager refused; the request is unchanged.
            LinkError: The RC manager did not answer. The change stays, and the next RC manager gets it.
        """
        request = self.request
        assert request is not None  # noqa: S101  made in connect
        before = {name: getattr(request, name) for name in changed}
        self.ask_by(changed)
        try:
            await self._bus.ask(RC_MANAGER, wish, Done, within_s=RC_REPLY_S)
        except Refusal:
            self.ask_by(before)
            raise

    def ask_by(self, changed: Mapping[str, bool | float]) -> None:
        """Change request and parameters together, so that the parameters show the present request."""
        assert self.request is not None  # noqa: S101  made in connect
        if self.sending is not None and not RUN_TIMES.isdisjoint(changed):
            self.sending.cancel()  # the run times under way are outdated
        self.request = msgspec.structs.replace(self.request, **changed)
        self._changed(changed)

    async def send_run_times(self) -> None:
        """Send the request's run times until the RC manager accepts or refuses them."""
        request = self.request
        assert request is not None  # noqa: S101  made in connect
        change = ChangeRuntime(self._arc, request.minimum_runtime_s, request.maximum_runtime_s)
        try:
            await ask_until_answered(
                self._bus, self._clock, RC_MANAGER, change, Done, each_s=RC_REPLY_S, within_s=REQUEST_WITHIN_S
            )
        except (Refusal, LinkError) as error:  # the next RC manager gets the run times with the request
            self._note(self._arc, f"the RC manager did not accept its run times: {error}")
