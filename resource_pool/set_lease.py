"""Lease of an ARC's set: the gate may stay open as long as the RC manager renews all RCs of the set. Pure."""

from __future__ import annotations

from collections.abc import Mapping

from backbone.rc_manager.messages import Leases
from backbone.scheduling.requests import LEASE_S


class SetLease:
    """Leases of the set, as known to the ARC.

    Attributes:
        until_s: Mission time at which the lease of the open set expires.
    """

    def __init__(self, arc: str, rate: float) -> None:
        """Begin without a lease.

        Args:
            rate: Mission seconds per second of the machine.
        """
        self.until_s = 0.0
        self._arc, self._rate = arc, rate
        self._unfounded: dict[str, int] = {}
        self._unfounded_since_s = 0.0
        self._ended: Mapping[str, int] = {}
        self._ended_s = 0.0

    def begin(self, now_s: float) -> None:
        """Begin a lease with a connection."""
        self.until_s = now_s + LEASE_S * self._rate

    def end(self, epochs: Mapping[str, int], ordered_s: float) -> None:
        """End the lease of these epochs by an order of the RC manager.

        Args:
            epochs: RC → epoch of the ended connections.
            ordered_s: Mission time of the order.
        """
        self._ended, self._ended_s = epochs, ordered_s

    def heard(self, leases: Leases, at_s: float, epochs: Mapping[str, int]) -> bool:
        """Extend the lease if all RCs of the set were renewed; return whether the ARC must send its request again.

        That is the case if the RC manager has renewed, for a whole lease time, a hold that this ARC does not have: an
        earlier ARC of this name may have had it. For a shorter time the hold may be a connection that is about to open,
        unless it is the one that the ARC has just ended by order: a restarted RC manager does not know of that order.

        Args:
            leases: Leases that the RC manager renews.
            at_s: Mission time of the renewal.
            epochs: RC → epoch of the ARC's connections; empty: none.
        """
        renewed = {lease.rc: lease.epoch for lease in leases.leases if lease.arc == self._arc}
        if epochs and epochs.items() <= renewed.items():
            self.until_s = max(self.until_s, at_s + leases.lease_s)
        return self._is_doubtful(renewed if not epochs else {}, at_s)

    def _is_doubtful(self, unfounded: dict[str, int], now_s: float) -> bool:
        if unfounded and unfounded == self._ended and now_s > self._ended_s:
            self._ended = {}
            return True
        if unfounded != self._unfounded:
            self._unfounded, self._unfounded_since_s = unfounded, now_s
        elif unfounded and now_s - self._unfounded_since_s >= LEASE_S * self._rate:
            self._unfounded = {}
            return True
        return False
