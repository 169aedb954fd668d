"""Laws of every simulated mission, with any faults. Pure: events in, the first broken law out.

The laws, by name:

* one-holder: at no time do two ARCs hold one unit RC, by the RCs' own records.
* epochs-grow: every hold of an RC has a larger epoch than all earlier holds, also over restarts.
* fenced: after a command under an epoch, the robot gets no packet of an older epoch; after the connection of the next
  ARC it gets only the safe packet; and no packet is sent outside its ARC's hold of the radio.
* freed: when the RC manager records an ARC's RCs as free, the ARC holds no running RC.
* stopped: after an operator's stop no packet moves the robot until its lift is ordered; if the stop is not confirmed,
  after twice ``COMMAND_TIMEOUT_S``.
* safe: the last packet to a robot from an ARC and a radio is the safe packet.
* whole-set: a gate opens only when all its RCs were connected to its ARC under exactly these epochs.
* true: an owner's belief agrees with its ARC's gate, and the gate agrees with the RCs, except for known delays.
* schedule: the invariants of the RC manager's schedule hold after each event.
* kept: if every message arrives, and the RC manager dies and is soon restarted, holders and epochs stay unless the RC
manager decides otherwise.
* progress: without further faults, each owner that wants time and has no rival of higher priority gets it (not under
the policy ``strict``).
* obeyed: a priority that the RC manager confirmed to an operator holds, also over restarts (not with aging).
* no-bug: no component ends by a bug.

Events of the audit: ``begins killed ends fails`` of components; ``held``, ``let go``, ``safe``, ``unsafe`` of RCs;
``open shut`` of ARCs; ``resumed suspended claims releases wants applied refused`` of decision processes; ``packet`` of
radios; the trace's events of the RC manager; ``changed unconfirmed stops lifts`` of the operator; ``calm`` and ``over``
of the mission.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence, Set
from dataclasses import dataclass, field

from backbone.scheduling.priority import higher
from backbone.scheduling.requests import LEASE_S
from mission_control.laboratory.simulation.audit import Happening
from mission_control.laboratory.simulation.faults import LONGEST_DELAY_S, LONGEST_HANG_S
from mission_control.laboratory.simulation.shape import MissionShape
from mission_control.laboratory.simulation.traced_tree import TracedTree
from resource_pool.messages import COMMAND_TIMEOUT_S

SAFE, FREED = "S", "freed"
MOVING = frozenset("DJ")  # ``scout_model.radio_link``: drive and jump
FREED_WITHIN_S = 0.5  # chosen: an RC ends its holds one after the other, each within 0.4 s, before it connects the next
RECOVERY_S = 6.0  # chosen: a lease, a late message, and the time to claim a lost ARC again
SOON_BACK_S = 0.6  # chosen: including its questions to all components, it renews before any lease expires
UNDISTURBED_S = 4.0  # chosen: two leases
RC_MANAGER = "rc_manager"
Path = tuple[tuple[str, int], ...]
CALM_DELAY_S = 1.5  # chosen: in the calm a notice takes no time; a death is seen at once, a lost owner in half a second
STORM_DELAY_S = LEASE_S + LONGEST_DELAY_S + LONGEST_HANG_S + 2.0
"""Chosen: with faults, a renewal may be late by the longest delay and then wait for the end of a hang; the renewed hold
lasts a lease, and the owner gets the notice of its end within the next second."""
STORY_LENGTH = 30  # chosen: one screen


@dataclass(frozen=True, slots=True)
class Broken:
    """A broken law.

    Attributes:
        what: A sentence with the names and numbers of this case.
        names: Components concerned.
    """

    law: str
    at_s: float
    what: str
    names: tuple[str, ...]

    def __str__(self) -> str:
        return f"{self.law}, at {self.at_s:.4f} s: {self.what}"


def first_broken(
    shape: MissionShape,
    happenings: Sequence[Happening],
    *,
    all_arrived: bool = False,
    longest_s: float = 0.0,
    others: Mapping[str, Path] = {},
    ages: bool = False,
) -> Broken | None:
    """Return the first broken law, or None if all hold.

    Args:
        all_arrived: True if no message was lost, late or doubled.
        longest_s: Additional time for which beliefs may be wrong, because processes were paused or cut off.
        others: ARC → path of its decision process, for those besides the owners; they always want time.
        ages: True if waiting ARCs rise, so that numbers change.
    """
    judge = _Judge(shape, all_arrived, longest_s, others, ages)
    for happening in happenings:
        for broken in judge.judge(happening):
            return broken
    return None


def story_of(broken: Broken, happenings: Sequence[Happening], length: int = STORY_LENGTH) -> list[Happening]:
    """Return the last events of the concerned components before the violation; equal packets appear once."""
    story: list[Happening] = []
    for happening in reversed([h for h in happenings if h.at_s <= broken.at_s and h.concerns(broken.names)]):
        if story and happening.what == story[-1].what == "packet" and happening.values == story[-1].values:
            continue
        story.append(happening)
        if len(story) == length:
            break
    return story[::-1]


@dataclass(slots=True)
class _Sent:
    """The packets of an ARC through a radio that it holds."""

    epoch: int
    last: dict[int, str] = field(default_factory=dict)
    is_over: bool = False


@dataclass(slots=True)
class _Belief:
    """An owner's belief about its ARC."""

    epochs: dict[str, int] | None = None
    since_s: float = 0.0


class _Judge:
    def __init__(
        self, shape: MissionShape, all_arrived: bool, longest_s: float, others: Mapping[str, Path], ages: bool
    ) -> None:
        self._shape, self._all_arrived, self._longest_s, self._others = shape, all_arrived, longest_s, others
        self._ages = ages
        self._struck_s = -math.inf
        self._to_keep: set[tuple[str, str, int]] = set()
        self._keep_until_s = -math.inf
        self._unit = {resource.name for resource in shape.resources if not resource.sharable}
        self._scouts = {
            resource.parameters["network_id"]: resource.name for resource in shape.resources if resource.type == "scout"
        }
        self._holds: dict[str, dict[str, int]] = {resource.name: {} for resource in shape.resources}
        self._newest: dict[str, int] = {}
        self._commanded: dict[int, int] = {}
        self._connected: set[tuple[str, str, int]] = set()
        self._sent: dict[str, dict[str, _Sent]] = {}
        self._gates: dict[str, dict[str, int]] = {}
        self._beliefs: dict[str, _Belief] = {owner.name: _Belief() for owner in shape.owners}
        self._doubts: dict[tuple[str, ...], float] = {}
        self._free: set[str] = set()
        self._down: set[str] = set()
        self._calm_s: float | None = None
        self._wanting: dict[str, float] = {}
        self._granted: dict[str, float] = {}
        self._tree = TracedTree()
        self._stands_from_s: dict[str, float] = {}

    def judge(self, h: Happening) -> Iterator[Broken]:
        """Record an event and yield each law that it violates."""
        yield from self._overdue(h.at_s)
        self._tree.hear(h, self._longest_s)
        match h.what:
            case "held":
                yield from self._held(h, h.values["arc"], h.values["epoch"])
            case "let go":
                yield from self._let_go(h, h.values["arc"], h.values["epoch"])
            case "safe":
                yield from self._safe(h, h.values["arc"])
            case "packet":
                yield from self._packet(h)
            case "stops":
                motion_s = 0.0 if h.values["is_confirmed"] else 2 * COMMAND_TIMEOUT_S
                self._stands_from_s.setdefault(h.values["robot"], h.at_s + motion_s)
            case "lifts":
                self._stands_from_s.pop(h.values["robot"], None)
            case "free":
                self._free.add(h.values["arc"])
                self._must_be_free(h, self._holds.keys() - self._down)
            case "connect":
                self._free.discard(h.values["arc"])
            case "rc_state":
                self._rc_state(h, h.values["id"], h.values["state"])
            case "open":
                yield from self._open(h)
            case "shut":
                self._gates.pop(h.who, None)
            case "resumed":
                self._beliefs[h.who] = _Belief(h.values["epochs"], h.at_s)
                self._granted[h.who] = h.at_s
            case "suspended" | "claims" | "releases":
                self._beliefs[h.who] = _Belief(None, h.at_s)
            case "wants":
                self._wanting[h.who] = h.at_s
            case "killed" | "ends" | "gives up" | "begins":
                self._gone(h)
                self._note_restart(h)
            case "cut off":
                self._struck_s, self._to_keep = h.at_s, set()
            case "revoke":
                self._need_not_keep(h.values["arc"])
            case "fails":
                yield Broken("no-bug", h.at_s, f"{h.who} ended by a bug: {h.values['error']}", (h.who,))
            case "promise broken":
                yield Broken("schedule", h.at_s, h.values["promise"], (h.who,))
            case "calm":
                self._calm_s = h.at_s
            case "over":
                yield from self._progress(h.at_s)
                yield from self._obedience(h.at_s)
        self._compare(h.at_s)

    def _held(self, h: Happening, arc: str, epoch: int) -> Iterator[Broken]:
        holders = self._holds[h.who]
        others = [other for other in holders if other != arc]
        if others and h.who in self._unit:
            yield Broken(
                "one-holder", h.at_s, f"{h.who} is given to {arc} while {others[0]} holds it", (h.who, arc, *others)
            )
        if epoch <= self._newest.get(h.who, -1):
            what = f"{h.who} is held by {arc} under epoch {epoch}, after epoch {self._newest[h.who]}"
            yield Broken("epochs-grow", h.at_s, what, (h.who, arc))
        holders[arc] = self._newest[h.who] = epoch
        self._connected.add((h.who, arc, epoch))
        self._sent.setdefault(h.who, {})[arc] = _Sent(epoch)

    def _must_be_free(self, h: Happening, rcs: Set[str]) -> None:
        """Record that the ARC of this event may hold none of these RCs from now on."""
        held = ((rc, arc, epoch) for rc in sorted(rcs) for arc, epoch in self._holds[rc].items())
        self._doubts |= {(FREED, arc, rc, str(epoch)): h.at_s for rc, arc, epoch in held if arc in self._free}

    def _rc_state(self, h: Happening, rc: str, state: str) -> None:
        if state == "down":
            self._down.add(rc)
        else:
            self._down.discard(rc)
            self._must_be_free(h, {rc})

    def _let_go(self, h: Happening, arc: str, epoch: int) -> Iterator[Broken]:
        if (h.who, arc, epoch) in self._to_keep and h.at_s < self._keep_until_s:
            what = f"{h.who} is taken undecided from {arc}, which held it (epoch {epoch}) when the RC manager died"
            yield Broken("kept", h.at_s, what, (h.who, arc, RC_MANAGER))
        if self._holds[h.who].get(arc) == epoch:
            del self._holds[h.who][arc]

    def _safe(self, h: Happening, arc: str) -> Iterator[Broken]:
        sent = self._sent.get(h.who, {}).get(arc)
        if sent is None:
            return
        sent.is_over = True
        for robot, last in sent.last.items():
            if last != SAFE:
                scout = self._scouts[robot]
                what = f"{h.who} calls itself safe after {arc}, but the last that {scout} heard from it is {last!r}"
                yield Broken("safe", h.at_s, what, (h.who, arc, scout))

    def _packet(self, h: Happening) -> Iterator[Broken]:
        robot, command, arc, epoch = (h.values[name] for name in ("robot", "command", "arc", "epoch"))
        scout = self._scouts[robot]
        commanded = self._commanded[robot] = max(epoch, self._commanded.get(robot, -1))
        newest = commanded if command == SAFE else self._newest.get(scout, -1)
        if epoch < newest:
            what = f"{h.who} sends {command!r} of {arc} to {scout} under epoch {epoch}, which is at {newest}"
            yield Broken("fenced", h.at_s, what, (h.who, arc, scout))
        sent = self._sent.get(h.who, {}).get(arc)
        if command in MOVING and h.at_s > self._stands_from_s.get(scout, math.inf):
            what = f"{h.who} sends {command!r} of {arc} to {scout}, which an operator has stopped"
            yield Broken("stopped", h.at_s, what, (h.who, arc, scout, "operator"))
        if sent is None or sent.is_over:
            what = f"{h.who} sends {command!r} to {scout} for {arc}, which does not hold it"
            yield Broken("fenced", h.at_s, what, (h.who, arc, scout))
            return
        sent.last[robot] = command

    def _open(self, h: Happening) -> Iterator[Broken]:
        epochs: dict[str, int] = h.values["epochs"]
        self._gates[h.who] = dict(epochs)
        for rc, epoch in epochs.items():
            if (rc, h.who, epoch) not in self._connected:
                what = f"{h.who} opens over {rc} under epoch {epoch}, which was never connected to it"
                yield Broken("whole-set", h.at_s, what, (h.who, rc))

    def _gone(self, h: Happening) -> None:
        if h.who in self._holds:
            self._holds[h.who] = {}
            self._sent.pop(h.who, None)
        self._gates.pop(h.who, None)
        if h.who in self._beliefs:
            self._beliefs[h.who] = _Belief(None, h.at_s)

    def _note_restart(self, h: Happening) -> None:
        """Record the holds that must stay, if only the RC manager had a fault lately and is soon restarted."""
        if h.what == "ends" or (h.what == "begins" and h.who != RC_MANAGER):
            self._need_not_keep(h.who)
        if h.who == RC_MANAGER and h.what == "begins" and h.at_s > self._struck_s + SOON_BACK_S:
            self._to_keep = set()
        if h.what != "killed":
            return
        alone = h.who == RC_MANAGER and h.at_s > self._struck_s + UNDISTURBED_S and self._all_arrived
        self._struck_s, self._keep_until_s = h.at_s, h.at_s + UNDISTURBED_S
        self._to_keep = {
            (rc, arc, epoch)
            for arc, epochs in (self._gates.items() if alone else ())
            if all(self._holds[rc].get(arc) == epoch for rc, epoch in epochs.items())
            for rc, epoch in epochs.items()
        }

    def _need_not_keep(self, arc: str) -> None:
        self._to_keep = {hold for hold in self._to_keep if hold[1] != arc}

    def _compare(self, now_s: float) -> None:
        """Record for each pair that should agree the time since which it disagrees."""
        doubts: set[tuple[str, ...]] = set()
        for owner in self._shape.owners:
            believed = self._beliefs[owner.name].epochs
            gate = self._gates.get(owner.arc)
            if believed != gate:
                doubts.add((owner.name, owner.arc))
        for arc, epochs in self._gates.items():
            doubts |= {(arc, rc) for rc, epoch in epochs.items() if self._holds[rc].get(arc) != epoch}
        doubts |= {
            doubt
            for doubt in self._doubts
            if doubt[0] == FREED and doubt[2] not in self._down
            if self._holds[doubt[2]].get(doubt[1]) == int(doubt[3])
        }
        self._doubts = {doubt: self._doubts.get(doubt, now_s) for doubt in sorted(doubts)}

    def _overdue(self, now_s: float) -> Iterator[Broken]:
        """Yield each pair that has disagreed for longer than the allowed delay."""
        calm_s = self._calm_s
        for doubt, since_s in self._doubts.items():
            if doubt[0] == FREED:
                if now_s > since_s + FREED_WITHIN_S + self._longest_s:
                    _, arc, rc, epoch = doubt
                    what = f"{arc} is called free since {since_s:.4f} s and holds {rc} under epoch {epoch}"
                    yield Broken(FREED, now_s, what, (arc, rc))
                continue
            due_s = since_s + STORM_DELAY_S + self._longest_s
            if calm_s is not None:
                due_s = min(due_s, max(since_s, calm_s + RECOVERY_S + self._longest_s) + CALM_DELAY_S)
            if now_s > due_s:
                one, other = doubt
                what = f"{one} and {other} have not agreed on who holds what since {since_s:.4f} s"
                yield Broken("true", now_s, what, (one, other))

    def _progress(self, now_s: float) -> Iterator[Broken]:
        """Judge the calm: each owner that wanted time throughout, and had no rival of higher priority, got time."""
        if self._shape.policy == "strict":
            return  # this policy leaves RCs idle for ARCs that may not start yet
        wanting = [owner for owner in self._shape.owners if owner.name in self._wanting]
        for owner in wanting:
            paths = [self._path(other.arc, other.path) for other in wanting if other is not owner]
            paths += [self._path(arc, path) for arc, path in self._others.items()]
            own = self._path(owner.arc, owner.path)
            if (
                any(higher(path, own) for path in paths)
                or self._granted.get(owner.name, -1.0) >= self._wanting[owner.name]
            ):
                continue
            if self._gates.get(owner.arc):
                continue
            since_s = self._wanting[owner.name]
            what = f"{owner.name} has wanted time since {since_s:.4f} s, got none, and has no higher rival"
            yield Broken("progress", now_s, what, (owner.name, owner.arc))

    def _path(self, arc: str, path: Path) -> Path:
        """Return the present path of an ARC whose owner began with this one; an operator may have changed it."""
        return self._tree.path(arc) or path

    def _obedience(self, now_s: float) -> Iterator[Broken]:
        for node, number, wanted, at_s in () if self._ages else self._tree.disobeyed():
            what = f"{node} has the priority {number}, although an operator set {wanted} at {at_s:.4f} s"
            yield Broken("obeyed", now_s, what, (node, "operator", RC_MANAGER))
