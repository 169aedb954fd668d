"""Supervision: decides starts, restarts and ends of processes.

Events go in, instructions come out. The caller owns the zygote, the bus and the clock: it reports each event with its
time and carries out the instructions in order. Times are seconds of the machine on one clock.

Rules:

* A name never has more than one process: it is forked again only after its last process was reported as ended.
  ``shared_processes`` decides about shared processes; here each component has a process of its own.
* A wanted component is restarted however it ended, after growing pauses, until an order ends it. If its policy is
  without restart, its owner asks for a new start. No window of a policy has more quick restarts than its limit.
* Only the zygote's report means that a process is dead. The end of a liveliness token does not, because all tokens end
  when the hub dies while all components live. A new token means ready, nothing else.
* Each ordered start gets exactly one ``ReportReady`` or ``ReportStartFailed``; each ordered end gets exactly one
  ``ReportEnded``, after the whole process tree has ended.
* A first start that fails by itself (an exit code above 0, silence) is not repeated, because its owner decides. A
  first start that ends from outside (a signal, a stop) is repeated under any policy, because its owner still waits. If
  it ended so ``FIRST_STARTS`` times, the component itself is the reason (a crash in a C library, a stop of its own).
* A process that is being ended gets its times without the time in which it could not run, up to ``LATE_MOST_S``. On a
  full machine the ends of many components would otherwise need signals, and an RC that is killed leaves its hardware as
  it is.
* A ready process that is silent for longer than its policy allows hangs. It is killed before it is restarted, so a
  process that was only paused never gets a second copy.
"""

from __future__ import annotations

import math
import signal
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

from backbone.component.messages import Absence
from backbone.creator.decisions import (
    AskToStop,
    ForkComponent,
    Instruction,
    ReportEnded,
    ReportFell,
    ReportLeft,
    ReportReady,
    ReportSilent,
    ReportStartFailed,
    SendSignal,
    SupervisionWakesAt,
    describe,
)
from backbone.creator.messages import START_MOST_S, AlreadyHere, EndedBy, NotHere, RestartPolicy
from backbone.creator.silence import SHOWN_AFTER_S

TERM_S = 0.5  # chosen: like EndProcess.term_s, for ends without an order
LATE_MOST_S = 20.0  # chosen: four times what a busy machine took to end forty components; then it is too late to obey
LEAVE_S = 0.5  # chosen: a process ends 10 ms after it has left the bus; two looks at how long it could not run
FIRST_STARTS = 5  # chosen: more than a person or the system ends by chance; takes under 2 s with its pauses
NEVER_S = math.inf


class Phase(StrEnum):
    """Phase of a supervised process."""

    FORKING = "forking"  # ordered from the zygote, no pid yet
    STARTING = "starting"  # runs, but its token does not exist yet
    READY = "ready"
    ENDING = "ending"  # asked or signalled
    WAITING = "waiting"  # fell, will be restarted


@dataclass
class _End:
    """How a process is being ended.

    Attributes:
        ordered: False if it is ended because it did not become ready.
        stage: The last step.
        not_heard: True if the request to stop got no answer, because the process may be ending by itself.
        late_s: Seconds by which its times are longer so far.
    """

    ask_s: float
    term_s: float
    ordered: bool
    stage: EndedBy = EndedBy.ITSELF
    not_heard: bool = False
    late_s: float = 0.0


@dataclass
class Supervised:
    """One supervised component; only ``Supervision`` changes it.

    Attributes:
        ready_within_s: Silence after which a start has failed.
        asked_by_signal: True for a hub, because its own end would cut off its answer on the bus.
        pid: Its process, 0 while there is none.
        last_end: How it last ended, for people; empty if it never ended.
        silent_s: Duration of a ready process's silence.
        absent_since_s: Time of its end or of the start of its silence; negative while it is ready and responds.
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
    silent_s: float = 0.0
    absent_since_s: float = -1.0
    began_s: float = 0.0
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
        """Return the component of this name, None if it is not supervised."""
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
            AlreadyHere: A component of this name is supervised.
        """
        old = self._all.get(name)
        if old is not None:
            raise AlreadyHere(f"{name} is {old.phase}, pid {old.pid}", name=name, pid=old.pid)
        one = self._all[name] = Supervised(name, policy, ready_within_s, asked_by_signal)
        return self._and_wake(self._fork(one, now_s))

    def end_ordered(self, name: str, ask_s: float, term_s: float, now_s: float) -> list[Instruction]:
        """Begin to end a process. A second order can only shorten the times of the first.

        Raises:
            NotHere: No component of this name is supervised.
        """
        one = self._all.get(name)
        if one is None:
            raise NotHere(f"no component {name} runs here", name=name)
        if one.end is not None:
            end = one.end
            end.ordered = True
            end.ask_s, end.term_s = min(end.ask_s, ask_s), min(end.term_s, term_s)
            left_s = {EndedBy.ASKING: ask_s, EndedBy.SIGTERM: term_s}.get(end.stage, NEVER_S)
            one.deadline_s = min(one.deadline_s, now_s + left_s)
            return self._and_wake([])
        match one.phase:
            case Phase.WAITING:
                del self._all[name]
                failed = [] if one.start_answered else [ReportStartFailed(name, one.last_end)]
                return self._and_wake([*failed, ReportEnded(name, EndedBy.ITSELF, one.last_code)])
            case Phase.FORKING:
                one.end, one.deadline_s = _End(ask_s, term_s, ordered=True), NEVER_S
                return self._and_wake([])
            case _:
                one.end = _End(ask_s, term_s, ordered=True)
                return self._and_wake(_next_stage(one, one.end, now_s))

    # Events
    def forked(self, name: str, pid: int, now_s: float) -> list[Instruction]:
        """Record that the process runs."""
        one = self._all[name]
        one.pid = pid
        if one.end is not None:
            return self._and_wake(_next_stage(one, one.end, now_s))
        one.phase, one.deadline_s = Phase.STARTING, now_s + one.ready_within_s
        return self._and_wake(self._become_ready(one) if one.token_rose else [])

    def fork_failed(self, name: str, why: str, now_s: float, returncode: int = 1) -> list[Instruction]:
        """Record a failed fork: the system refused a process, or the shared process ended with this code."""
        one = self._all[name]
        return self._and_wake(self._gone(one, why, returncode, now_s))

    def ready(self, name: str) -> list[Instruction]:
        """Record the component's new liveliness token; ignored unless the component is starting."""
        one = self._all.get(name)
        if one is None or one.end is not None:
            return []
        if one.phase is Phase.STARTING:
            return self._and_wake(self._become_ready(one))
        one.token_rose = one.phase is Phase.FORKING
        return []

    def exited(self, pid: int, returncode: int, now_s: float, cause: str = "") -> list[Instruction]:
        """Record that the whole process tree has ended.

        Args:
            pid: Pid of a process that is not shared.
            returncode: Exit code, or the number of the signal that killed it, negative.
            cause: The bug or the refusal that ended it, or the place at which it hung; empty: unknown.
        """
        one = next((each for each in self if each.pid == pid), None)
        if one is None:
            return []
        return self._and_wake(self._gone(one, describe(returncode, cause), returncode, now_s, cause))

    def left(self, name: str, returncode: int, how: str, now_s: float, cause: str = "") -> list[Instruction]:
        """Record the end of a member of a shared process.

        Args:
            returncode: Return code that a process of its own would have had.
            how: How it ended, for people.
            cause: See ``exited``, of its process.
        """
        return self._and_wake(self._gone(self._all[name], how, returncode, now_s, cause))

    def ask_failed(self, name: str, now_s: float) -> list[Instruction]:
        """Record that the request to stop got no answer; SIGTERM follows unless the process is just ending."""
        one = self._all.get(name)
        if one is None or one.end is None or one.end.stage is not EndedBy.ASKING:
            return []
        one.end.not_heard, one.deadline_s = True, min(one.deadline_s, now_s + LEAVE_S)
        return self._and_wake([])

    def observed(self, name: str, silent_s: float, now_s: float, late_s: float = 0.0) -> list[Instruction]:
        """Record the silence of its process; ignored for a component without a process.

        Args:
            late_s: Seconds since the last observation in which it could not run; its end may take so much longer,
                and ``LATE_MOST_S`` in all.
        """
        one = self._all.get(name)
        if one is None:
            return []
        if one.end is not None:
            late_s = min(late_s, LATE_MOST_S - one.end.late_s)
            one.end.late_s, one.deadline_s = one.end.late_s + late_s, one.deadline_s + late_s
            return self._and_wake([]) if late_s else []
        if one.phase is Phase.STARTING:
            one.deadline_s = min(now_s - silent_s + one.ready_within_s, one.began_s + START_MOST_S)
            return self._and_wake([])
        if one.phase is not Phase.READY:
            return []
        was_silent, one.silent_s = one.silent_s >= SHOWN_AFTER_S, silent_s
        is_silent = silent_s >= SHOWN_AFTER_S
        one.absent_since_s = now_s - silent_s if is_silent else -1.0
        instructions: list[Instruction] = (
            [ReportSilent(name, silent_s if is_silent else 0.0)] if was_silent != is_silent else []
        )
        if silent_s < one.policy.hung_after_s:
            return instructions  # no deadline has changed; with hundreds of components their search takes long
        one.failure = f"hung: no sign of life for {silent_s:.1f} s"
        one.end = _End(0.0, TERM_S, ordered=False, stage=EndedBy.SIGTERM)
        return self._and_wake([*instructions, *_next_stage(one, one.end, now_s)])

    def absences(self, now_s: float) -> list[Absence]:
        """Return the components that do not run or respond; times are seconds of the machine."""
        return [_absence(one, now_s) for one in self if one.absent_since_s >= 0 and not _is_ended_on_order(one)]

    def woken(self, now_s: float) -> list[Instruction]:
        """Return the instructions that are due by ``now_s``."""
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
            case Phase.FORKING:  # the zygote hangs; if it forks later, the process is ended at once
                one.end = self._fail(one)
                if one.start_answered:
                    return []
                one.start_answered = one.is_abandoned = True
                return [ReportStartFailed(one.name, one.failure)]
            case _:
                one.end = self._fail(one)
                return _next_stage(one, one.end, now_s)

    def _fail(self, one: Supervised) -> _End:
        one.failure = f"was not ready and showed no sign of life for {one.ready_within_s:g} s"
        one.deadline_s = NEVER_S
        return _End(0.0, TERM_S, ordered=False)

    def _fork(self, one: Supervised, now_s: float) -> list[Instruction]:
        one.phase, one.pid, one.token_rose, one.failure, one.end = Phase.FORKING, 0, False, "", None
        one.began_s, one.deadline_s = now_s, now_s + START_MOST_S
        return [ForkComponent(one.name)]

    def _become_ready(self, one: Supervised) -> list[Instruction]:
        one.phase, one.deadline_s, one.start_answered = Phase.READY, NEVER_S, True
        one.silent_s, one.absent_since_s = 0.0, -1.0
        return [ReportReady(one.name, one.pid)]

    def _gone(self, one: Supervised, how: str, returncode: int, now_s: float, cause: str = "") -> list[Instruction]:
        """Return the instructions after the end of the process."""
        how = f"{one.failure}{cause and ': '}{cause}" if one.failure else how
        one.pid, one.last_end, one.last_code, one.deadline_s, one.silent_s = 0, how, returncode, NEVER_S, 0.0
        was_answered, is_ordered = one.start_answered, one.end is not None and one.end.ordered
        came_from_outside = returncode <= 0 and one.end is None and not one.is_abandoned
        if not was_answered and came_from_outside and one.restarts + 1 < FIRST_STARTS:
            return [self._fall(one, how, now_s)]
        answers: list[Instruction] = [] if was_answered else [ReportStartFailed(one.name, how)]
        if one.end is not None and is_ordered:
            answers.append(ReportEnded(one.name, _by(one.end, returncode), returncode))
            del self._all[one.name]
        elif not was_answered or one.is_abandoned:
            del self._all[one.name]
        elif returncode == 0 and one.end is None and not one.policy.restart:
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
        if one.absent_since_s < 0:
            one.absent_since_s = now_s
        if not policy.restart and one.start_answered:
            del self._all[one.name]
            return ReportFell(one.name, how, -1.0)
        failing = len(past) >= policy.limit
        pause_s = (
            policy.failing_pause_s if failing else min(policy.back_off_s * 2.0 ** len(past), policy.back_off_most_s)
        )
        one.phase, one.deadline_s = Phase.WAITING, now_s + pause_s
        return ReportFell(one.name, how, pause_s, failing)

    def _and_wake(self, instructions: list[Instruction]) -> list[Instruction]:
        at_s = min((one.deadline_s for one in self), default=NEVER_S)
        return instructions if at_s == NEVER_S else [*instructions, SupervisionWakesAt(at_s)]


def _is_ended_on_order(one: Supervised) -> bool:
    return one.end is not None and one.end.ordered


def _absence(one: Supervised, now_s: float) -> Absence:
    match one.phase:
        case Phase.READY:
            cause = f"hung: no sign of life for {one.silent_s:.1f} s"
            doing = f"is replaced after {one.policy.hung_after_s:g} s"
        case Phase.ENDING:
            cause, doing = one.failure, "is being ended, then restarted"
        case Phase.WAITING:
            cause, doing = one.last_end, f"restarts in {max(0.0, one.deadline_s - now_s):.1f} s"
        case _:
            cause, doing = one.last_end, f"is restarting, restart {one.restarts}"
    return Absence(one.name, one.absent_since_s, cause, doing)


def _next_stage(one: Supervised, end: _End, now_s: float) -> list[Instruction]:
    """Ask, then SIGTERM, then SIGKILL. A process that is not ready is asked by SIGTERM."""
    was_ready, one.phase = one.phase is Phase.READY, Phase.ENDING
    match end.stage:
        case EndedBy.ITSELF if was_ready or end.ask_s > 0:
            end.stage, one.deadline_s = EndedBy.ASKING, now_s + end.ask_s
            if one.asked_by_signal or not was_ready:
                return [SendSignal(one.name, one.pid, signal.SIGTERM)]
            return [AskToStop(one.name, end.ask_s)]
        case EndedBy.ITSELF | EndedBy.ASKING:
            end.stage, one.deadline_s = EndedBy.SIGTERM, now_s + end.term_s
            return [SendSignal(one.name, one.pid, signal.SIGTERM)]
        case _:
            end.stage, one.deadline_s = EndedBy.SIGKILL, NEVER_S
            return [SendSignal(one.name, one.pid, signal.SIGKILL)]


def _by(end: _End, returncode: int) -> EndedBy:
    """Return the step that ended the process; ``ITSELF`` if it got no request or did not end by the request."""
    if end.stage is EndedBy.ASKING and (end.not_heard or returncode != 0):
        return EndedBy.ITSELF
    return end.stage
