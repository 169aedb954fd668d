"""Switch: an ARC whose turn it is gets its RCs, or its holders are revoked first (rules 4 and 6).

Rules of this file (numbers as in docs and ``why``):

* 4  Preempted RCs go to the ARC that preempted them: it has a reservation, and comes before its equals.
* 6  revoke → free → connect → grant. An ARC connects only when all its RCs are free.
"""

from __future__ import annotations

from backbone.scheduling.entries import CONNECTED, ArcEntry
from backbone.scheduling.events import ConnectArc, RenewLeases
from backbone.scheduling.planner import Turn, in_order_of_revocation
from backbone.scheduling.priority import higher
from backbone.scheduling.requests import RequestState
from backbone.scheduling.transitions import Transitions


class Switching:
    """Carries out turns: instructions to the loop, and state changes of the ARCs."""

    def __init__(self, transitions: Transitions) -> None:
        self._decision, self._schedule = transitions.decision, transitions.schedule
        self._transitions = transitions
        self._state = transitions.schedule.state

    def make_way(self, turn: Turn) -> None:
        """Revoke the holders that block the ARC whose turn it is; ended slices before preempted ones.

        Raises:
            AssertionError: The planner, one's own perhaps, is wrong: the ARC does not wait, or a holder has no RCs.
        """
        self._require(turn.arc, RequestState.WAITING)
        for holder in turn.in_the_way:
            self._require(holder, RequestState.CONNECTING, RequestState.RUNNING)
        for holder in in_order_of_revocation(turn):
            served, overridden = holder.served(self._decision.now_s), turn.arc.goes_before(holder)
            forced = overridden and not served
            if forced or not self._schedule.planner_of(turn.arc).reserves:
                self._transitions.reserve(turn.arc, forced=forced)
            if overridden:
                self._transitions.revoke(holder, "higher", turn.arc.name)
            else:
                self._decision.ended += [(holder, rc) for rc in holder.shares if rc in turn.arc.shares]
                self._transitions.revoke(holder, "slice", turn.arc.name)

    def connect(self, arc: ArcEntry) -> None:
        """Connect an ARC whose RCs are all free, each with a new epoch, so that they begin to settle.

        Raises:
            AssertionError: The planner, one's own perhaps, is wrong: the ARC does not wait, or its RCs are not free.
        """
        self._require(arc, RequestState.WAITING)
        holders = [*self._schedule.table.holders(arc)]
        if not self._schedule.table.fits(arc, holders):
            raise AssertionError(
                f"the planner connects {arc.name}, but {', '.join(holder.name for holder in holders)} holds its RCs"
            )
        now_s, rcs, ranks = self._decision.now_s, self._state.rcs, self.ranks(arc)
        for rc in arc.uses:
            rcs[rc].epoch += 1
        arc.epochs = {rc: rcs[rc].epoch for rc in arc.uses}
        arc.reservation = None
        arc.began_s = now_s
        self._transitions.enter(arc, RequestState.CONNECTING)
        if any(len(rcs[rc].holders) > 1 for rc in arc.shares):  # the other holders' ranks may change
            self._decision.instructions.append(RenewLeases())
        cause = "it is next, and all its RCs are free (rule 3)"
        self._transitions.trace.record("connect", cause, arc=arc.name, epoch=dict(arc.epochs))
        self._decision.instructions.append(
            ConnectArc(
                arc.name,
                dict(arc.epochs),
                arc.settle_s,
                now_s + arc.length_s,
                ranks,
                arc.request.uses_of(arc.uses),
            )
        )

    def _require(self, arc: ArcEntry, *states: RequestState) -> None:
        """Return if the ARC is one of the schedule and in one of the states, else raise."""
        if self._state.arcs.get(arc.name) is not arc:
            raise AssertionError(f"the planner's turn names {arc.name}, but not the ARC in the schedule")
        if arc.state not in states:
            raise AssertionError(
                f"the planner's turn names {arc.name}, which is {arc.state}, not {' or '.join(states)}"
            )

    def ranks(self, arc: ArcEntry) -> dict[str, int]:
        """Return the ARC's place by user priority among the holders of each sharable RC it uses."""
        return {
            rc: sum(other.state in CONNECTED and higher(other.path, arc.path) for other in self._state.rcs[rc].holders)
            for rc in arc.uses
            if self._state.rcs[rc].sharable
        }
