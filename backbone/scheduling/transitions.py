"""Transitions: each step of an ARC's life, with its line in the trace and its instruction to the loop.

* ``queue``: IDLE → WAITING, with a new stamp
* ``grant``: CONNECTING → RUNNING; its slice counts from here; ``renew``: it stays for one more
* ``revoke``, ``lose``: CONNECTING, RUNNING → REVOKING
* ``free``: REVOKING → WAITING or IDLE
* ``rest``: WAITING → IDLE

Rule of this file: no decision on an ARC's turn. ``switch`` connects: WAITING → CONNECTING.
"""

from __future__ import annotations

from collections.abc import Mapping

from backbone.scheduling.entries import Afterwards, ArcEntry, OpenDecision
from backbone.scheduling.events import Adopted, Record, RevokeArc
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.requests import RequestState
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.slice_ends import SliceExpiry
from backbone.scheduling.trace import VERSION
from backbone.scheduling.trace_writer import TraceWriter

NOT_EXPECTED_S = -1.0

_CAUSES: Mapping[str, str] = {
    "slice": "its slice is over and it is the turn of {by} (rules 3 and 5)",
    "higher": "{by} is higher (rule 4)",
    "rc": "{by} does not answer (rule 11)",
    "capacity": "{by} can give less than before (rule 11)",
    "order": "{by} cannot serve all its holders in time in their new order (rule 11)",
    "packets": "its packets take longer than it declared, and the longer time must count (rule 1)",
    "failed": "it could not open its gate",
    "self": "its owner wants no time any more",
    "owner": "its owner ended",
    "dead": "it died (rule 11)",
    "silent": "it does not give signs of life (rule 11)",
}


class Transitions:
    """Changes the states of ARCs, and adds lines and instructions to the decision.

    Attributes:
        decision: The present decision.
        schedule: The plans and the state.
        ends: The ends of the slices.
        trace: Writes the lines.
        rules: Rules of the decisions.
    """

    def __init__(
        self,
        decision: OpenDecision,
        schedule: MasterSchedule,
        ends: SliceExpiry,
        trace: TraceWriter,
        rules: SchedulingRules,
        *,
        tolerance_s: float,
    ) -> None:
        """Begin with nothing to carry out.

        Args:
            tolerance_s: Reaction and timer tolerance of this run.
        """
        self.decision, self.schedule, self.ends, self.trace, self.rules = decision, schedule, ends, trace, rules
        self._state = schedule.state
        self._tolerance_s = tolerance_s
        self._relaxed = False
        self._stamped = 0

    # The ARC waits.

    def queue(self, arc: ArcEntry) -> None:
        """Queue the ARC behind its equals; write a line if its group is too large to be planned whole."""
        arc.stamp, arc.raised = self.stamp(), 0
        arc.reservation = arc.retry_s = None
        arc.has_forced = False
        self.enter(arc, RequestState.WAITING)
        if not self._relaxed and len(self._state.groups.of[arc].arcs) > self.schedule.planned_whole_up_to:
            self._relaxed = True
            self.trace.record("meta", "a group is too big to be planned whole", **self._meta())

    def stamp(self) -> tuple[float, int]:
        """Return a new stamp, later than all given ones."""
        self._stamped += 1
        return self.decision.now_s, self._stamped

    def enter(self, arc: ArcEntry, state: RequestState) -> None:
        """Let the ARC enter this state now, and check the ends of the slices for which it waits."""
        self._state.enter(arc, state, self.decision.now_s)
        if state is RequestState.WAITING:
            for holder in [holder for rc in arc.uses for holder in self._state.rcs[rc].holders]:
                if holder.state is RequestState.RUNNING:
                    self.ends.wait_for(holder)

    def rest(self, arc: ArcEntry) -> None:
        """Idle a waiting ARC."""
        arc.reservation = None
        self.enter(arc, RequestState.IDLE)

    def reserve(self, arc: ArcEntry, *, forced: bool) -> None:
        """Place a waiting ARC before all equals until it is connected; record whether others were preempted for it."""
        arc.has_forced |= forced
        if arc.reservation is None:
            arc.reservation = self.stamp()[1]
            self._state.concerns(arc.uses)

    # The ARC has its RCs.

    def grant(self, arc: ArcEntry) -> None:
        """Grant an ARC whose RCs have settled: its slice begins."""
        arc.granted_s = arc.slice_s = self.decision.now_s
        arc.has_forced = False
        arc.turns += 1
        self.enter(arc, RequestState.RUNNING)
        self.ends.end_at(arc, self._slice_end_s(arc))
        # On a sharable RC an ARC with a shorter settling time may overtake another. The overtaken epoch is only in the
        # line of its connection, so that the numbers of each RC grow in the trace.
        newest = {rc: epoch for rc, epoch in arc.epochs.items() if epoch > self._state.rcs[rc].granted_epoch}
        for rc, epoch in newest.items():
            self._state.rcs[rc].granted_epoch = epoch
        self.trace.record("grant", "its RCs have settled", arc=arc.name, epoch=newest)
        self._record_grid(arc)

    def adopt(self, arc: ArcEntry, adopted: Adopted) -> None:
        """Adopt the slice that an earlier RC manager began, for a waiting ARC; the trace shows it at its true times."""
        why, epochs, granted_s = "it held its RCs when this RC manager started", adopted.epochs, adopted.granted_s
        newest = {rc: epoch for rc, epoch in epochs.items() if rc not in adopted.overtaken}
        self.trace.record("connect", why, arc=arc.name, epoch=dict(epochs))
        self.trace.record("grant", why, t=granted_s, arc=arc.name, epoch=newest)
        arc.epochs = dict(epochs)
        for rc, epoch in epochs.items():
            entry = self._state.rcs[rc]
            entry.epoch = max(entry.epoch, epoch)
            entry.granted_epoch = max(entry.granted_epoch, epoch)
        arc.turns = 1
        arc.began_s, arc.granted_s, arc.slice_s = self.decision.now_s, granted_s, granted_s
        self.enter(arc, RequestState.RUNNING)
        self.ends.end_at(arc, granted_s + arc.minimum_s)

    def renew(self, arc: ArcEntry) -> None:
        """Begin a new slice of a served ARC that stays when an equal's slice ended; its place is behind its equals."""
        arc.stamp, arc.raised = self.stamp(), 0
        arc.slice_s = self.decision.now_s
        arc.turns += 1
        self.ends.end_at(arc, self._slice_end_s(arc))
        self.trace.record("slice", "it stays where an equal's slice ended (rule 5)", arc=arc.name)
        self._record_grid(arc)

    def extend(self, arc: ArcEntry, until_s: float) -> None:
        """Extend the slice of a running ARC."""
        self.ends.end_at(arc, until_s)
        self.trace.record("extend", "it asked to go on (rule 14)", arc=arc.name, until=until_s)

    # The ARC loses its RCs.

    def revoke(self, arc: ArcEntry, why: str, by: str, afterwards: Afterwards = Afterwards.WAIT) -> None:
        """Revoke all RCs of a connected ARC."""
        deadline_s = self.rules.grace_s if why == "slice" and not arc.request.stops_at_once else 0.0
        self.lose(arc, why, by, afterwards)
        revoked = RevokeArc(arc.name, dict(arc.epochs), why, by, deadline_s, NOT_EXPECTED_S)
        self.decision.instructions.append(revoked)

    def lose(self, arc: ArcEntry, why: str, by: str, afterwards: Afterwards = Afterwards.WAIT) -> None:
        """Count the ARC's RCs as being disconnected; the next place of a served ARC is behind its equals."""
        cause = because(why, by)
        if arc.served(self.decision.now_s):
            arc.stamp, arc.raised = self.stamp(), 0
        arc.swapped_out, arc.swapped_out_by = why, by
        self._count_way(arc)
        arc.afterwards = afterwards
        self.enter(arc, RequestState.REVOKING)
        self.trace.record("revoke", cause, arc=arc.name, why=why, **({"by": by} if by else {}))

    def _count_way(self, arc: ArcEntry) -> None:
        """Count how often the ARC was revoked before its slice was over for the same wait of a higher one."""
        if arc.served(self.decision.now_s):
            arc.made_way = 0
        elif arc.swapped_out == "higher":
            wait = arc.swapped_out_by, self._state.arcs[arc.swapped_out_by].stamp
            arc.made_way, arc.made_way_for = 1 + arc.made_way * (arc.made_way_for == wait), wait

    def free(self, arc: ArcEntry, state: RequestState) -> None:
        """Queue or idle an ARC when its RCs are in their safe states."""
        arc.epochs = {}
        self.enter(arc, state)

    def _slice_end_s(self, arc: ArcEntry) -> float:
        return self.rules.slice_end_s(self.decision.now_s, arc.minimum_s)

    def _record_grid(self, arc: ArcEntry) -> None:
        if self.rules.grid_s:
            self.trace.record("extend", "slices end on a common grid (rule 15)", arc=arc.name, until=arc.end_s)

    # The rules in the trace.

    def opening_line(self) -> Record:
        """Return the line that begins a section of the trace."""
        return Record({"ev": "meta", "t": self.decision.now_s, **self._meta()})

    def _meta(self) -> dict[str, object]:
        return {
            "v": VERSION,
            "mode": self.rules.policy,
            "discipline": self.rules.discipline,
            "wc": "relaxed" if self._relaxed else "plan",
            "grace": self.rules.grace_s,
            "tol": self._tolerance_s,
        }


def because(why: str, by: str) -> str:
    """Return the cause of a revocation or departure, for people."""
    return _CAUSES.get(why, why).format(by=by)
