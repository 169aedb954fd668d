"""Supervision: what to do about each process when something happens to it.

Events go in, instructions come out. The caller owns the zygote, the bus and the clock: it reports what
happened and when, and does what it is told, in order. Times are seconds of the machine on one clock.

Rules:

* Of one name there is never more than one process: a name is forked again only after its last process
  was reported as ended. Which of them share one is decided in ``shared_processes``; here each is alone.
* In no window of a policy are there more restarts than its limit.
* A process is dead when the zygote says so, never because its liveliness token fell: when the hub
  dies, all tokens fall and everybody lives. A token that rises means ready, nothing else.
* Every ordered start is answered by exactly one ``ReportReady`` or ``ReportStartFailed``, every ordered
  end by exactly one ``ReportEnded``, and only when nothing of the process is left.
* The first start that fails is not repeated: whoever ordered it is told and decides.
"""

from __future__ import annotations

import math
import signal
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

from backbone.creator.messages import AlreadyHere, EndedBy, NotHere, RestartPolicy

TERM_S = 0.5  # chosen: like EndProcess.term_s, for processes nobody ordered the end of
LEAVE_S = 0.15  # chosen: from leaving the bus to the end of a process takes 10 ms, on a busy machine ten times that
NEVER_S = math.inf


@dataclass(frozen=True, slots=True)
class Fork:
    """Have it running; report ``forked`` or ``fork_failed``."""

    name: str


@dataclass(frozen=True, slots=True)
class AskToStop:
    """Ask it to stop; report ``ask_failed`` if it does not say that it will."""

    name: str
    within_s: float


@dataclass(frozen=True, slots=True)
class Signal:
    """Send the signal to everything that belongs to this process."""

    name: str
    pid: int
    number: signal.Signals


@dataclass(frozen=True, slots=True)
class ReportReady:
    """It is ready, for the first time or again."""

    name: str
    pid: int


@dataclass(frozen=True, slots=True)
class ReportStartFailed:
    """It never became ready, and will not by this order."""

    name: str
    how: str


@dataclass(frozen=True, slots=True)
class ReportEnded:
    """Its end was ordered, and nothing of it is left."""

    name: str
    by: EndedBy
    exit_code: int


@dataclass(frozen=True, slots=True)
class ReportLeft:
    """It ended in good order by itself and is not supervised any more."""

    name: str


@dataclass(frozen=True, slots=True)
class ReportFell:
    """It ended unexpectedly.

    Attributes:
        restart_in_s: Pause until its restart; negative: it is given up.
    """

    name: str
    how: str
    restart_in_s: float


@dataclass(frozen=True, slots=True)
class WakeAt:
    """Report ``woken`` at this time at the latest; replaces what earlier answers said."""

    at_s: float


Instruction = (
    Fork | AskToStop | Signal | ReportReady | ReportStartFailed | ReportEnded | ReportLeft | ReportFell | WakeAt
)


class Phase(StrEnum):
    """Where a supervised process is."""

    FORKING = "forking"  # ordered from the zygote, no pid yet
    STARTING = "starting"  # runs, its token has not risen since
    READY = "ready"
    ENDING = "ending"  # asked or signalled
    WAITING = "waiting"  # fell, will be restarted
    GIVEN_UP = "given up"  # fell too often, left down


@dataclass
class _End:
    """How a process is being ended.

    Attributes:
        ordered: False if it is ended because it did not become ready.
        stage: What was done to it last.
        not_heard: Nobody answered when it was asked: it may be on its way out by itself.
    """

    ask_s: float
    term_s: float
    ordered: bool
    stage: EndedBy = EndedBy.ITSELF
    not_heard: bool = False


@dataclass
class Supervised:
    """One name under supervision; only ``Supervision`` changes it.

    Attributes:
        name: The component.
        policy: What to do when it ends unexpectedly.
        ready_within_s: Time it has from the order to readiness, at each start.
        asked_by_signal: True for a hub: asking over the bus it carries would cut the answer off.
        phase: Where it is.
        pid: Its process, 0 while there is none.
        restarts: How often it was restarted.
        last_end: How it ended last, for people; empty if it never did.
    """

    name: str
    policy: RestartPolicy
    ready_within_s: float
    asked_by_signal: bool
    phase: Phase = Phase.FORKING
    pid: int = 0
    restarts: int = 0
    last_end: str = ""
    last_code: int = 0
    deadline_s: float = NEVER_S
    token_rose: bool = False
    start_answered: bool = False
    is_abandoned: bool = False
    failure: str = ""
    end: _End | None = None
    restarted_at_s: deque[float] = field(default_factory=deque)


class Supervision:
    """All supervised processes of one keeper, in the order of their first start."""

    def __init__(self) -> None:
        self._all: dict[str, Supervised] = {}

    def __iter__(self) -> Iterator[Supervised]:
        return iter(self._all.values())

    def find(self, name: str) -> Supervised | None:
        """Return what is known of this name, None if it is not supervised."""
        return self._all.get(name)

    # Orders
    def start_ordered(
        self,
        name: str,
        policy: RestartPolicy,
        ready_within_s: float,
        now_s: float,
        *,
        asked_by_signal: bool = False,
    ) -> list[Instruction]:
        """Begin to supervise a new process.

        Raises:
            AlreadyHere: One of this name is supervised and not given up.
        """
        old = self._all.get(name)
        if old is not None and old.phase is not Phase.GIVEN_UP:
            raise AlreadyHere(f"{name} is {old.phase}, pid {old.pid}", name=name, pid=old.pid)
        self._all.pop(name, None)  # a new order begins at the end of the line
        one = self._all[name] = Supervised(name, policy, ready_within_s, asked_by_signal)
        return self._and_wake(self._fork(one, now_s))

    def end_ordered(self, name: str, ask_s: float, term_s: float, now_s: float) -> list[Instruction]:
        """Begin to end a process, or hurry with it: a second order can only shorten the times of the first.

        Raises:
            NotHere: Nothing of this name is supervised.
        """
        one = self._all.get(name)
        if one is None:
            raise NotHere(f"no {name} here", name=name)
        if one.end is not None:
            end = one.end
            end.ordered = True
            end.ask_s, end.term_s = min(end.ask_s, ask_s), min(end.term_s, term_s)
            left_s = {EndedBy.ASKING: ask_s, EndedBy.SIGTERM: term_s}.get(end.stage, NEVER_S)
            one.deadline_s = min(one.deadline_s, now_s + left_s)
            return self._and_wake([])
        match one.phase:
            case Phase.WAITING | Phase.GIVEN_UP:
                del self._all[name]
                return self._and_wake([ReportEnded(name, EndedBy.ITSELF, one.last_code)])
            case Phase.FORKING:
                one.end, one.deadline_s = _End(ask_s, term_s, ordered=True), NEVER_S
                return self._and_wake([])
            case _:
                one.end = _End(ask_s, term_s, ordered=True)
                return self._and_wake(_next_stage(one, one.end, now_s))

    # What happened
    def forked(self, name: str, pid: int, now_s: float) -> list[Instruction]:
        """Take note that it runs."""
        one = self._all[name]
        one.pid = pid
        if one.end is not None:
            return self._and_wake(_next_stage(one, one.end, now_s))
        one.phase = Phase.STARTING
        return self._and_wake(self._become_ready(one) if one.token_rose else [])

    def fork_failed(self, name: str, why: str, now_s: float) -> list[Instruction]:
        """Take note that there is no process."""
        one = self._all[name]
        return self._and_wake(self._gone(one, one.failure or why, 1, now_s))

    def ready(self, name: str) -> list[Instruction]:
        """Take note that its liveliness token rose; of no meaning for names that are not starting."""
        one = self._all.get(name)
        if one is None or one.end is not None:
            return []
        if one.phase is Phase.STARTING:
            return self._and_wake(self._become_ready(one))
        one.token_rose = one.phase is Phase.FORKING
        return []

    def exited(self, pid: int, returncode: int, now_s: float) -> list[Instruction]:
        """Take note that nothing is left of this process.

        Args:
            pid: Of a process nobody shares.
            returncode: Exit code, or the number of the signal that killed it, negative.
        """
        one = next((each for each in self if each.pid == pid), None)
        if one is None:
            return []
        return self._and_wake(self._gone(one, one.failure or describe(returncode), returncode, now_s))

    def left(self, name: str, returncode: int, how: str, now_s: float) -> list[Instruction]:
        """Take note that nothing is left of this component, which shared its process.

        Args:
            returncode: What a process of its own would have ended with.
            how: For people.
        """
        one = self._all[name]
        return self._and_wake(self._gone(one, one.failure or how, returncode, now_s))

    def ask_failed(self, name: str, now_s: float) -> list[Instruction]:
        """Take note that it could not be asked to stop; it gets SIGTERM unless it is just about to leave."""
        one = self._all.get(name)
        if one is None or one.end is None or one.end.stage is not EndedBy.ASKING:
            return []
        one.end.not_heard, one.deadline_s = True, min(one.deadline_s, now_s + LEAVE_S)
        return self._and_wake([])

    def woken(self, now_s: float) -> list[Instruction]:
        """Do what is due by now."""
        instructions: list[Instruction] = []
        for one in list(self):
            if one.deadline_s <= now_s:
                instructions += self._due(one, now_s)
        return self._and_wake(instructions)

    # Steps
    def _due(self, one: Supervised, now_s: float) -> list[Instruction]:
        match one.phase:
            case Phase.WAITING:
                one.restarts += 1
                one.restarted_at_s.append(now_s)
                return self._fork(one, now_s)
            case _ if one.end is not None:
                return _next_stage(one, one.end, now_s)
            case Phase.FORKING:  # the zygote hangs: it may still obey, then the process is ended at once
                one.end = self._fail(one)
                if one.start_answered:
                    return []
                one.start_answered = one.is_abandoned = True
                return [ReportStartFailed(one.name, one.failure)]
            case _:
                one.end = self._fail(one)
                return _next_stage(one, one.end, now_s)

    def _fail(self, one: Supervised) -> _End:
        one.failure = f"was not ready within {one.ready_within_s:g} s"
        one.deadline_s = NEVER_S
        return _End(0.0, TERM_S, ordered=False)

    def _fork(self, one: Supervised, now_s: float) -> list[Instruction]:
        one.phase, one.pid, one.token_rose, one.failure, one.end = Phase.FORKING, 0, False, "", None
        one.deadline_s = now_s + one.ready_within_s
        return [Fork(one.name)]

    def _become_ready(self, one: Supervised) -> list[Instruction]:
        one.phase, one.deadline_s, one.start_answered = Phase.READY, NEVER_S, True
        return [ReportReady(one.name, one.pid)]

    def _gone(self, one: Supervised, how: str, returncode: int, now_s: float) -> list[Instruction]:
        """Decide what follows from the end of its process."""
        one.pid, one.last_end, one.last_code, one.deadline_s = 0, how, returncode, NEVER_S
        answers: list[Instruction] = []
        was_answered = one.start_answered
        if not was_answered:
            answers.append(ReportStartFailed(one.name, how))
        if one.end is not None and one.end.ordered:
            answers.append(ReportEnded(one.name, _by(one.end, returncode), returncode))
            del self._all[one.name]
        elif not was_answered or one.is_abandoned:
            del self._all[one.name]
        elif returncode == 0 and one.end is None and not one.policy.after_good_end:
            answers.append(ReportLeft(one.name))
            del self._all[one.name]
        else:
            answers.append(self._fall(one, how, now_s))
        return answers

    def _fall(self, one: Supervised, how: str, now_s: float) -> ReportFell:
        policy, past = one.policy, one.restarted_at_s
        while past and past[0] <= now_s - policy.window_s:
            past.popleft()
        one.end, one.failure = None, ""
        if not policy.restart or len(past) >= policy.limit:
            one.phase = Phase.GIVEN_UP
            return ReportFell(one.name, how, -1.0)
        pause_s = min(policy.back_off_s * 2.0 ** len(past), policy.back_off_most_s)
        one.phase, one.deadline_s = Phase.WAITING, now_s + pause_s
        return ReportFell(one.name, how, pause_s)

    def _and_wake(self, instructions: list[Instruction]) -> list[Instruction]:
        at_s = min((one.deadline_s for one in self), default=NEVER_S)
        return instructions if at_s == NEVER_S else [*instructions, WakeAt(at_s)]


def _next_stage(one: Supervised, end: _End, now_s: float) -> list[Instruction]:
    """Ask, then SIGTERM, then SIGKILL. What is not ready cannot be asked."""
    was_ready, one.phase = one.phase is Phase.READY, Phase.ENDING
    match end.stage:
        case EndedBy.ITSELF if was_ready:
            end.stage, one.deadline_s = EndedBy.ASKING, now_s + end.ask_s
            if one.asked_by_signal:
                return [Signal(one.name, one.pid, signal.SIGTERM)]
            return [AskToStop(one.name, end.ask_s)]
        case EndedBy.ITSELF | EndedBy.ASKING:
            end.stage, one.deadline_s = EndedBy.SIGTERM, now_s + end.term_s
            return [Signal(one.name, one.pid, signal.SIGTERM)]
        case _:
            end.stage, one.deadline_s = EndedBy.SIGKILL, NEVER_S
            return [Signal(one.name, one.pid, signal.SIGKILL)]


def _by(end: _End, returncode: int) -> EndedBy:
    """Return what it took. Who was not asked in truth, or dies otherwise than in good order, ended by itself."""
    if end.stage is EndedBy.ASKING and (end.not_heard or returncode != 0):
        return EndedBy.ITSELF
    return end.stage


def describe(returncode: int) -> str:
    """Return how a process ended, for people.

    Example:
        >>> describe(1), describe(-9)
        ('exit code 1', 'killed by SIGKILL')
    """
    if returncode >= 0:
        return f"exit code {returncode}"
    try:
        return f"killed by {signal.Signals(-returncode).name}"
    except ValueError:
        return f"killed by signal {-returncode}"
