"""Links to the hosts of RCs that do not answer, because a slow link looks like a fault of the RC.

The watch over the RCs measures the round trip to the creator of such an RC's host. If it is long, or the creator does
not answer either, the remedy of the RC names the link.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.messages import AskTime, MissionTime
from backbone.creator.messages import creator_name
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import Resolve, Resolved
from backbone.naming import Subsystem, address

LONG_S = 0.1  # chosen: from this round trip on, the RCs of a host need a longer time to disconnect
MEASURED_WITHIN_S = 2.0  # chosen: a link without any message for this time counts as cut
GRANTED_BELOW_S = 0.3  # chosen: a grant needs three messages across the link, in the second that an ARC has to open


@dataclass(frozen=True, slots=True)
class _Measured:
    host: str
    round_trip_s: float | None


class HostLinks:
    """Round trips to the hosts of RCs, as last measured.

    Args:
        own_host: Host of the RC manager, to which no link leads.
    """

    def __init__(self, bus: Bus, clock: Clock, own_host: str) -> None:
        self._bus, self._clock, self._own_host = bus, clock, own_host
        self._measured: dict[str, _Measured] = {}

    async def measure(self, rc: str) -> None:
        """Measure the round trip to the creator of the RC's host."""
        self._measured.pop(rc, None)
        try:
            found = await self._bus.ask(NAMESERVER, Resolve(rc), Resolved, within_s=MEASURED_WITHIN_S)
        except (LinkError, Refusal):  # it is gone: its absence has other causes
            return
        host = found.component.host
        if host == self._own_host:
            return
        asked_s, creator = self._clock.now_s(), address(Subsystem.BACKBONE, creator_name(host))
        round_trip_s = None
        with suppress(LinkError):
            with suppress(Refusal):  # a refusal is an answer, too
                await self._bus.ask(creator, AskTime(), MissionTime, within_s=MEASURED_WITHIN_S)
            round_trip_s = (self._clock.now_s() - asked_s) / self._clock.rate
        self._measured[rc] = _Measured(host, round_trip_s)

    def remedy(self, rc: str) -> str:
        """Return the remedy for an RC behind a slow or silent link; empty: its link is not the cause."""
        measured = self._measured.get(rc)
        if measured is None:
            return ""
        if measured.round_trip_s is None:
            return f"check the link to {measured.host}: its creator does not answer either"
        if measured.round_trip_s < LONG_S:
            return ""
        return (
            f"check the link to {measured.host}: a round trip takes {measured.round_trip_s:.2f} s, and above "
            f"{GRANTED_BELOW_S:g} s the RCs there cannot be granted reliably"
        )
