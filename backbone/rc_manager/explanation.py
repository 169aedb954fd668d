"""Explanation: the state of the master schedule in sentences, with the rule that decides.

Rule of this file: it reads, it never changes; and it asks the same plan that decides, so that what
it says is what will happen if nothing else does.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from backbone.naming import component_of
from backbone.rc_manager.master_schedule import ArcEntry, MasterSchedule, RcEntry, Slot
from backbone.rc_manager.messages import (
    LEASE_S,
    Holder,
    RcView,
    RequestState,
    RequestView,
    Schedule,
    Scheduled,
    UnknownRequest,
    Why,
)
from backbone.rc_manager.priority import higher

UNKNOWN_S = -1.0

_REASONS = {
    "slice": "its slice was over and it was the turn of {by}",
    "higher": "{by} is higher and took over",
    "rc": "{by} does not answer",
    "capacity": "{by} can give less than before",
    "order": "{by} could not serve all its holders in time in their new order",
    "failed": "it could not open its gate",
    "self": "its owner wanted no time any more",
}


class Explanation:
    """Answers about one master schedule."""

    def __init__(self, table: MasterSchedule) -> None:
        self._table = table

    # Views.

    def scheduled(self, arc: ArcEntry, now_s: float) -> Scheduled:
        """Return the place of one request."""
        slots = self._slots_beside(arc, now_s)
        slot = next((slot for slot in slots if slot.arc is arc), None)
        return Scheduled(
            rcs=list(arc.uses),
            state=arc.state,
            position=slots.index(slot) + 1 if slot is not None else 0,
            blockers=[other.name for other in self._table.blockers(slot, now_s)] if slot is not None else [],
            expected_start_s=self._expected_s(arc, slot),
        )

    def schedule(self, now_s: float) -> Schedule:
        """Return the whole schedule."""
        groups = self._table.groups()
        slots = {slot.arc.name: slot for group in groups for slot in self._table.slots(group, now_s)}
        arcs = list(self._table.arcs.values())
        return Schedule(
            at_s=now_s,
            rcs=[self._rc_view(rc, arcs, list(slots.values()), now_s) for rc in self._table.rcs.values()],
            requests=[self._request_view(arc, slots.get(arc.name), now_s) for arc in arcs],
            groups=[[arc.name for arc in group] for group in groups],
        )

    def _rc_view(self, rc: RcEntry, arcs: Sequence[ArcEntry], slots: Sequence[Slot], now_s: float) -> RcView:
        following = sorted(
            (slot for slot in slots if rc.name in slot.arc.uses and slot.start_s < math.inf), key=lambda s: s.start_s
        )
        return RcView(
            rc=rc.name,
            kind=rc.kind,
            state="up" if rc.up else "down",
            sharable=rc.sharable,
            capacity=rc.capacity,
            holders=[
                Holder(arc.name, arc.epochs[rc.name], arc.since_s, now_s + LEASE_S)
                for arc in arcs
                if rc.name in arc.epochs
            ],
            last_epoch=rc.epoch,
            next=[slot.arc.name for slot in following],
        )

    def _request_view(self, arc: ArcEntry, slot: Slot | None, now_s: float) -> RequestView:
        why = self._why_arc(arc, slot, now_s)
        return RequestView(
            arc=arc.name,
            owner=arc.request.owner,
            state=arc.state,
            rcs=list(arc.uses),
            since_s=arc.since_s,
            until_s=self._until_s(arc),
            expected_start_s=why.expected_start_s if arc.state is not RequestState.RUNNING else UNKNOWN_S,
            because=why.lines[0],
            blockers=why.blockers,
            minimum_runtime_s=arc.minimum_s,
            priority="/".join(f"{name}:{number}" for name, number in arc.path),
            turns=arc.turns,
        )

    # Why.

    def why(self, name: str, now_s: float) -> Why:
        """Return the reasons for an ARC, an owner or an RC.

        Raises:
            UnknownRequest: There is none of this name.
        """
        if name in self._table.arcs:
            arc = self._table.arcs[name]
            return self._why_arc(arc, self._table.slot_of(arc, now_s), now_s)
        owned = [
            arc for arc in self._table.arcs.values() if name in (arc.request.owner, component_of(arc.request.owner))
        ]
        if owned:
            return self._why_owner(name, owned, now_s)
        if name in self._table.rcs:
            return self._why_rc(self._table.rcs[name], now_s)
        raise UnknownRequest(f"nothing named {name!r} asks for run time, and no RC is named so", name=name)

    def _why_owner(self, name: str, owned: Sequence[ArcEntry], now_s: float) -> Why:
        """Return the reasons for all its ARCs; state and rule are those of the one that waits longest."""
        answers = [self._why_arc(arc, self._table.slot_of(arc, now_s), now_s) for arc in owned]
        first = min(answers, key=lambda why: (why.state != RequestState.WAITING, why.name))
        return Why(
            name=name,
            state=first.state,
            lines=[line for answer in answers for line in answer.lines],
            rule=first.rule,
            blockers=first.blockers,
            expected_start_s=first.expected_start_s,
            would_change=first.would_change,
        )

    def _why_rc(self, rc: RcEntry, now_s: float) -> Why:
        users = [arc for arc in self._table.arcs.values() if rc.name in arc.uses]
        holders = [arc for arc in users if arc.holds]
        slots = [self._table.slot_of(arc, now_s) for arc in users if arc.queued]
        coming = sorted((slot for slot in slots if slot is not None), key=lambda slot: slot.start_s)
        lines = [f"{rc.name} is {'up' if rc.up else 'down' if rc.failed else 'not started'}"]
        lines += [f"{arc.name} holds it: {self._where(arc, now_s)}" for arc in holders]
        lines += [
            f"{slot.arc.name} gets it at {_at(slot.start_s)}"
            if slot.start_s < math.inf
            else f"{slot.arc.name} waits for it without a predicted time"
            for slot in coming
        ]
        if not holders and not coming:
            lines.append("nobody asks for it")
        return Why(
            name=rc.name,
            state="held" if holders else "free" if rc.up else "down",
            lines=lines,
            rule="11" if not rc.up else "3",
            blockers=[arc.name for arc in holders],
            expected_start_s=next((s.start_s for s in coming if s.start_s < math.inf), UNKNOWN_S),
            would_change="its process answers again" if not rc.up else "a request, or the end of one, that names it",
        )

    def _why_arc(self, arc: ArcEntry, slot: Slot | None, now_s: float) -> Why:
        match arc.state:
            case RequestState.WAITING:
                lines, rule, would_change = self._waits(arc, slot, now_s)
            case RequestState.RUNNING:
                lines, rule, would_change = self._runs(arc, now_s)
            case RequestState.CONNECTING:
                settled_s = arc.began_s + arc.settle_s
                lines = [f"its RCs are being connected since {_at(arc.began_s)}, settled at {_at(settled_s)}"]
                rule, would_change = "6", "its RCs settle, or a higher ARC asks"
            case RequestState.REVOKING:
                lines = [f"its RCs are being disconnected since {_at(arc.since_s)}: {_reason(arc)}"]
                rule, would_change = "6", "its RCs are free"
            case RequestState.IDLE if arc.retry_s is not None:
                lines = [f"it could not open its gate and is asked again at {_at(arc.retry_s)}"]
                rule, would_change = "6", "its gate opens"
            case RequestState.IDLE:
                lines = [f"it wants no time since {_at(arc.since_s)}"]
                rule, would_change = "14", "its owner wants time again"
        blockers = self._table.blockers(slot, now_s) if slot is not None else []
        return Why(
            name=arc.name,
            state=arc.state,
            lines=[f"{arc.name} {arc.state}: {lines[0]}", *lines[1:]],
            rule=rule,
            blockers=[other.name for other in blockers],
            expected_start_s=self._expected_s(arc, slot),
            would_change=would_change,
        )

    def _waits(self, arc: ArcEntry, slot: Slot | None, now_s: float) -> tuple[list[str], str, str]:
        age = f"since {_at(arc.since_s)} ({now_s - arc.since_s:.1f} s)"
        past = [f"it lost its RCs last because {_reason(arc)}"] if arc.swapped_out else []
        down = [rc for rc in arc.uses if not self._table.rcs[rc].up]
        if down:
            return [f"{age} for {', '.join(down)}, not up", *past], "11", f"{', '.join(down)} answers"
        if slot is None or not self._table.usable(arc):
            crowded = [rc for rc in arc.uses if self._table.rcs[rc].sharable]
            return [f"{age}: {', '.join(crowded)} could not serve it even alone", *past], "11", "the capacity grows"
        blockers = self._table.blockers(slot, now_s)
        if not blockers:
            return [f"{age}: a higher ARC of its group waits", *past], "8", "the higher ARC starts, or idles"
        because = [self._stands(other, arc, now_s) for other in blockers]
        if slot.start_s == math.inf:
            what = f"{age} for {_names(blockers)}, without a predicted start: no gap is long enough for it"
            remedy = f"{_names(blockers)} releases or idles, or has no higher priority; or a shorter minimum run time"
            return [what, *because, *past], "9", remedy
        what = f"{age} for {_names(blockers)}, its slot begins at {_at(slot.start_s)}"
        return [what, *because, *past], "3", f"{_names(blockers)} releases or idles earlier, or a higher ARC asks"

    def _runs(self, arc: ArcEntry, now_s: float) -> tuple[list[str], str, str]:
        if arc.served(now_s):
            what = f"since {_at(arc.granted_s)}; its slice is over, but nobody entitled can use its RCs"
            return [what], "5", "an equal or higher ARC asks for its RCs"
        what = f"since {_at(arc.granted_s)}, its slice ends at {_at(arc.end_s)}"
        return [what], "3", f"at {_at(arc.end_s)} an equal may take over; a higher ARC at once"

    def _stands(self, other: ArcEntry, arc: ArcEntry, now_s: float) -> str:
        if higher(other.path, arc.path):
            rank = "higher"
        elif higher(arc.path, other.path):
            rank = "lower"
        else:
            rank = "equal"
        shared = ", ".join(rc for rc in arc.uses if rc in other.uses)
        return f"{other.name} ({rank}, shares {shared}) {self._where(other, now_s)}"

    def _where(self, arc: ArcEntry, now_s: float) -> str:
        match arc.state:
            case RequestState.RUNNING:
                over = "was over" if arc.served(now_s) else "ends"
                return f"runs, its slice {over} at {_at(arc.end_s)}"
            case RequestState.CONNECTING:
                return f"is being connected since {_at(arc.began_s)}"
            case RequestState.REVOKING:
                return f"is being disconnected since {_at(arc.since_s)}"
            case RequestState.WAITING:
                return "waits before it"
            case RequestState.IDLE:
                return "wants no time"

    def _slots_beside(self, arc: ArcEntry, now_s: float) -> list[Slot]:
        return self._table.slots(self._table.group_of(arc), now_s)

    def _expected_s(self, arc: ArcEntry, slot: Slot | None) -> float:
        """Return when the next grant is predicted; negative: it has one, or none can be predicted."""
        if arc.state is RequestState.CONNECTING:
            return arc.began_s + arc.settle_s
        if slot is None or slot.start_s == math.inf:
            return UNKNOWN_S
        return slot.start_s + arc.settle_s

    def _until_s(self, arc: ArcEntry) -> float:
        match arc.state:
            case RequestState.RUNNING:
                return arc.end_s
            case RequestState.CONNECTING:
                return arc.began_s + arc.length_s
            case _:
                return UNKNOWN_S


def _reason(arc: ArcEntry) -> str:
    return _REASONS.get(arc.swapped_out, arc.swapped_out).format(by=arc.swapped_out_by)


def _names(arcs: Sequence[ArcEntry]) -> str:
    return " and ".join(arc.name for arc in arcs)


def _at(time_s: float) -> str:
    return f"{time_s:.2f} s"
