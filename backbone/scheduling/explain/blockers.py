"""Blockers: who would have to go so that a waiting ARC gets its RCs as soon as those are free.

Two answers to two questions. Who stands *directly* in the way is told by the plan at once, for every
request in the schedule. Who must go *altogether* also counts those that would come before the ARC if
the first ones were gone; it costs a plan for each of them, and is worked out for one ARC when somebody asks.

Rule of this file: it errs towards naming one too many, never one too few.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Iterator, Sequence

from backbone.scheduling.entries import CONNECTED, HOLDING, INSTANT_S, ArcEntry
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.plan import Slot, meeting
from backbone.scheduling.priority import higher, rank
from backbone.scheduling.requests import RequestState

FEWEST_OF = 24  # chosen: each costs one more plan; more than these are named as they are
MEANWHILE_OF = 64  # chosen: so many are planned in a few milliseconds


def direct(table: MasterSchedule, slot: Slot, now_s: float) -> list[ArcEntry]:
    """Return who stands in the way of the planned ARC now, or has reserved time it would need, first in order first.

    Of a group too big to be planned whole: who stands in its way and who is first in line before it.
    """
    arc = slot.arc
    met = [*dict.fromkeys(other for other, _, _ in meeting(slot.against, now_s, now_s + arc.length_s))]
    if not table.planned_whole(arc):
        met += [first for first in table.firsts_before(arc) if first not in met]
    alone = [other for other in met if not table.fits(arc, [other])]
    if not met and table.strict:
        return [*itertools.islice(_higher_ones(table, arc), 1)]
    if not met and not table.planned_whole(arc):
        return table.before(arc)[:1]
    return alone or met


def altogether(table: MasterSchedule, arc: ArcEntry, now_s: float, *, grace_s: float) -> list[ArcEntry]:
    """Return ARCs without which this one starts as soon as its RCs are free, as few as were found.

    If an RC of it is down or has too little capacity: what is in its way once that is not so any more.

    Args:
        table: The master schedule; nothing in it changes.
        arc: A waiting ARC.
        now_s: Time of the question.
        grace_s: Time a decision process has to stop cleanly at the end of a slice.

    Returns:
        In the order in which to remove them; nobody if only RCs settle or come free.
    """
    held, rivals = _holders_in_the_way(table, arc, now_s), _rivals(table, arc)
    left = {*table.left_over(arc, [], [*held, *(one for one in rivals if one.touches & arc.touches)])}
    found = [one for one in dict.fromkeys([*held, *rivals]) if one in left or _held_back_by(one, arc, table)]
    if table.planned_whole(arc) and table.usable(arc) and table.discipline == "turns" and len(found) <= FEWEST_OF:
        group = [one for one in table.group_of(arc) if one.holds or one is arc or one in rivals]
        for other in reversed(found):
            fewer = [one for one in found if one is not other]
            if _starts_without(fewer, table, arc, group, now_s, grace_s):
                found = fewer
    while meanwhile := _starting_meanwhile(found, table, arc, now_s):
        found = [*meanwhile, *found]
    return found


def _held_back_by(one: ArcEntry, arc: ArcEntry, table: MasterSchedule) -> bool:
    return table.strict and one.state is not RequestState.RUNNING and higher(one.path, arc.path)


def _starting_meanwhile(gone: Sequence[ArcEntry], table: MasterSchedule, arc: ArcEntry, now_s: float) -> list[ArcEntry]:
    """Return who would start in the way of the ARC when only the first of those that have to go are gone."""
    group = table.group_of(arc) if table.planned_whole(arc) else [arc, *table.beside(arc)]
    if len(group) > MEANWHILE_OF:
        return []
    found: dict[ArcEntry, None] = {}
    for count in range(1, len(gone) + (not table.usable(arc))):
        rest = [one for one in group if one not in gone[:count]]
        slow = [one for one in [*gone[:count], *rest] if one.state in HOLDING and one.release_s > 0]
        for slot in table.plan(rest, now_s, handed_over=True):
            other = slot.arc
            if slot.start_s > now_s + INSTANT_S or other is arc or other in gone or higher(arc.path, other.path):
                continue
            waits_for_release = any(
                one.touches & other.touches and (one in gone or one.state is RequestState.REVOKING) for one in slow
            )
            if not waits_for_release and not table.fits(arc, [other]):
                found[other] = None
    return [*found]


def _holders_in_the_way(table: MasterSchedule, arc: ArcEntry, now_s: float) -> list[ArcEntry]:
    """Return the holders of its RCs that it cannot simply displace now."""
    return [holder for holder in table.holders(arc) if _stays(table, holder, arc, now_s)]


def _stays(table: MasterSchedule, holder: ArcEntry, arc: ArcEntry, now_s: float) -> bool:
    if table.discipline == "time" and not rank(holder.path, arc.path):
        return True  # whether its slice is ended for this one depends on more than time
    return table.stands_until_s(holder, arc, now_s) > now_s + INSTANT_S


def _rivals(table: MasterSchedule, arc: ArcEntry) -> list[ArcEntry]:
    """Return who waits and could take RCs before the ARC once the ARC could use them, too."""
    down = {rc for rc in arc.uses if not table.rcs[rc].up}
    rivals = table.before(arc)
    if table.discipline == "time":  # equals reserve nothing from each other: also who comes later may be quicker
        equals = [one for one in table.beside(arc) if one.queued and not higher(arc.path, one.path)]
        rivals = [*dict.fromkeys([*rivals, *equals])]
    else:
        rivals += [one for one in _older_equals(table, arc) if one not in rivals]
    if not table.strict:
        rivals = [one for one in rivals if one.touches & arc.touches]
    if down or not table.usable(arc):
        return [one for one in rivals if all(table.rcs[rc].up or rc in down for rc in one.uses)]
    return [one for one in rivals if table.usable(one)]


def _older_equals(table: MasterSchedule, arc: ArcEntry) -> list[ArcEntry]:
    """Return equals that are behind the ARC only as long as somebody waits who is higher than they are."""
    return [one for one in table.beside(arc) if one.queued and one.stamp < arc.stamp and not rank(one.path, arc.path)]


def _higher_ones(table: MasterSchedule, arc: ArcEntry) -> Iterator[ArcEntry]:
    """Return who is higher and waits in its group."""
    for other in table.group_of(arc):
        if other.state is RequestState.WAITING and higher(other.path, arc.path) and table.usable(other):
            yield other


def _starts_without(
    gone: Collection[ArcEntry],
    table: MasterSchedule,
    arc: ArcEntry,
    group: Sequence[ArcEntry],
    now_s: float,
    grace_s: float,
) -> bool:
    """Say whether the ARC would start after one hand-over if these were gone, whatever that takes of its time."""
    rest = [other for other in group if other not in gone]
    sharing = [other for other in rest if other is not arc and other.holds and other.touches & arc.touches]
    if any(_stays(table, h, arc, now_s) and h.state in CONNECTED and not table.fits(arc, [h]) for h in sharing):
        return False
    release_s = max((other.release_s for other in [*gone, *sharing] if other.holds), default=0.0)
    latest_s = now_s + release_s + grace_s
    for handed_over in (True, False):
        slots = table.plan(rest, now_s, handed_over=handed_over, slack_s=0.0)
        own = next(slot for slot in slots if slot.arc is arc)
        if own.start_s > latest_s + INSTANT_S or not _fits_throughout(table, own, now_s, latest_s + arc.length_s):
            return False
        starting = {slot.arc for slot in slots if slot.start_s <= now_s + INSTANT_S and slot.arc is not arc}
        order = table.in_order([slot.arc for slot in slots if slot.arc not in starting])
        before = table.before(arc)
        overtaking = [one for one in order[: order.index(arc)] if starting and one not in before]
        if any(not table.fits(arc, [one]) for one in overtaking):
            return False  # who held them back starts as well, and then they come before the ARC
        others = [slot for slot in slots if table.strict and slot.start_s > now_s + INSTANT_S]
        if any(slot.arc is not arc and higher(slot.arc.path, arc.path) for slot in others):
            return False
    return True


def _fits_throughout(table: MasterSchedule, slot: Slot, start_s: float, end_s: float) -> bool:
    """Say whether the ARC fits beside all who meet this span, but for those that only come free."""
    met = [hold for hold in meeting(slot.against, start_s, end_s) if hold[0].state is not RequestState.REVOKING]
    reserved = [hold for hold in slot.against if hold[0].state is RequestState.REVOKING and hold[1] > start_s]
    met += meeting(reserved, start_s, end_s)
    moments = dict.fromkeys([start_s, *(begin_s for _, begin_s, _ in met if begin_s > start_s)])
    return all(
        table.fits(slot.arc, [one for one, begin_s, over_s in met if begin_s <= moment_s + INSTANT_S < over_s])
        for moment_s in moments
    )
