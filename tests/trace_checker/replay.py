"""Replaying a trace line by line: each line must be able to follow those before it, and each rule looks at it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import pairwise
from typing import Any

from . import holding
from .admission import stream_of
from .fairness import Fairness
from .plan import INSTANT_S
from .priority_order import console_node
from .starts import Starts
from .state import Arc, Phase, Rc
from .trace_format import Line, Malformed, require_sound
from .violation import Violation
from .world import World

ROUNDING_S = 1e-6  # chosen: times are written to the microsecond


def check(lines: Iterable[Line], tolerance_s: float | None = None) -> list[Violation]:
    """Return all violations in the trace, life by life; the tolerance is the trace's own unless one is given."""
    return [found for life in _lives(lines) for found in Replay(tolerance_s).run(life)]


def _lives(lines: Iterable[Line]) -> list[list[Line]]:
    """Return the lines of each life of the RC manager, which begins with ``meta`` and writes all that it found.

    A ``meta`` that changes the work from ``plan`` to ``relaxed`` continues a life: a group became too large.
    """
    lives: list[list[Line]] = [[]]
    work = ""
    for line in lines:
        if line.get("ev") == "meta":
            if lives[-1] and (work, line.get("wc")) != ("plan", "relaxed"):
                lives.append([])
            work = line.get("wc")
        lives[-1].append(line)
    return lives


class Replay:
    """One life of the RC manager, from its first line to its last."""

    def __init__(self, tolerance_s: float | None = None) -> None:
        self.found: list[Violation] = []
        self.world = World()
        self.now_s = 0.0
        self.number = 0
        self.grace_s = 0.0
        self.strict = False
        self.discipline = "turns"
        self.relaxed = False
        self._given_s = tolerance_s
        self.tolerance_s = tolerance_s or 0.0
        self._starts = Starts(self)
        self._fairness = Fairness(self)

    @property
    def slack_s(self) -> float:
        return self.tolerance_s + ROUNDING_S

    def report(self, code: str, arc: str, message: str) -> None:
        self.found.append(Violation(code, self.now_s, arc, message))

    def run(self, lines: list[Line]) -> list[Violation]:
        sound = [line for line in lines if self._is_sound(line)]
        sound.sort(key=lambda line: line["t"])  # a line that was written late keeps its time
        for line, after in pairwise([*sound, None]):
            if line is not None:
                self._read(line, after["t"] if after else None)
        for arc in self.world.arcs.values():
            holding.is_free(self, arc)
        self._fairness.over()
        return sorted(self.found, key=lambda one: one.t)

    def _is_sound(self, line: Line) -> bool:
        try:
            require_sound(line)
        except Malformed as error:
            time_s = line.get("t")
            self.found.append(Violation("FORM", time_s if isinstance(time_s, float) else 0.0, "", str(error)))
            return False
        return True

    def _read(self, line: Line, next_s: float | None) -> None:
        self.now_s = line["t"]
        self.number += 1
        try:
            getattr(self, f"_on_{line['ev']}")(line)
        except Malformed as error:
            self.report("FORM", line.get("arc", line.get("id", "")), str(error))
        if next_s is not None and next_s > self.now_s:
            self._starts.time_passes(next_s)
            holding.time_passes(self, next_s)

    def _arc(self, line: Line, *phases: Phase) -> Arc:
        arc = self.world.arcs.get(line["arc"])
        if arc is None:
            raise Malformed(f"{line['ev']} of an ARC that has not asked")
        if phases and arc.phase not in phases:
            raise Malformed(f"{line['ev']} of an ARC that is {arc.phase.value}")
        return arc

    def _rc(self, name: str) -> Rc:
        if name not in self.world.rcs:
            raise Malformed(f"unknown RC {name}")
        return self.world.rcs[name]

    def _on_meta(self, line: Line) -> None:
        self.grace_s, self.strict, self.discipline = line["grace"], line["mode"] == "strict", line["discipline"]
        self.relaxed = line["wc"] == "relaxed"
        self.tolerance_s = line["tol"] if self._given_s is None else self._given_s

    def _on_rc(self, line: Line) -> None:
        known = self.world.rcs.get(line["id"])
        rc = Rc(line["id"], line["kind"] == "share", line["cap"], line["connect"], line["disconnect"])
        if known is not None:
            rc.holders, rc.epoch = known.holders, known.epoch
        self.world.rcs[rc.name] = rc
        self.world.forget()

    def _on_rc_state(self, line: Line) -> None:
        rc = self._rc(line["id"])
        rc.up = line["state"] == "up"
        rc.down_s = None if rc.up else self.now_s
        for arc in rc.holders.values():
            arc.has_lost |= not rc.up and arc.phase is Phase.REVOKING
        self._fairness.disturbed()

    def _on_rc_cap(self, line: Line) -> None:
        rc = self._rc(line["id"])
        rc.capacity, rc.changed_s = line["cap"], self.now_s
        self.world.forget()
        self._fairness.disturbed()

    def _on_node(self, line: Line) -> None:
        nodes, parent = self.world.nodes, line["parent"]
        if parent is not None and (not nodes.knows(parent) or nodes.is_below(parent, line["id"])):
            raise Malformed(f"parent {parent} is unknown or below the node itself")
        nodes.put(line["id"], parent, line["prio"])
        self._paths_changed()

    def _paths_changed(self) -> None:
        for arc in self.world.arcs.values():
            path = self.world.nodes.path(arc.node)
            if path != arc.path:
                arc.path, arc.moved_s = path, min(arc.moved_s, self.now_s)
        self.world.forget()

    def _on_end(self, line: Line) -> None:
        """Nothing to do: that time has passed was seen before."""

    def _on_request(self, line: Line) -> None:
        arc = self._asked(line)
        old = self.world.arcs.get(arc.name)
        if old is not None:  # it begins anew, as after a restart of the RC manager
            holding.is_free(self, old)
            self.world.forget_holder(old)
            arc.active_s, arc.services, arc.moved_s = old.active_s, old.services, old.moved_s
        self.world.arcs[arc.name] = arc
        self._paths_changed()
        if not line.get("idle"):
            self._begins_to_want(arc)

    def _asked(self, line: Line) -> Arc:
        rcs = [self._rc(name) for name in line["use"]]
        uses = {rc: () if use == "x" else tuple(map(stream_of, use)) for rc, use in line["use"].items()}
        node = self._owner(line["owner"])
        return Arc(
            line["arc"],
            node,
            self.world.nodes.path(node),
            line["min_run"],
            line["max_run"],
            uses,
            max((rc.connect_s for rc in rcs), default=0.0),
            max((rc.disconnect_s for rc in rcs), default=0.0),
        )

    def _owner(self, owner: str | dict[str, Any]) -> str:
        if isinstance(owner, str):
            if not self.world.nodes.knows(owner):
                raise Malformed(f"owner {owner} is no node")
            return owner
        self.world.nodes.put(console_node(owner), None, owner["ui"])
        return console_node(owner)

    def _begins_to_want(self, arc: Arc) -> None:
        arc.wants, arc.phase, arc.freed_for, arc.due_s = True, Phase.WAITING, None, None
        arc.stamp, arc.since_s = (self.now_s, self.number), self.now_s
        self._fairness.becomes_active(arc)
        self.world.forget_groups()

    def _on_want(self, line: Line) -> None:
        arc = self._arc(line)
        if arc.phase is Phase.GONE:
            raise Malformed("want of an ARC that has left")
        if arc.phase is Phase.IDLE:
            self._begins_to_want(arc)

    def _on_idle(self, line: Line) -> None:
        self._takes_back(self._arc(line), leaves=False)

    def _on_depart(self, line: Line) -> None:
        self._takes_back(self._arc(line), leaves=True)

    def _takes_back(self, arc: Arc, *, leaves: bool) -> None:
        arc.wants, arc.is_leaving = False, arc.is_leaving or leaves
        if arc.phase is Phase.WAITING:
            self._fairness.waited(arc)
        if arc.phase in (Phase.WAITING, Phase.IDLE):
            self._rests(arc)
        self.world.forget_groups()

    def _rests(self, arc: Arc) -> None:
        arc.phase = Phase.GONE if arc.is_leaving else Phase.IDLE
        self._fairness.becomes_inactive(arc)

    def _on_min_run(self, line: Line) -> None:
        arc = self._arc(line)
        arc.min_run_s = line["min_run"]
        arc.max_run_s = max(line.get("max_run", arc.max_run_s), arc.min_run_s)

    def _on_extend(self, line: Line) -> None:
        arc = self._arc(line)
        if arc.phase is not Phase.RUNNING:
            return  # it came when the run was over
        latest_s = arc.begin_s + arc.max_run_s
        arc.until_s = max(arc.until_s, line["until"])
        if line["until"] > latest_s + self.slack_s:
            raise Malformed(f"extended to {line['until']:g}, may run until {latest_s:g}")

    def _on_connect(self, line: Line) -> None:
        arc = self._arc(line, Phase.WAITING)
        holding.connects(self, arc)
        self._starts.connects(arc)
        self._fairness.waited(arc)
        arc.phase, arc.connect_s, arc.freed_for, arc.due_s = Phase.CONNECTING, self.now_s, None, None
        for rc in arc.uses:
            self.world.rcs[rc].holders[arc.name] = arc
        self.world.forget_groups()

    def _on_grant(self, line: Line) -> None:
        arc = self._arc(line, Phase.WAITING, Phase.CONNECTING)
        if arc.phase is Phase.WAITING:  # its connect is missing, so its RCs begin to settle only now
            self._on_connect(line)
        holding.granted(self, arc, {self._rc(name).name: epoch for name, epoch in line["epoch"].items()})
        arc.phase = Phase.RUNNING
        arc.begin_slice(self.now_s)
        self._fairness.granted(arc)

    def _on_revoke(self, line: Line) -> None:
        arc = self._arc(line, Phase.CONNECTING, Phase.RUNNING)
        self._starts.revokes(arc)
        if arc.phase is Phase.RUNNING:
            self._fairness.ran(arc)
        if arc.is_served(self.now_s, self.slack_s if line["why"] == "slice" else INSTANT_S):
            arc.stamp = (self.now_s, self.number)
        arc.phase, arc.revoke_s = Phase.REVOKING, self.now_s
        arc.has_lost = not all(self.world.rcs[name].up for name in arc.uses)
        self.world.forget_groups()

    def _on_free(self, line: Line) -> None:
        arc = self._arc(line, Phase.REVOKING)
        holding.is_free(self, arc)
        self.world.forget_holder(arc)
        if arc.wants:
            arc.phase, arc.since_s, arc.due_s = Phase.WAITING, self.now_s, None
        else:
            self._rests(arc)
        self.world.forget_groups()

    def _on_slice(self, line: Line) -> None:
        arc = self._arc(line, Phase.RUNNING)
        self._starts.new_slice(arc)
        self._fairness.ran(arc)
        arc.begin_slice(self.now_s)
        arc.stamp = (self.now_s, self.number)
        self.world.forget_groups()
