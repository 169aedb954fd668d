"""Planner: works out whose turn it is in a group of ARCs, and when the others' will be (rule 3).

A planner reads the schedule and changes nothing. There are two: one plans a group whole, the other looks at each RC's
first in line; a mission file can name another class (``own_planner``). What both do is known as backfilling with
reservations: *conservative* backfilling reserves a start for every job that waits, the EASY kind for the first in line
only (Mu'alem and Feitelson, "Utilization, predictability, workloads, and user runtime estimates in scheduling the IBM
SP2 with backfilling", IEEE TPDS 12, 2001).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol

from backbone.scheduling.entries import ArcEntry
from backbone.scheduling.priority import higher

Hold = tuple[ArcEntry, float, float]
"""Who stands in the way as one other ARC sees it, from when (minus infinity: it holds its RCs) and until when."""


class Slot(NamedTuple):
    """The place the plan found for an ARC.

    Attributes:
        start_s: When its RCs begin to settle; infinite: never, as things are.
        against: Who shares an RC with it and stands in its way for a time.
    """

    arc: ArcEntry
    start_s: float
    against: Sequence[Hold]

    @property
    def end_s(self) -> float:
        """End of its minimum run time."""
        return self.start_s + self.arc.length_s


class Turn(NamedTuple):
    """An ARC whose time has come, and the holders that must go first (none: it connects)."""

    arc: ArcEntry
    in_the_way: Sequence[ArcEntry]


def in_order_of_revocation(turn: Turn) -> list[ArcEntry]:
    """Return the holders that must go; those whose slices are over before those that are overridden.

    What is freed by force must not look like the reason for the end of a slice.
    """
    return sorted(turn.in_the_way, key=lambda holder: higher(turn.arc.path, holder.path))


class Planner(Protocol):
    """Plans groups of one kind.

    Attributes:
        is_exact: True if each queued ARC has a reserved start; False if only the first in line at each RC has.
        reserves: True if a later start binds equals, too; else only ``ScheduleState.reserve`` keeps equals from what
            is being freed for an ARC.
    """

    @property
    def is_exact(self) -> bool:
        """See above."""

    @property
    def reserves(self) -> bool:
        """See above."""

    def look_near(self, rc: str) -> None:
        """Look anew at those for whom it matters that something about this RC changed."""

    def due(self, now_s: float) -> Turn | None:
        """Return an ARC whose time is now and who must go for it; None if there is none where it looks.

        Asked again after the turn was carried out, until there is none.
        """

    def forgotten(self, group: Sequence[ArcEntry], now_s: float) -> ArcEntry | None:
        """Return an ARC of the group whose time is now, wherever changes were; for checks."""

    def slots(self, group: Sequence[ArcEntry], now_s: float) -> list[Slot]:
        """Return the place of every queued ARC of the group, in order."""

    def slots_around(self, arc: ArcEntry, now_s: float) -> list[Slot]:
        """Return the places that must be known to predict the grant of a queued ARC, its own among them."""

    def start_s(self, arc: ArcEntry, now_s: float) -> float:
        """Return when the RCs of a queued ARC will begin to settle, as the decision being made sees it."""

    def before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return the queued ARCs that come before a queued one, in order."""

    def firsts_before(self, arc: ArcEntry) -> list[ArcEntry]:
        """Return who has the start reserved that the ARC waits for, where only the first in line has one."""
