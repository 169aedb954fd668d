"""Slice ends: the ends of those slices for whose end an ARC waits (rule 5).

Rule of this file: a slice ends only if an ARC waits for one of its RCs. Otherwise its end is not watched.
"""

from __future__ import annotations

import heapq

from backbone.scheduling.entries import INSTANT_S, ArcEntry
from backbone.scheduling.requests import RequestState
from backbone.scheduling.state import ScheduleState


class SliceExpiry:
    """The ends of the slices of running ARCs, first end first."""

    def __init__(self, state: ScheduleState) -> None:
        """Begin with no slices."""
        self._state = state
        self._ends: list[tuple[float, int, ArcEntry]] = []
        self._pushed = 0

    def end_at(self, arc: ArcEntry, end_s: float) -> None:
        """Set the end of a running ARC's slice."""
        arc.end_s, arc.look_s, arc.awaited = end_s, end_s, False
        self._state.held_alone |= arc.excludes
        if self._is_waited_for(arc):
            self.wait_for(arc)
        self._state.concerns(arc.uses)

    def wait_for(self, arc: ArcEntry) -> None:
        """Check the slice of a running ARC at its end, because an ARC waits for that end."""
        if not arc.awaited:
            arc.awaited = True
            self._pushed += 1
            heapq.heappush(self._ends, (arc.look_s, self._pushed, arc))

    def check(self, now_s: float) -> float | None:
        """Free the RCs of ended slices for the ARCs that wait for them; return the time of the next check."""
        state = self._state
        state.now_s = now_s
        state.version += 1  # time alone changes plans
        while self._ends:
            look_s, _, arc = self._ends[0]
            stands = arc.state is RequestState.RUNNING and arc.look_s == look_s
            wanted = stands and self._is_waited_for(arc)
            if wanted and look_s > now_s + INSTANT_S:
                return look_s
            heapq.heappop(self._ends)
            if stands:
                arc.awaited = wanted
            if wanted and state.fairness.discipline == "time":  # each moment of running may change who is preferred
                arc.look_s, arc.awaited = now_s + arc.minimum_s, False
                self.wait_for(arc)
            if wanted and not state.runs_on(arc):
                state.held_alone &= ~arc.excludes
                state.concerns(arc.uses)
        return None

    def _is_waited_for(self, holder: ArcEntry) -> bool:
        users = self._state.users
        return any(user.state is RequestState.WAITING for rc in holder.uses for user in users.get(rc, ()))
