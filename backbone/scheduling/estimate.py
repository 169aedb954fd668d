"""Estimate: predicted starts of the ARCs of a large group, for people.

No turn depends on it. Source: decision 0011.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Sequence
from itertools import chain

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.planner import Hold, Slot
from backbone.scheduling.requests import RequestState
from backbone.scheduling.table import Table


def estimate(table: Table, order: Sequence[ArcEntry], now_s: float) -> list[Slot]:
    """Return the places of these ARCs, given in order."""
    return [
        Slot(arc, start_s, _against(table, arc, now_s))
        for arc, start_s in zip(order, starts_s(table, order, now_s), strict=True)
    ]


def starts_s(table: Table, order: Sequence[ArcEntry], now_s: float) -> list[float]:
    """Return the starts of these ARCs, given in order, if each RC serves one ARC after the other.

    Sharers of an RC are counted by their share of its time, not stream by stream.
    """
    ends_s: dict[str, float] = {}
    taken_s: dict[str, float] = {}
    all_equal = len({(arc.path[:-1], arc.path[-1][1]) for arc in order}) == 1
    exclusive: defaultdict[str, list[ArcEntry]] = defaultdict(list)
    sharers: defaultdict[str, list[ArcEntry]] = defaultdict(list)
    starts: list[float] = []
    for arc in order:
        if not table.usable(arc):
            starts.append(math.inf)
            continue
        crowded = [rc for rc in arc.shares if not table.has_room_for_all(rc)]
        alone = [rc for rc in arc.uses if rc not in arc.shares]
        start_s = now_s
        for rc in arc.uses:
            start_s = max(start_s, ends_s.get(rc, now_s))
        for rc in (*crowded, *alone) if taken_s else ():
            start_s = max(start_s, now_s + taken_s.get(rc, 0.0))
        for holder in table.holders(arc):
            release_s = 0.0 if holder.state is RequestState.REVOKING else holder.release_s
            free_s = table.stands_until_s(holder, arc, now_s) + release_s
            if free_s > start_s and not table.fits(arc, [holder]):
                start_s = free_s
        if not all_equal:
            before = chain(*[exclusive[rc] for rc in arc.uses], *[sharers[rc] for rc in alone])
            if any(one.goes_before(arc) for one in before):
                start_s = math.inf  # higher ARCs need not end once they run
            for rc in arc.uses:
                (sharers if rc in arc.shares else exclusive)[rc].append(arc)
        starts.append(start_s)
        if start_s < math.inf:
            for rc in alone:
                ends_s[rc] = start_s + arc.length_s + arc.release_s
            for rc in crowded:
                demanded = sum(one.packet_time_s / one.period_s for one in arc.uses[rc].streams)
                share = min(1.0, demanded / table.state.rcs[rc].capacity)
                taken_s[rc] = taken_s.get(rc, 0.0) + arc.length_s * share
    return starts


def _against(table: Table, arc: ArcEntry, now_s: float) -> list[Hold]:
    """Return the holders beside which the ARC cannot run; of a usable one those that stand beyond now."""
    holds = [
        (holder, -math.inf, table.stands_until_s(holder, arc, now_s))
        for holder in table.holders(arc)
        if not table.fits(arc, [holder])
    ]
    return [hold for hold in holds if hold[2] > now_s + INSTANT_S] if table.usable(arc) else holds
