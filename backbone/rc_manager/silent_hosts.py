"""Hosts of RCs that do not answer, because a slow link or a full processor looks like a fault of the RC.

The watch over the RCs asks the creator of such an RC's host for the load, and measures the round trip. If the creator
answers late or not at all, or the processor is full, the remedy of the RC names this cause.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.creator.messages import AskLoad, HostLoad, creator_name
from backbone.errors import LinkError, Refusal
from backbone.nameserver.messages import Resolve, Resolved
from backbone.naming import Subsystem, address

LONG_S = 0.1  # chosen: from this round trip on, the RCs of a host need a longer time to disconnect
MEASURED_WITHIN_S = 2.0  # chosen: a link without any message for this time counts as cut
MEASURED_EVERY_S = 1.0  # chosen: on a full processor many RCs of one host are silent, and each question costs time
GRANTED_BELOW_S = 0.3  # chosen: a grant needs three messages across the link, in the second that an ARC has to open
FULL = 0.9  # chosen: over a second, so that a component mostly waits until others let it run


@dataclass(frozen=True, slots=True)
class _Measured:
    host: str
    round_trip_s: float | None = None
    cpu: float = 0.0


class SilentHosts:
    """Round trips to the hosts of silent RCs and the load of these hosts, as last measured.

    Args:
        own_host: Host of the RC manager, to which no link leads.
    """

    def __init__(self, bus: Bus, clock: Clock, own_host: str) -> None:
        self._bus, self._clock, self._own_host = bus, clock, own_host
        self._host_of: dict[str, str] = {}
        self._measured: dict[str, _Measured] = {}
        self._asked_s: dict[str, float] = {}

    async def measure(self, rc: str) -> None:
        """Measure the round trip to the creator of the RC's host, and ask it for the load.

        RCs of one host share a measurement for ``MEASURED_EVERY_S``.
        """
        try:
            found = await self._bus.ask(NAMESERVER, Resolve(rc), Resolved, within_s=MEASURED_WITHIN_S)
        except (LinkError, Refusal):  # it is gone: its absence has other causes
            self.forget(rc)
            return
        host, now_s = found.component.host, self._clock.now_s()
        self._host_of[rc] = host
        if now_s - self._asked_s.get(host, -math.inf) < MEASURED_EVERY_S * self._clock.rate:
            return
        self._asked_s[host] = now_s
        self._measured[host] = await self._ask(host, now_s)

    def forget(self, name: str) -> None:
        """Forget what was measured for this component."""
        self._host_of.pop(name, None)

    async def _ask(self, host: str, asked_s: float) -> _Measured:
        creator = address(Subsystem.BACKBONE, creator_name(host))
        try:
            cpu = (await self._bus.ask(creator, AskLoad(), HostLoad, within_s=MEASURED_WITHIN_S)).cpu
        except Refusal:  # an answer, too, of a creator that ends
            cpu = 0.0
        except LinkError:
            return _Measured(host)
        return _Measured(host, (self._clock.now_s() - asked_s) / self._clock.rate, cpu)

    def remedy(self, rc: str) -> str:
        """Return the remedy for an RC on a full host, or behind a slow or silent link; empty: neither is the cause."""
        measured = self._measured.get(self._host_of.get(rc, ""))
        if measured is None:
            return ""
        if measured.cpu >= FULL:
            return f"run less on {measured.host}: {measured.cpu:.0%} of its processor time is used, so answers are late"
        return self._remedy_of_link(measured) if measured.host != self._own_host else ""

    def _remedy_of_link(self, measured: _Measured) -> str:
        if measured.round_trip_s is None:
            return f"check the link to {measured.host}: its creator does not answer either"
        if measured.round_trip_s < LONG_S:
            return ""
        return (
            f"check the link to {measured.host}: a round trip takes {measured.round_trip_s:.2f} s, and above "
            f"{GRANTED_BELOW_S:g} s the RCs there cannot be granted reliably"
        )
