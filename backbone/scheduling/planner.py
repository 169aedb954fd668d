"""Planner: finds the ARC of a group whose turn it is, and the start times of the others (rule 3).

A planner reads the schedule and changes nothing. There are two: one plans a group whole, the other examines the first
ARC in line at each RC. A mission file can name another class (``own_planner``). Both backfill with reservations:
*conservative* backfilling reserves a start for every job that waits, the EASY kind for the first in line only (Mu'alem
and Feitelson, "Utilization, predictability, workloads, and user runtime estimates in scheduling the IBM SP2 with
backfilling", IEEE TPDS 12, 2001).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from backbone.scheduling.entries import ArcEntry

Hold = tuple[ArcEntry, float, float]
"""An obstacle to another ARC: the ARC, the begin of its time (minus infinity: it holds its RCs) and the end."""


class Slot(NamedTuple):
    """The planned place of an ARC.

    Attributes:
        start_s: Time at which its RCs begin to settle; infinite: never in the present state.
        against: ARCs at a common RC that prevent an earlier start.
    """

    arc: ArcEntry
    start_s: float
    against: Sequence[Hold]

    @property
    def end_s(self) -> float:
        """End of its minimum run time."""
        return self.start_s + self.arc.length_s


class Turn(NamedTuple):
    """An ARC whose time has come, and the holders to revoke first; without holders, it connects."""

    arc: ArcEntry
    in_the_way: Sequence[ArcEntry]


def in_order_of_revocation(turn: Turn) -> list[ArcEntry]:
    """Return the holders to revoke, ended slices before preempted ones.

    A preemption must not look like the reason for the end of another slice.
    """
    return sorted(turn.in_the_way, key=turn.arc.goes_before)


class Planner(Protocol):
    """Plans groups of one kind.

    Attributes:
        is_exact: True if each queued ARC has a reserved start; False if only the first in line at each RC has.
        reserves: True if a later start binds equals, too; else only ``ScheduleState.reserve`` keeps equals from
            RCs that are being freed for an ARC.
    """

    @property
    def is_exact(self) -> bool:
        """Whether each queued ARC has a reserved start."""

    @property
    def reserves(self) -> bool:
        """Whether a later start binds equals, too."""

    def look_near(self, rc: str, joined: Sequence[ArcEntry]) -> None:
        """Examine, in the next decision, the ARCs that a change of this RC concerns.

        Args:
            joined: The ARCs that began to wait there, if nothing else changed; else empty.
        """

    def due(self, now_s: float) -> Turn | None:
        """Return an ARC whose time is now and the holders to revoke for it; None if it finds none.

        The caller calls it again after carrying out the turn, until it returns None.
        """

    def forgotten(self, group: Sequence[ArcEntry], now_s: float) -> ArcEntry | None:
        """Return an ARC of the group whose time is now, even if nothing has changed; for checks."""

    def slots(self, group: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return the place of every queued ARC of the group, in order."""

    def slots_around(self, arc: ArcEntry, now_s: float) -> list[Slot]:
        """Return the places from which the grant of a queued ARC is predicted, its own among them."""

    def start_s(self, arc: ArcEntry, now_s: float) -> float:
        """Return when the RCs of a queued ARC will begin to settle, as of the present decision."""

    def before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the queued ARCs that come before a queued one, in order."""

    def firsts_before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the ARCs whose reserved starts the ARC waits for, if only the first in line at an RC has one."""
