"""Preemption: the holders that must yield to an ARC, or because an RC can give less (rules 4, 5 and 11).

Rules of this file (numbers as in docs and ``why``); nothing changes:

* 4  Lower holders, and served equal ones, are displaced for the ARC whose time has come, but no more than necessary.
* 5  Of equals whose slices are over, the one that was granted first is revoked first.
* 8  Under ``strict`` no ARC starts while a higher usable one of its group waits.
"""

from __future__ import annotations

from collections.abc import Sequence
from operator import attrgetter

from backbone.scheduling.entries import CONNECTED, INSTANT_S, ArcEntry
from backbone.scheduling.precedence import by_precedence
from backbone.scheduling.priority import rank_of
from backbone.scheduling.requests import RequestState
from backbone.scheduling.table import Table

_PATH = attrgetter("path")


def must_let_higher_go_first(table: Table, arc: ArcEntry) -> bool:
    """Return whether the policy ``strict`` holds the ARC back because a higher usable ARC of its group waits."""
    return table.strict and any(
        other.state is RequestState.WAITING and other.goes_before(arc) and table.usable(other)
        for other in table.state.groups.of[arc].arcs
    )


def in_the_way(
    table: Table, arc: ArcEntry, pending: Sequence[ArcEntry], group: Sequence[ArcEntry], now_s: float
) -> list[ArcEntry]:
    """Return the holders to revoke so that the ARC can start, no more than necessary.

    Lower ones are revoked first, the last in order before the others; then equals whose slices are over, the one
    granted first before the others (rule 5). So each of several equals on a sharable RC stays for the same number of
    slices.

    ARCs that only wait for RCs that are being freed (``pending``) count as started. Otherwise they would get this room
    a moment later, and both would displace each other again and again.
    """
    holders = [holder for holder in group if holder.state in CONNECTED and holder.touches & arc.touches]
    movable = [holder for holder in holders if table.stands_until_s(holder, arc, now_s) <= now_s + INSTANT_S]
    staying = [holder for holder in holders if holder not in movable] + [p for p in pending if p.touches & arc.touches]
    equals = [holder for holder in movable if holder.level is arc.level or not rank_of(holder, arc)]
    return left_over(table, arc, staying, [holder for holder in movable if holder not in equals], equals)


def left_over(
    table: Table,
    arc: ArcEntry,
    staying: Sequence[ArcEntry],
    movable: Sequence[ArcEntry],
    served: Sequence[ArcEntry] = (),
) -> list[ArcEntry]:
    """Return the holders that do not fit beside the ARC and the staying ones, the last in order first.

    Args:
        table: Questions about the schedule.
        arc: The ARC that starts.
        staying: Holders that stay.
        movable: The other holders; the first in order stay if they fit.
        served: Equals whose slices are over; they stay before ``movable`` ones if they fit, the latest grant first.
    """
    kept, left = list(staying), []
    latest = by_precedence(served, _PATH, lambda holder: (-holder.granted_s, -holder.stamp[0], -holder.stamp[1]))
    for holder in (*latest, *table.in_order(movable)):
        if table.fits(arc, [*kept, holder]):
            kept.append(holder)
        else:
            left.append(holder)
    return left[::-1]


def overloading(table: Table, rc: str) -> list[ArcEntry]:
    """Return the holders that the RC cannot serve beside those before them in order, the last first."""
    holders = [h for h in table.state.arcs.values() if h.state in CONNECTED and rc in h.uses]
    kept: list[ArcEntry] = []
    left: list[ArcEntry] = []
    for holder in table.in_order(holders):
        (kept if table.state.compatibility.can_share(rc, [*kept, holder]) else left).append(holder)
    return left[::-1]


def understating(table: Table, rc: str, joining: Sequence[ArcEntry] = ()) -> list[ArcEntry]:
    """Return the connected ARCs that must request again, so that the RC serves the rest by measured packet times.

    Only ARCs whose packets take longer than their requests state, the last in order first, no more than necessary.

    Args:
        joining: An ARC that is about to be connected; empty: none.
    """
    kept = [holder for holder in table.state.rcs[rc].holders if holder.state in CONNECTED] + [*joining]
    asked: list[ArcEntry] = []
    for holder in table.in_order([one for one in kept if one.understates and one not in joining])[::-1]:
        if table.state.compatibility.serves_measured(rc, kept):
            break
        kept.remove(holder)
        asked.append(holder)
    return asked
