"""The schedule in a recording: its state at any instant, and its decisions made again.

The RC manager sends recorders each event that it decides on. A schedule manager starts from a snapshot, and decides
again on the events after it. Therefore the schedule of each instant is known with all its reasons. The recorded
decisions can also be compared with those of today's release, or of other rules.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from itertools import groupby
from typing import Any

import msgspec

from backbone.addresses import RC_MANAGER
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.rc_manager.messages import Decided, ScheduleSnapshot, TraceLine
from backbone.recording.reader import Recorded, Recording
from backbone.recording.revival import Reviver
from backbone.scheduling import snapshot
from backbone.scheduling.events import Event, Instruction, RcKnown, Record, Woken
from backbone.scheduling.own_planner import load_planner
from backbone.scheduling.rules import SchedulingRules, aging_fault
from backbone.scheduling.schedule_manager import ScheduleManager
from backbone.spoken import counted

_SNAPSHOT = f"{ScheduleSnapshot.__name__}/"
_DECISIONS = tuple(f"{RC_MANAGER}/{conversation}" for conversation in (Conversation.DECISIONS, Conversation.ASK))


FROM_THE_BEGIN = "Record from the begin: scout-backbone up MISSION.xml --record FILE.mcap."


class NotRecorded(Refusal):
    """The recording does not have the schedule of that time."""

    code = "recording.no_schedule"
    remedy = f"Choose a later time. {FROM_THE_BEGIN}"


class NoSuchRule(Refusal):
    """The scheduler has no such rule, or the rule has no such value."""

    code = "usage.rule"
    remedy = "Name a rule and its value as the mission file does, such as policy=strict."


class _ManagerLife:
    """The present life of the RC manager, each of which numbers its messages anew."""

    def __init__(self) -> None:
        self._sequence, self._at_s = 0, 0.0

    def ended_before(self, message: Recorded) -> bool:
        """Return whether this message of the RC manager, the next one in time, is of another life than the last."""
        is_other = message.sequence <= self._sequence and message.at_s > self._at_s
        self._sequence, self._at_s = message.sequence, message.at_s
        return is_other


class RecordedSchedule:
    """The schedule, followed through the decisions in a recording.

    Attributes:
        manager: A schedule manager in the recorded state; None: not known.
        lacks: Reason why the state is not known.
        unread: Number of snapshots of another release.
    """

    def __init__(self) -> None:
        self.manager: ScheduleManager | None = None
        self.lacks = "the recording has no state of the schedule"
        self.unread = 0
        self._number = 0
        self._life = _ManagerLife()

    def take(self, told: Decided | ScheduleSnapshot, message: Recorded) -> None:
        """Apply the next event, or take over the state of a snapshot; after one of another release it is not known.

        Args:
            message: The recorded message that holds it. If it begins another life of the RC manager, only a snapshot
                makes the state known again.
        """
        if self._life.ended_before(message):
            self._lose(told.at_s)
        match told:
            case ScheduleSnapshot():
                if self.manager is None or told.number != self._number:
                    self._take_over(told)
            case Decided() if self.manager is not None and told.number == self._number + 1:
                self._number += 1
                self.manager.handle(told.event, told.at_s)
            case Decided() if self.manager is not None:
                self._lose(told.at_s)

    def _lose(self, at_s: float) -> None:
        self.manager = None
        self.lacks = f"decisions are missing in the recording before {at_s:.3f} s"

    def _take_over(self, told: ScheduleSnapshot) -> None:
        try:
            self.manager, self._number = snapshot.read(told.state), told.number
        except snapshot.NoSnapshot as error:
            self.manager, self.lacks = None, error.detail
            self.unread += 1


def schedule_at(recording: Recording, at_s: float, reviver: Reviver | None = None) -> ScheduleManager:
    """Return a schedule manager in the state that the recorded one had at this mission time.

    Args:
        reviver: Counts the messages of another release, which are left out; None: they are not counted.

    Raises:
        NotRecorded: The recording has no earlier snapshot, or a decision after the snapshot is missing.
    """
    schedule, reviver = RecordedSchedule(), reviver or Reviver()
    for message, told in since_last_snapshot(recording, at_s, reviver):
        schedule.take(told, message)
    reviver.unread += schedule.unread
    if schedule.manager is None:
        raise NotRecorded(f"{schedule.lacks}, asked for {at_s:.3f} s")
    return schedule.manager


def since_last_snapshot(
    recording: Recording, at_s: float, reviver: Reviver | None = None
) -> list[tuple[Recorded, Decided | ScheduleSnapshot]]:
    """Return the last snapshot before this mission time, and all decisions after it, in the order of their numbers.

    Without a snapshot, no decision is of use, and none is returned.
    """
    found, snapshot_s, reviver = list[tuple[Recorded, Decided | ScheduleSnapshot]](), -math.inf, reviver or Reviver()
    if not any(schema.startswith(_SNAPSHOT) for _key, _source, schema in recording.channels().values()):
        return found
    for message in recording.messages(_DECISIONS, 0.0, at_s, RC_MANAGER, newest_first=True):
        if message.at_s < snapshot_s:
            break  # messages of the same time may stand in any order
        match reviver.revived(message, Decided, ScheduleSnapshot):
            case Decided() as decided:
                found.append((message, decided))
            case ScheduleSnapshot() as state:
                found.append((message, state))
                snapshot_s = message.at_s
    return sorted(found, key=lambda one: (one[0].at_s, one[0].sequence))


@dataclass(frozen=True, slots=True)
class OtherDecision:
    """The first decision that differs from the recording.

    Attributes:
        number: Number of the decision.
        at_s: Its mission time.
        event: The event that led to it; ``Woken`` if only the other rules decide at this time.
        recorded: Its lines and their causes, as recorded.
        decided: The same, as decided now.
    """

    number: int
    at_s: float
    event: Event
    recorded: tuple[Record, ...]
    decided: tuple[Record, ...]


@dataclass(slots=True)
class DecisionComparison:
    """The result of making recorded decisions again.

    Attributes:
        decisions: Number of compared decisions.
        grants: Number of grants among their lines.
        missing: Number of decisions that could not be compared, because the recording lacks the event or lines.
            The last one is not counted if only the recording's end can have cut it off, nor are those before the
            first snapshot.
        unread: Number of messages of another form or version, which are left out.
        difference: The first difference; None: all decisions are equal.
    """

    decisions: int = 0
    grants: int = 0
    missing: int = 0
    unread: int = 0
    difference: OtherDecision | None = None


@dataclass(slots=True)
class _RecordedDecision:
    """A recorded decision.

    Attributes:
        heard: Numbers of all its readable messages, from the event to the first message of the next decision.
        is_last: Whether no other decision follows in the recording, which may have ended before its last line.
    """

    decided: Decided
    heard: list[int]
    records: list[Record] = field(default_factory=list)
    is_last: bool = False

    @property
    def is_whole(self) -> bool:
        """Whether no message is missing from the event to the next one: other messages stand between the lines, too."""
        return {*range(self.heard[0], self.heard[-1])} <= {*self.heard}


def decided_anew(recording: Recording, since_s: float = 0.0, **rules: Any) -> DecisionComparison:
    """Let today's schedule manager decide on the recorded events, up to the first difference.

    Args:
        since_s: Begin with the first snapshot after this mission time.
        rules: Other rules, by name, see ``SchedulingRules``; only for a recording that has the RC manager's begin.

    Raises:
        NotRecorded: The recording has no snapshot after ``since_s``, or rules were given and the begin is missing.
        NoSuchRule: The scheduler has no rule of this name, or the rule has no such value in this mission.
        WrongPlanner: The planner among the rules is not a planner.
        NoSnapshot: The recording is of another release.
    """
    found, reviver = DecisionComparison(), Reviver()
    anew: _Anew | None = None
    number, began = 0, False
    for step in _steps(recording, since_s, reviver):
        found.unread = reviver.unread
        if step is None:
            anew, number = None, 0  # skip decisions until the next snapshot
            continue
        if isinstance(step, ScheduleSnapshot):
            if step.number == 0 or (anew is None and not (began and rules)):
                anew, number, began = _Anew(step, rules), step.number, True
            continue
        if anew is None or step.decided.number != number + 1:
            found.missing += max(1, step.decided.number - number) if began else 0
            anew, number = None, step.decided.number
            continue
        number = step.decided.number
        found.difference = anew.of_itself(number, step.decided.at_s)
        if found.difference is not None:
            return found
        recorded, decided = anew.lines(step.records), anew.decide(step.decided.event, step.decided.at_s)
        is_same = [one.line for one in recorded] == [one.line for one in decided]
        begins_alike = [one.line for one in recorded] == [one.line for one in decided[: len(recorded)]]
        if not is_same and step.is_last and begins_alike:
            continue
        if not is_same and not step.is_whole:
            found.missing += 1
            continue
        found.decisions += 1
        found.grants += sum(one.line["ev"] == "grant" for one in recorded)
        if not is_same:
            found.difference = OtherDecision(number, step.decided.at_s, step.decided.event, recorded, decided)
            return found
    if not began:
        without = f", without {counted(reviver.unread, 'message')} of another form" if reviver.unread else ""
        if since_s > 0.0:
            after = f"the recording has no state of the schedule after {since_s:.3f} s{without}"
            raise NotRecorded(after, remedy="Choose an earlier time, or leave out --from.")
        raise NotRecorded(f"the recording has no state of the schedule{without}", remedy=FROM_THE_BEGIN)
    if anew is not None and rules:
        last_s = max(message.at_s for message in recording.messages(source=RC_MANAGER))
        found.difference = anew.of_itself(number + 1, last_s)
    return found


class _Anew:
    """A schedule manager that decides again. If its rules differ, a second one follows the recording unchanged."""

    def __init__(self, begin: ScheduleSnapshot, rules: dict[str, Any]) -> None:
        self._manager = _first(begin, rules)
        self._aging_s = self._manager.rules.aging_s if "aging_s" in rules else 0.0
        self._as_recorded = snapshot.read(begin.state) if rules else None

    def decide(self, event: Event, at_s: float) -> tuple[Record, ...]:
        """Decide on a recorded event; return the lines to compare.

        Raises:
            NoSuchRule: The RC of the event is handed over more slowly than waiting ARCs rise by the given rules.
        """
        if isinstance(event, RcKnown) and (
            fault := aging_fault(self._aging_s, {event.rc: event.connect_s + event.disconnect_s})
        ):
            raise NoSuchRule(fault)
        if self._as_recorded is not None:
            self._as_recorded.handle(event, at_s)
        return self.lines(self._manager.handle(event, at_s))

    def of_itself(self, number: int, before_s: float) -> OtherDecision | None:
        """Wake the manager, until this time, when only it wants to wake; return the first resulting decision."""
        while (wake_s := self._own_wake_s()) is not None and wake_s < before_s:
            decided = self.lines(self._manager.handle(Woken(), wake_s))
            if decided:
                return OtherDecision(number, wake_s, Woken(), (), decided)
        return None

    def _own_wake_s(self) -> float | None:
        if self._as_recorded is None or self._manager.wake_s is None:
            return None
        recorded_s = self._as_recorded.wake_s
        return self._manager.wake_s if recorded_s is None or self._manager.wake_s < recorded_s else None

    def lines(self, told: Iterable[Instruction]) -> tuple[Record, ...]:
        """Return the lines to compare; with other rules, without the lines that begin a section and name the rules."""
        lines = (one for one in told if isinstance(one, Record))
        return tuple(one for one in lines if self._as_recorded is None or one.line["ev"] != "meta")


def _first(begin: ScheduleSnapshot, rules: dict[str, Any]) -> ScheduleManager:
    """Return the manager that decides again."""
    manager = snapshot.read(begin.state)
    if not rules:
        return manager
    if begin.number:
        raise NotRecorded("other rules need a recording from the begin of the mission on")
    try:
        chosen = msgspec.convert(msgspec.to_builtins(manager.rules) | rules, SchedulingRules)
    except msgspec.ValidationError as error:
        raise NoSuchRule(f"{error}; rules are {', '.join(SchedulingRules.__struct_fields__)}") from error
    return manager.begun_anew(chosen, load_planner(chosen.planner))


def _steps(
    recording: Recording, since_s: float, reviver: Reviver
) -> Iterator[ScheduleSnapshot | _RecordedDecision | None]:
    """Yield the snapshots, the decisions with their lines, and None between two lives of the RC manager."""
    step: _RecordedDecision | None = None
    life = _ManagerLife()
    for message in _in_order(recording.messages(since_s=since_s, source=RC_MANAGER)):
        unread, told = reviver.unread, reviver.revived(message, Decided, ScheduleSnapshot, TraceLine)
        if life.ended_before(message):
            if step is not None:
                step.is_last = True
                yield step
            step = None
            yield None
        if step is not None and reviver.unread == unread:
            step.heard.append(message.sequence)
            if isinstance(told, ScheduleSnapshot | Decided):
                yield step
                step = None
        match told:
            case ScheduleSnapshot():
                yield told
            case Decided():
                step = _RecordedDecision(told, [message.sequence])
            case TraceLine() if step is not None:
                step.records.append(Record(told.line, told.cause))
    if step is not None:
        step.is_last = True
        yield step


def _in_order(messages: Iterable[Recorded]) -> Iterator[Recorded]:
    """Yield the messages of one sender in the order of their numbers, also if they have the same time."""
    for _at_s, together in groupby(messages, lambda message: message.at_s):
        yield from sorted(together, key=lambda message: message.sequence)
