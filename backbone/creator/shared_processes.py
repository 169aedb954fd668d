"""Shared processes: when each is forked, which members it admits, and when it ends.

Events go in, instructions come out. ``supervision`` decides about each component and knows no shared process: for it,
an admission is a fork, and the end of a membership is the end of a process. Times are seconds of the machine on one
clock.

Rules:

* A shared process never has more than one pid: it is forked again only after its last pid was reported as ended.
* Each wanted member gets exactly one ``MemberRuns`` or ``MemberNotStarted``. Each member that runs gets exactly one
  ``MemberGone``, after its end.
* A process without members is ended. Its last member counts as gone only when the process has ended.
* A process is killed if one of its members must be killed, or if it does not serve or admit in time. Then all its
  members are gone, and each is restarted by its own policy. A member whose admission was pending is admitted to the
  next process.
"""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import StrEnum

from backbone.creator.decisions import describe
from backbone.creator.supervision import LATE_MOST_S, TERM_S

SERVES_WITHIN_S = 10.0  # chosen: of silence; a session opens within 15 ms, or fails after 5 s
ADMITS_WITHIN_S = 5.0  # chosen: of silence; an answer takes a millisecond
NEVER_S = math.inf


@dataclass(frozen=True, slots=True)
class ForkProcess:
    """Fork the process with the launch of this member; report ``forked`` or ``fork_failed``."""

    process: str
    name: str


@dataclass(frozen=True, slots=True)
class AdmitMember:
    """Ask the process to admit the member; report ``admitted`` and later ``member_ended``, or ``refused``."""

    process: str
    pid: int
    name: str
    life: int


@dataclass(frozen=True, slots=True)
class EndMemberAlone:
    """Ask the process to end this member in good order."""

    process: str
    pid: int
    name: str
    life: int


@dataclass(frozen=True, slots=True)
class SignalProcess:
    """Send the signal to the process tree."""

    process: str
    pid: int
    number: signal.Signals


@dataclass(frozen=True, slots=True)
class MemberRuns:
    """The member was admitted and lives in this process."""

    name: str
    pid: int


@dataclass(frozen=True, slots=True)
class MemberNotStarted:
    """The member does not live, and this order is not repeated.

    Attributes:
        returncode: Return code of its process, if the process ended first; 1: refused, or no process.
    """

    name: str
    why: str
    returncode: int = 1


@dataclass(frozen=True, slots=True)
class MemberGone:
    """The member has ended.

    Attributes:
        returncode: Exit code of the member, or return code of its process.
        how: How it ended, for people.
        cause: What ended its process, or the place at which its process hung; empty: unknown.
    """

    name: str
    returncode: int
    how: str
    cause: str = ""


@dataclass(frozen=True, slots=True)
class ProcessesWakeAt:
    """Report ``woken`` at this time at the latest; replaces earlier ``ProcessesWakeAt``."""

    at_s: float


ProcessInstruction = (
    ForkProcess
    | AdmitMember
    | EndMemberAlone
    | SignalProcess
    | MemberRuns
    | MemberNotStarted
    | MemberGone
    | ProcessesWakeAt
)


class _Phase(StrEnum):
    FORKING = "forking"  # ordered, no pid yet
    STARTING = "starting"  # runs, cannot be asked yet
    SERVING = "serving"
    ENDING = "ending"  # signalled


class _Place(StrEnum):
    WAITING = "waiting"  # for the process to serve
    ADMITTING = "admitting"  # asked for, not answered
    LIVING = "living"
    DONE = "done"  # to be reported when the process is gone


@dataclass
class _Membership:
    name: str
    place: _Place = _Place.WAITING
    life: int = 0
    deadline_s: float = NEVER_S
    report: MemberGone | MemberNotStarted | None = None


@dataclass
class _Process:
    name: str
    phase: _Phase = _Phase.FORKING
    pid: int = 0
    serving_pid: int = 0
    deadline_s: float = NEVER_S
    late_s: float = 0.0
    failure: str = ""
    members: dict[str, _Membership] = field(default_factory=dict)


class SharedProcesses:
    """All shared processes of one keeper."""

    def __init__(self) -> None:
        self._all: dict[str, _Process] = {}
        self._last_life = 0

    def has(self, pid: int) -> bool:
        """Return whether this is the pid of a shared process."""
        return any(process.pid == pid for process in self._all.values())

    def pids(self) -> set[int]:
        """Return the pids of all shared processes."""
        return {process.pid for process in self._all.values() if process.pid}

    # Orders
    def wanted(self, name: str, process: str, now_s: float) -> list[ProcessInstruction]:
        """Begin the membership of a component that is a member of no process."""
        one = self._all.get(process)
        if one is None:
            one = self._all[process] = _Process(process)
            one.members[name] = _Membership(name)
            return self._and_wake([ForkProcess(process, name)])
        one.members[name] = _Membership(name)
        return self._and_wake(self._admit_waiting(one, now_s) if one.phase is _Phase.SERVING else [])

    def signalled(self, name: str, number: signal.Signals) -> list[ProcessInstruction]:
        """Begin to end a running member: SIGKILL ends it with its process, any other signal ends it alone."""
        for one in self._all.values():
            member = one.members.get(name)
            if member is None or member.place is not _Place.LIVING:
                continue
            if number is signal.SIGKILL:
                return self._and_wake(self._kill(one))
            return [EndMemberAlone(one.name, one.pid, name, member.life)]
        return []

    # Events
    def forked(self, process: str, pid: int, now_s: float) -> list[ProcessInstruction]:
        """Record that the process runs."""
        one = self._all[process]
        one.phase, one.pid, one.deadline_s = _Phase.STARTING, pid, now_s + SERVES_WITHIN_S
        return self.serving(process, pid, now_s) if one.serving_pid == pid else self._and_wake([])

    def fork_failed(self, process: str, why: str) -> list[ProcessInstruction]:
        """Record that the system refused a process."""
        one = self._all.pop(process)
        return self._and_wake([MemberNotStarted(member.name, why) for member in one.members.values()])

    def serving(self, process: str, pid: int, now_s: float) -> list[ProcessInstruction]:
        """Record that the process serves; ignored unless this pid is starting."""
        one = self._all.get(process)
        if one is None:
            return []
        one.serving_pid = pid
        if one.phase is not _Phase.STARTING or one.pid != pid:
            return []
        one.phase, one.deadline_s = _Phase.SERVING, NEVER_S
        return self._and_wake(self._admit_waiting(one, now_s))

    def admitted(self, life: int) -> list[ProcessInstruction]:
        """Record that the member of this life was admitted."""
        for one, member in self._everybody():
            if member.life == life and member.place is _Place.ADMITTING:
                member.place, member.deadline_s = _Place.LIVING, NEVER_S
                return self._and_wake([MemberRuns(member.name, one.pid)])
        return []

    def refused(self, life: int, why: str, now_s: float) -> list[ProcessInstruction]:
        """Record that the process refused the member of this life."""
        for one, member in self._everybody():
            if member.life == life and member.place is _Place.ADMITTING:
                return self._leaves(one, member, MemberNotStarted(member.name, why), now_s)
        return []

    def member_ended(self, life: int, exit_code: int, now_s: float, cause: str = "") -> list[ProcessInstruction]:
        """Record that the member of this life has ended, because of a bug or a refusal if there is a cause."""
        for one, member in self._everybody():
            if member.life == life and member.place is _Place.LIVING:
                return self._leaves(one, member, MemberGone(member.name, exit_code, describe(exit_code, cause)), now_s)
        return []

    def exited(self, pid: int, returncode: int, cause: str = "") -> list[ProcessInstruction]:
        """Record that the whole process tree has ended, because of this cause; empty: unknown."""
        one = next((process for process in self._all.values() if process.pid == pid), None)
        if one is None:
            return []
        del self._all[one.name]
        how = f"its process {one.name}: {one.failure or describe(returncode, cause)}"
        was_ended = one.phase is _Phase.ENDING and not one.failure
        instructions: list[ProcessInstruction] = []
        left: dict[str, _Membership] = {}
        for member in one.members.values():
            if member.report is not None:
                instructions.append(member.report)
            elif member.place is _Place.LIVING:
                instructions.append(MemberGone(member.name, returncode, how, cause))
            elif was_ended:
                left[member.name] = _Membership(member.name)
            else:  # a start is repeated after an outside signal, not after a failure of the process itself
                instructions.append(MemberNotStarted(member.name, how, 1 if one.failure else returncode))
        if left:
            self._all[one.name] = _Process(one.name, members=left)
            instructions.append(ForkProcess(one.name, next(iter(left))))
        return self._and_wake(instructions)

    def observed(self, pid: int, silent_s: float, now_s: float, late_s: float = 0.0) -> list[ProcessInstruction]:
        """Record the silence of this process: its deadlines count from the start of the silence.

        Args:
            late_s: Seconds since the last observation in which it could not run; its end may take so much longer,
                and ``LATE_MOST_S`` in all.
        """
        has_changed = False
        for one in self._all.values():
            if one.pid != pid:
                continue
            if one.phase is _Phase.STARTING:
                one.deadline_s, has_changed = now_s - silent_s + SERVES_WITHIN_S, True
            elif one.phase is _Phase.ENDING and late_s:
                late_s = min(late_s, LATE_MOST_S - one.late_s)
                one.late_s, one.deadline_s, has_changed = one.late_s + late_s, one.deadline_s + late_s, True
            for member in one.members.values():
                if member.place is _Place.ADMITTING:
                    member.deadline_s, has_changed = now_s - silent_s + ADMITS_WITHIN_S, True
        return self._and_wake([]) if has_changed else []

    def woken(self, now_s: float) -> list[ProcessInstruction]:
        """Return the instructions that are due by ``now_s``."""
        instructions: list[ProcessInstruction] = []
        for one in list(self._all.values()):
            if one.deadline_s <= now_s:
                if one.phase is _Phase.STARTING:
                    one.failure = f"did not serve within {SERVES_WITHIN_S:g} s"
                instructions += self._kill(one)
            for member in one.members.values():
                if member.deadline_s <= now_s:
                    why = f"its process {one.name} did not admit it within {ADMITS_WITHIN_S:g} s"
                    member.place, member.deadline_s = _Place.DONE, NEVER_S
                    member.report = MemberNotStarted(member.name, why)
                    instructions += self._kill(one)
        return self._and_wake(instructions)

    # Steps
    def _admit_waiting(self, one: _Process, now_s: float) -> list[ProcessInstruction]:
        instructions: list[ProcessInstruction] = []
        for member in one.members.values():
            if member.place is _Place.WAITING:
                self._last_life += 1
                member.place, member.life = _Place.ADMITTING, self._last_life
                member.deadline_s = now_s + ADMITS_WITHIN_S
                instructions.append(AdmitMember(one.name, one.pid, member.name, member.life))
        return instructions

    def _leaves(
        self, one: _Process, member: _Membership, report: MemberGone | MemberNotStarted, now_s: float
    ) -> list[ProcessInstruction]:
        """Report a member's end: at once while others remain, else together with the end of the process."""
        if any(other is not member and other.report is None for other in one.members.values()):
            del one.members[member.name]
            return self._and_wake([report])
        member.place, member.report, member.deadline_s = _Place.DONE, report, NEVER_S
        if one.phase is _Phase.ENDING:
            return self._and_wake([])
        one.phase, one.deadline_s = _Phase.ENDING, now_s + TERM_S
        return self._and_wake([SignalProcess(one.name, one.pid, signal.SIGTERM)])

    def _kill(self, one: _Process) -> list[ProcessInstruction]:
        one.phase, one.deadline_s = _Phase.ENDING, NEVER_S
        return [SignalProcess(one.name, one.pid, signal.SIGKILL)]

    def _everybody(self) -> Iterator[tuple[_Process, _Membership]]:
        for one in self._all.values():
            for member in one.members.values():
                yield one, member

    def _and_wake(self, instructions: list[ProcessInstruction]) -> list[ProcessInstruction]:
        at_s = min(
            (
                deadline_s
                for one in self._all.values()
                for deadline_s in (one.deadline_s, *(member.deadline_s for member in one.members.values()))
            ),
            default=NEVER_S,
        )
        return instructions if at_s == NEVER_S else [*instructions, ProcessesWakeAt(at_s)]
