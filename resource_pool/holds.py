"""Holds of an RC: epochs only grow, a unit RC has at most one holder, a hold lasts as long as its lease.

Rules of this file: pure; time is an argument; no bus. The RC's loop reports events and carries out the results.

Source: RAM 2002, "The RC Scheduler"; fencing by epoch after ARCHITECTURE's rules 2 and 3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from backbone.rc_manager.messages import Held, StaleEpoch
from backbone.scheduling.requests import RcUse


@dataclass(frozen=True, slots=True)
class Hold:
    """One ARC's connection to the RC.

    Attributes:
        lease_until_s: Mission time at which it ends unless renewed.
        use: The ARC's use of the RC.
        companions: The other RCs of the set with their epochs.
        rank: Place among the holders by user priority, 0 first.
    """

    arc: str
    epoch: int
    since_s: float
    lease_until_s: float
    use: RcUse = field(default_factory=RcUse)
    companions: Mapping[str, int] = field(default_factory=dict)
    rank: int = 0


class HoldTable:
    """The holds of one RC.

    Args:
        rc: Name of the RC, for refusals.
        last_epoch: Largest known epoch; epochs up to it are stale.
    """

    def __init__(self, rc: str, *, sharable: bool, last_epoch: int) -> None:
        self._rc, self._sharable, self.last_epoch = rc, sharable, last_epoch
        self._holds: dict[str, Hold] = {}

    def holds(self) -> list[Hold]:
        """Return all holds, higher user priority first."""
        return sorted(self._holds.values(), key=lambda hold: (hold.rank, hold.arc))

    def connect(self, hold: Hold) -> None:
        """Connect the ARC.

        Raises:
            StaleEpoch: The epoch is not larger than all earlier ones.
            Held: Another ARC holds this unit RC.
        """
        self.check(hold)
        self.last_epoch = hold.epoch
        self._holds[hold.arc] = hold

    def check(self, hold: Hold) -> Hold | None:
        """Check a connection without making it; return the ARC's present hold, which the connection would replace.

        Raises:
            StaleEpoch: As for ``connect``.
            Held: As for ``connect``.
        """
        if hold.epoch <= self.last_epoch:
            raise StaleEpoch(
                f"{self._rc}: epoch {hold.epoch} of {hold.arc} is not after {self.last_epoch}",
                epoch=hold.epoch,
                last_epoch=self.last_epoch,
            )
        others = [other for other in self._holds if other != hold.arc]
        if others and not self._sharable:
            raise Held(f"{self._rc} is held by {others[0]}", holder=others[0])
        return self._holds.get(hold.arc)

    def find(self, arc: str, epoch: int) -> Hold | None:
        """Return the ARC's present hold, if it has this epoch."""
        hold = self._holds.get(arc)
        return hold if hold is not None and hold.epoch == epoch else None

    def has(self, arc: str, epoch: int) -> bool:
        """Return whether the ARC holds the RC under this epoch."""
        return self.find(arc, epoch) is not None

    def has_lost(self, arc: str, epoch: int) -> bool:
        """Return whether this hold has ended: its epoch is not new, and the ARC does not hold the RC under it."""
        return epoch <= self.last_epoch and not self.has(arc, epoch)

    def disconnect(self, arc: str, epoch: int) -> Hold | None:
        """End the ARC's hold if its epoch is this one or older; return the ended hold."""
        self.last_epoch = max(self.last_epoch, epoch)
        hold = self._holds.get(arc)
        if hold is None or hold.epoch > epoch:
            return None
        return self._holds.pop(arc)

    def admit(self, arc: str, epoch: int, now_s: float) -> Hold:
        """Return the hold that admits this command.

        Raises:
            StaleEpoch: The ARC does not hold the RC under this epoch, or no longer: its lease is over.
        """
        hold = self._holds.get(arc)
        if hold is None or hold.epoch != epoch or hold.lease_until_s <= now_s:
            present = "no connection" if hold is None else f"epoch {hold.epoch}"
            if hold is not None and hold.epoch == epoch:
                present = "it, but its lease is over"
            raise StaleEpoch(
                f"{self._rc}: {arc} commands under epoch {epoch}, it has {present}",
                epoch=epoch,
                last_epoch=self.last_epoch,
            )
        return hold

    def renew(self, arc: str, epoch: int, until_s: float, rank: int = -1) -> bool:
        """Renew the hold of this epoch at least until this time, with this rank unless it is negative.

        Returns:
            Whether the ARC has such a hold.
        """
        hold = self._holds.get(arc)
        if hold is None or hold.epoch != epoch:
            return False
        self._holds[arc] = replace(
            hold, lease_until_s=max(until_s, hold.lease_until_s), rank=hold.rank if rank < 0 else rank
        )
        return True

    def expire(self, now_s: float) -> list[Hold]:
        """End and return the holds whose leases have expired."""
        over = [hold for hold in self._holds.values() if hold.lease_until_s <= now_s]
        for hold in over:
            del self._holds[hold.arc]
        return over

    def next_expiry_s(self) -> float | None:
        """Return the time at which the next lease expires; None without a hold."""
        return min((hold.lease_until_s for hold in self._holds.values()), default=None)
