"""The present slice of an ARC, and its extension by an owner that says "not now"."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus, Clock
from backbone.errors import LinkError, Refusal
from backbone.rc_manager.messages import Done, Extend
from resource_pool.gate import Gate
from resource_pool.messages import Noted, SliceEnds

ASK_BEFORE_END_S = 0.2  # chosen: question and answer take milliseconds, and the owner estimates better near the end
RC_REPLY_S = 0.8  # chosen: a robot RC itself gives the radio half a second


class ArcSlice:
    """When the present slice ends, as far as the ARC knows.

    Attributes:
        end_s: Mission time at which it may end.
        extended_until_s: Mission time until which the RC manager extended it; 0: not extended.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        gate: Gate,
        owner: str,
        *,
        longest_s: Callable[[], float],
        note: Callable[[str, str], object],
    ) -> None:
        """Create the record of an ARC without a slice.

        Args:
            bus: For questions to owner and RC manager.
            gate: The ARC's gate, which opens with the slice.
            owner: Address of its decision process.
            longest_s: The longest run time that the ARC asks for now, seconds.
            note: Subject, event → the story.
        """
        self.end_s = self.extended_until_s = 0.0
        self._bus, self._clock, self._gate, self._owner = bus, clock, gate, owner
        self._arc, self._longest_s, self._note = gate.arc, longest_s, note

    def begin(self, until_s: float) -> None:
        """Begin a slice that may end then."""
        self.end_s, self.extended_until_s = until_s, 0.0

    @property
    def longest_end_s(self) -> float:
        """Mission time until which the slice can be extended."""
        return self._gate.granted_s + self._longest_s()

    async def offer(self, resumed: asyncio.Event) -> None:
        """Ask the owner shortly before the end of its slice whether it needs more time, and request the extension.

        The owner is asked again before the end of an extension. It is not asked after the RC manager has ended the
        slice, because the RCs are then reserved for others.
        """
        await resumed.wait()
        while self.end_s < self.longest_end_s:
            ask_s = self.end_s - ASK_BEFORE_END_S
            if self._clock.now_s() < ask_s:
                await self._clock.sleep_until_s(ask_s)
                continue  # the slice may have been extended meanwhile
            wanted_s = await self._ask_whether_not_now()
            if not wanted_s > 0:
                return
            try:
                await self.extend(self.end_s + max(wanted_s, ASK_BEFORE_END_S))
            except (LinkError, Refusal) as error:
                self._note(self._arc, f"its slice was not extended: {error}")
                return

    async def _ask_whether_not_now(self) -> float:
        question = SliceEnds(self._arc, self.end_s, self.longest_end_s)
        within_s = ASK_BEFORE_END_S / self._clock.rate
        try:
            return (await self._bus.ask(self._owner, question, Noted, within_s=within_s)).wanted_s
        except (LinkError, Refusal) as error:
            self._note(self._owner, f"did not answer whether its slice may end: {error}")
            return 0.0

    async def extend(self, until_s: float) -> None:
        """Request the extension of the slice until this time, at most the maximum run time from the grant on."""
        until_s = min(until_s, self.longest_end_s)
        await self._bus.ask(RC_MANAGER, Extend(self._arc, until_s), Done, within_s=RC_REPLY_S)
        self.end_s = self.extended_until_s = max(self.end_s, until_s)
