"""RC events: the effects of RCs' states on the schedule (rule 11).

An ARC that lost an RC is revoked; the rest of the schedule goes on.
"""

from __future__ import annotations

from backbone.scheduling.entries import CONNECTED
from backbone.scheduling.events import RcKnown
from backbone.scheduling.preemption import overloading
from backbone.scheduling.transitions import Transitions


class RcEvents:
    """Applies events of RCs."""

    def __init__(self, transitions: Transitions) -> None:
        self._transitions, self._trace = transitions, transitions.trace
        self._state, self._table = transitions.schedule.state, transitions.schedule.table

    def known(self, event: RcKnown) -> None:
        """Add an RC, or apply the new state of a known one."""
        if event.rc not in self._state.rcs:
            rc = self._state.add_rc(event)
            if rc.up:
                self._trace.introduce_rc(rc)
            return
        if event.up:
            self.came_back(event.rc, event.last_epoch)
        else:
            self.went_down(event.rc)
        self.capacity_changed(event.rc, event.capacity)

    def went_down(self, name: str, lost_by: str = "", fault: str = "") -> None:
        """Revoke the holders of an RC that does not answer or is put aside, as ``lost_by`` did already."""
        rc = self._state.rcs.get(name)
        if rc is None or not self._state.rc_down(rc, None if lost_by else fault):
            return
        cause = f"it is put aside: {fault} (rule 11)" if fault else "it does not answer"
        self._trace.record("rc_state", cause, id=name, state="down")
        for arc in [*self._state.arcs.values()]:
            if arc.state in CONNECTED and name in arc.uses and arc.name != lost_by:
                self._transitions.revoke(arc, "rc", name)

    def removed(self, name: str) -> None:
        """Remove an RC if it is down and no request names it; otherwise it stays."""
        rc = self._state.rcs.get(name)
        if rc is not None and not rc.up:
            self._state.remove_rc(rc)
            self._trace.forget_rc(name)

    def came_back(self, name: str, last_epoch: int) -> None:
        """Count the RC as up: it answers, and has no holder."""
        rc = self._state.rcs.get(name)
        if rc is None:
            return
        if rc.up and any(arc.state in CONNECTED and name in arc.uses for arc in self._state.arcs.values()):
            self.went_down(name)  # it was away for a moment and lost its holders
        if not self._state.rc_up(rc, last_epoch):
            return
        if self._trace.has_introduced(name):
            self._trace.record("rc_state", "it answers", id=name, state="up")
        self._trace.introduce_rc(rc)

    def capacity_changed(self, name: str, capacity: float) -> None:
        """Set the capacity of a sharable RC; revoke the last holders in order until the rest fits."""
        rc = self._state.rcs.get(name)
        if rc is None or not rc.sharable or rc.capacity == capacity or not 0 <= capacity <= 1:
            return
        self._state.set_capacity(rc, capacity)
        if self._trace.has_introduced(name):
            self._trace.record("rc_cap", id=name, cap=capacity)
        for holder in overloading(self._table, name):
            self._transitions.revoke(holder, "capacity", name)
