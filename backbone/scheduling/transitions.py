"""Transitions: each step of an ARC's life with its line in the trace and its instruction to the loop.

``ScheduleState`` has the new state; this file emits lines and instructions, in the order of the decisions.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from backbone.scheduling import trace
from backbone.scheduling.entries import CONNECTED, Afterwards, ArcEntry
from backbone.scheduling.events import ConnectArc, Instruction, RenewLeases, RevokeArc, WakeAt
from backbone.scheduling.master_schedule import MasterSchedule
from backbone.scheduling.priority import higher, rank
from backbone.scheduling.requests import RequestState
from backbone.scheduling.rules import SchedulingRules
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
    """Changes the state and collects the instructions for the loop.

    Attributes:
        trace: Writes the lines.
        instructions: The decision's instructions so far, in order.
    """

    def __init__(self, schedule: MasterSchedule, rules: SchedulingRules, *, tolerance_s: float, goes_on: bool) -> None:
        """Begin with nothing to carry out.

        Args:
            schedule: The plans and the state.
            rules: Rules of the decisions.
            tolerance_s: Reaction and timer tolerance of this run.
            goes_on: True if the trace goes on after that of an earlier RC manager.
        """
        self.state = schedule.state
        self.now_s = 0.0
        self.instructions: list[Instruction] = []
        self._ended: list[tuple[ArcEntry, str]] = []
        self.trace = TraceWriter(self.instruct, goes_on=goes_on)
        self._schedule = schedule
        self._rules = rules
        self._tolerance_s = tolerance_s
        self._relaxed = False

    def begin(self, now_s: float) -> None:
        """Begin a decision; time never goes back."""
        self.now_s = max(now_s, self.now_s)
        self.instructions = []
        self._ended = []

    def instruct(self, instruction: Instruction) -> None:
        """Add an instruction after all earlier ones."""
        self.instructions.append(instruction)

    def wake_at(self, time_s: float | None) -> None:
        """Schedule the next decision for then if no event comes before."""
        self.instruct(WakeAt(time_s))

    # The life of an ARC.

    def connect(self, arc: ArcEntry) -> None:
        """Connect an ARC whose RCs are all free."""
        self.state.connect(arc, self.now_s)
        if any(len(self.state.rcs[rc].holders) > 1 for rc in arc.shares):  # the other holders' ranks may change
            self.instruct(RenewLeases())
        self.trace.record(
            trace.connect(self.now_s, arc.name, arc.epochs), "it is next, and all its RCs are free (rule 3)"
        )
        until_s = self.now_s + arc.length_s
        self.instruct(ConnectArc(arc.name, dict(arc.epochs), arc.settle_s, until_s, self.ranks(arc)))

    def ranks(self, arc: ArcEntry) -> dict[str, int]:
        """Return the ARC's place by user priority among the holders of each sharable RC it uses."""

        def place(rc: str) -> int:
            holders = self.state.rcs[rc].holders
            return sum(other.state in CONNECTED and higher(other.path, arc.path) for other in holders)

        return {rc: place(rc) for rc in arc.uses if self.state.rcs[rc].sharable}

    def grant(self, arc: ArcEntry) -> None:
        """Grant an ARC whose RCs have settled: its slice begins."""
        newest = self.state.grant(arc, self.now_s, self._slice_end_s(arc))
        self.trace.record(trace.grant(self.now_s, arc.name, newest), "its RCs have settled")
        self._record_grid(arc)

    def adopt(self, arc: ArcEntry, epochs: Mapping[str, int], granted_s: float) -> None:
        """Adopt the slice that an earlier RC manager began; the trace shows it at its true times."""
        why = "it held its RCs when this RC manager started"
        self.trace.record(trace.connect(self.now_s, arc.name, epochs), why)
        self.trace.record(trace.grant(granted_s, arc.name, epochs), why)
        self.state.adopt(arc, epochs, granted_s, self.now_s)

    def extend(self, arc: ArcEntry, until_s: float) -> None:
        """Extend the slice of a running ARC."""
        self.state.end_at(arc, until_s)
        self.trace.record(trace.extend(self.now_s, arc.name, until_s), "it asked to go on (rule 14)")

    def revoke(self, arc: ArcEntry, why: str, by: str, afterwards: Afterwards = Afterwards.WAIT) -> None:
        """Revoke all RCs of a connected ARC."""
        deadline_s = self._rules.grace_s if why == "slice" and not arc.request.stops_at_once else 0.0
        self.lose(arc, why, by, afterwards)
        self.instruct(RevokeArc(arc.name, dict(arc.epochs), why, by, deadline_s, NOT_EXPECTED_S))

    def lose(self, arc: ArcEntry, why: str, by: str, afterwards: Afterwards = Afterwards.WAIT) -> None:
        """Count the ARC's RCs as being disconnected: that is under way already."""
        self.trace.record(trace.revoke(self.now_s, arc.name, why, by), because(why, by))
        self.state.revoke(arc, self.now_s, why, by, afterwards)

    def free(self, arc: ArcEntry, state: RequestState) -> None:
        """Queue or idle an ARC whose RCs are in their safe states."""
        self.state.free(arc, self.now_s, state)

    def end_slice(self, arc: ArcEntry, by: ArcEntry) -> None:
        """Revoke all RCs of a served ARC, for an equal."""
        self._ended += [(arc, rc) for rc in arc.shares if rc in by.shares]
        self.revoke(arc, "slice", by.name)

    def renew_slices(self) -> None:
        """Begin a new slice of served equals that stay on a sharable RC where another slice was ended (rule 5)."""
        for ended, rc in self._ended:
            for arc in [*self.state.rcs[rc].holders]:
                if rc in arc.shares and arc.served(self.now_s) and not rank(arc.path, ended.path):
                    self.state.begin_slice(arc, self.now_s, self._slice_end_s(arc))
                    cause = "it stays where an equal's slice ended (rule 5)"
                    self.trace.record(trace.about("slice", self.now_s, arc.name), cause)
                    self._record_grid(arc)

    def _slice_end_s(self, arc: ArcEntry) -> float:
        return self._rules.slice_end_s(self.now_s, arc.minimum_s)

    def _record_grid(self, arc: ArcEntry) -> None:
        if self._rules.grid_s:
            cause = "slices end on a common grid (rule 15)"
            self.trace.record(trace.extend(self.now_s, arc.name, arc.end_s), cause)

    def queue(self, arc: ArcEntry) -> None:
        """Queue it behind its equals; the trace has a line if its group is too large to be planned whole."""
        self.state.queue(arc, self.now_s)
        if not self._relaxed and not self._schedule.planner_of(arc).is_exact:
            self._relaxed = True
            self.trace.record(self.meta(), "a group is too big to be planned whole")

    def meta(self) -> trace.Line:
        """Return the line that begins a section of the trace."""
        return trace.meta(
            self.now_s,
            policy=self._rules.policy,
            discipline=self._rules.discipline,
            grace_s=self._rules.grace_s,
            tolerance_s=self._tolerance_s,
            relaxed=self._relaxed,
        )

    def expect(self) -> None:
        """Add the predicted next grants of revoked ARCs to the instructions."""
        for place, instruction in enumerate(self.instructions):
            if not isinstance(instruction, RevokeArc):
                continue
            arc = self.state.arcs.get(instruction.arc)
            if arc is not None and arc.queued:
                start_s = self._schedule.planner_of(arc).start_s(arc, self.now_s)
                if start_s < math.inf:
                    self.instructions[place] = replace(instruction, expected_s=start_s + arc.settle_s)


def because(why: str, by: str) -> str:
    """Return the cause of a revocation or departure, for people."""
    return _CAUSES.get(why, why).format(by=by)
