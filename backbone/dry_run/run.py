"""Dry run of a mission: the hosts of its components, and the first part of its master schedule.

A dry run starts no process. It assumes that all hosts are equal and idle, that every component comes up at once, that
every behavior claims its ARC at the start and keeps it, and that no console attaches. It calls the deciding code of the
placer and of the RC manager, so its result equals a mission without disturbances.
"""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import msgspec

from backbone.component_database.messages import ComponentType
from backbone.dependency_database.inventory import Inventory
from backbone.dependency_database.messages import FindRcs
from backbone.dry_run.hang_watch import Hangs, Progress, result_unless_it_hangs
from backbone.errors import BackboneError, Refusal, code_of, complaint
from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode, PathStep, walk
from backbone.mission.model import MissionDescription
from backbone.naming import Subsystem, address
from backbone.placer.messages import NoHost
from backbone.placer.placement import CandidateHost, place
from backbone.rc_manager.recovery import rc_known
from backbone.rc_manager.service import TOLERANCE_S
from backbone.scheduling.claims import scheduling_request
from backbone.scheduling.events import Event, Instruction, Requested
from backbone.scheduling.explain.answers import Answers
from backbone.scheduling.own_planner import MEND, WrongPlanner, load_planner
from backbone.scheduling.rehearsal import Rehearsal, Timetable
from backbone.scheduling.requests import SchedulingRequest, Usage
from backbone.scheduling.rules import SchedulingRules
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.scheduling.trace import Line
from backbone.scheduling.views import Why

FIRST_MINUTE_S = 60.0
DECIDES_WITHIN_S = 10.0  # chosen: a decision takes milliseconds, that of a large group a second on a loaded machine


@dataclass(frozen=True, slots=True)
class Placed:
    """One component and its host.

    Attributes:
        host: Its host; empty: no host is possible.
        reasons: The reasons of the choice or of the refusal, one line for each host.
    """

    name: str
    type: str
    host: str
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Claimed:
    """The request of one behavior's ARC and its outcome.

    Attributes:
        behavior: Name of its owner.
        priority: The owner's place in the tree, for people: ``mission:10/watch:3``.
        rcs: Its RCs; empty: it was refused.
        minimum_s: Shortest useful time, seconds.
        refused: Why it can never be served; empty: it was admitted.
        turns: Grants until the end of the dry run.
        first_grant_s: Mission time of the first grant; None: no grant.
        worst_wait_s: Longest wait, including a wait at the end.
        why: Its state at the end, with the reason; None: it was refused, or got a turn.
    """

    arc: str
    behavior: str
    priority: str
    rcs: tuple[str, ...]
    minimum_s: float
    refused: str
    turns: int
    first_grant_s: float | None
    worst_wait_s: float
    why: Why | None

    @property
    def never_runs(self) -> bool:
        """True if it was refused, or got no turn and none is predicted."""
        return bool(self.refused) or (self.turns == 0 and self.why is not None and self.why.expected_start_s < 0)


@dataclass(frozen=True, slots=True)
class DryRun:
    """The result of a dry run.

    Attributes:
        placed: Its components in the order of their start.
        claimed: The requests of its behaviors in the order of the file.
        timetable: The slices of all ARCs.
        trace: Every decision, in the RC manager's format.
        last: The dry run of the last branch, with all its resources free; None: the mission has none.
        last_name: Name of its root; empty: none.
    """

    mission: str
    placed: Sequence[Placed]
    claimed: Sequence[Claimed]
    timetable: Timetable
    trace: Sequence[Line]
    last: DryRun | None = None
    last_name: str = ""

    @property
    def can_come_up(self) -> bool:
        """True if every component has a host and no request is refused, those of the last branch included."""
        comes_up = all(placed.host for placed in self.placed) and not any(claimed.refused for claimed in self.claimed)
        return comes_up and (self.last is None or self.last.can_come_up)

    def write_trace(self, file: Path) -> None:
        """Write the trace as JSON lines.

        Raises:
            OSError: The file cannot be written.
        """
        lines = [*self.trace, {"ev": "end", "t": self.timetable.end_s}]
        file.write_text("".join(json.dumps(line) + "\n" for line in lines))


def dry_run(description: MissionDescription, for_s: float = FIRST_MINUTE_S) -> DryRun:
    """Run a mission from its start without starting a process.

    Args:
        for_s: Mission seconds, at least 0; the last branch is tried for at most its own time.

    Raises:
        WrongPlanner: The mission's own planner cannot be loaded, fails at work, or hangs.
    """
    rules, progress = _rules(description), Progress()
    work = partial(_dry_run, description, for_s, progress)
    if not rules.planner:
        return work()
    try:
        return result_unless_it_hangs(work, progress, DECIDES_WITHIN_S)
    except Hangs as hangs:
        raise WrongPlanner(f"{rules.planner}: {hangs}", remedy=MEND) from hangs
    except BackboneError:
        raise
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # a SystemExit would end the command without a word
        raise WrongPlanner(f"{rules.planner}: {complaint(error)}", remedy=MEND) from error


def _rules(description: MissionDescription) -> SchedulingRules:
    return msgspec.convert(description.core_parameters("rc_manager"), SchedulingRules)


@dataclass(frozen=True, slots=True)
class _Counted:
    """A schedule manager whose decisions are counted."""

    manager: ScheduleManager
    progress: Progress

    def handle(self, event: Event, now_s: float) -> list[Instruction]:
        """Count and decide."""
        self.progress.steps += 1
        return self.manager.handle(event, now_s)


def _dry_run(description: MissionDescription, for_s: float, progress: Progress) -> DryRun:
    rules = _rules(description)
    placed = placements(description)
    hosts = {one.name: one.host for one in placed}
    manager = ScheduleManager(
        rules,
        tolerance_s=TOLERANCE_S,
        mission=description.name,
        mission_priority=description.priority,
        planner=load_planner(rules.planner),
    )
    rehearsal = Rehearsal(_Counted(manager, progress), opening_lines=manager.opening_lines())
    for resource in description.resources:
        rehearsal.tell(msgspec.structs.replace(rc_known(resource, None), up=bool(hosts[resource.name])))
    answers = Answers(manager)
    asked = [(claim, *_ask(manager, rehearsal, claim, hosts)) for claim in _claims(description)]
    rehearsal.run(for_s)
    timetable = Timetable(rehearsal.trace, rehearsal.now_s)
    claimed = []
    for one in asked:
        progress.steps += 1
        claimed.append(_claimed(answers, timetable, *one))
    found = DryRun(description.name, placed, claimed, timetable, rehearsal.trace)
    at_the_end, last = description.at_the_end, description.last
    if at_the_end is None or last is None:
        return found
    return replace(found, last=_dry_run(at_the_end, min(for_s, last.within_s), progress), last_name=last.behavior.name)


def placements(description: MissionDescription) -> list[Placed]:
    """Return the host of each component, in the order of their starts: hardware, then the tree with its ARCs.

    A behavior whose parent has no host is not started, so it is not in the result.
    """
    types = {one.name: one for one in description.types}
    counts: Counter[str] = Counter()
    found: list[Placed] = []

    def start(kind: str, name: str, pin: str = "") -> bool:
        found.append(_place(description, types[kind], name, pin, counts))
        counts[found[-1].host] += 1
        return bool(found[-1].host)

    def start_branch(behavior: BehaviorNode) -> None:
        if not start(behavior.type, behavior.name):
            return
        if behavior.arc is not None:
            start(behavior.arc.kind, _arc_name(behavior, behavior.arc))
        for child in behavior.children:
            start_branch(child)

    for component in description.components:
        start(component.type, component.name, component.host)
    for resource in description.resources:
        start(resource.type, resource.name, resource.host)
    for unit in description.units:
        start(unit.type, unit.name, unit.host)
    for behavior in description.behaviors:
        start_branch(behavior)
    return found


def _place(
    description: MissionDescription, component_type: ComponentType, name: str, pin: str, counts: Counter[str]
) -> Placed:
    hosts = [CandidateHost(host.name, frozenset(host.tags), components=counts[host.name]) for host in description.hosts]
    try:
        choice = place(name, component_type.tags, pin, hosts)
    except NoHost as refusal:
        return Placed(name, component_type.name, "", (refusal.detail,))
    return Placed(name, component_type.name, choice.host, choice.reasons)


@dataclass(frozen=True, slots=True)
class _BehaviorClaim:
    """A behavior's claim, or why the behavior cannot claim."""

    arc: str
    behavior: BehaviorNode
    path: Sequence[PathStep]
    request: SchedulingRequest | None
    obstacle: str = ""


def requests(description: MissionDescription) -> list[SchedulingRequest]:
    """Return the requests of the ARCs of the mission's behaviors, parents before children."""
    return [claim.request for claim in _claims(description) if claim.request is not None]


def _claims(description: MissionDescription) -> Iterator[_BehaviorClaim]:
    inventory = Inventory(description.resources)
    needs = {one.name: one.needs for one in description.types}
    for path, behavior in walk(description.behaviors, [(description.name, description.priority)]):
        wish = behavior.arc
        if wish is None:
            continue
        arc = _arc_name(behavior, wish)
        features = {kind: list(names) for kind, names in wish.features.items()}
        try:
            sets = inventory.find(FindRcs(needs[wish.kind], wish.wish, features))
        except Refusal as refusal:
            yield _BehaviorClaim(arc, behavior, path, None, _refusal_text(refusal))
            continue
        request = scheduling_request(
            arc,
            sets,
            owner=address(Subsystem.MISSION_CONTROL, behavior.name),
            path=path,
            streams=[Usage(wish.period_s, wish.packet_time_s, kind=wish.kind)],
            minimum_runtime_s=wish.minimum_runtime_s,
            maximum_runtime_s=wish.maximum_runtime_s,
            sharable=inventory.sharable(sets),
        )
        yield _BehaviorClaim(arc, behavior, path, request)


def _ask(
    manager: ScheduleManager, rehearsal: Rehearsal, claim: _BehaviorClaim, hosts: dict[str, str]
) -> tuple[tuple[str, ...], str]:
    """Send the ARC's request, if the ARC and its behavior have hosts; return its RCs, or why it is refused."""
    if claim.request is None:
        return (), claim.obstacle
    nowhere = [name for name, _ in claim.path[1:] if not hosts.get(name)]
    if not hosts.get(claim.arc):
        return (), f"{[*nowhere, claim.arc][0]} has no host, so no ARC is asked for"
    try:
        rcs = manager.choose(claim.request)
    except Refusal as refusal:
        return (), _refusal_text(refusal)
    rehearsal.tell(Requested(claim.request, rcs))
    return rcs, ""


def _claimed(
    answers: Answers, timetable: Timetable, claim: _BehaviorClaim, rcs: tuple[str, ...], refused: str
) -> Claimed:
    wish = claim.behavior.arc
    grants = [run.grant_s for run in timetable.of_arc(claim.arc) if run.grant_s is not None]
    return Claimed(
        arc=claim.arc,
        behavior=claim.behavior.name,
        priority="/".join(f"{name}:{number}" for name, number in claim.path),
        rcs=rcs,
        minimum_s=wish.minimum_runtime_s if wish is not None else 0.0,
        refused=refused,
        turns=len(grants),
        first_grant_s=min(grants, default=None),
        worst_wait_s=timetable.worst_wait_s(claim.arc),
        why=None if refused or grants else answers.why(claim.arc, timetable.end_s),
    )


def _arc_name(behavior: BehaviorNode, wish: ArcNeed) -> str:
    return f"{behavior.name}-{wish.kind}"


def _refusal_text(refusal: Refusal) -> str:
    return f"{refusal.detail} [{code_of(refusal)}]: {refusal.remedy}"
