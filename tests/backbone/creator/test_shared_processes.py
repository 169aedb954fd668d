"""Shared processes: laws over random histories first, then single decisions."""

from __future__ import annotations

import signal

import hypothesis.strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from backbone.creator.shared_processes import (
    ADMITS_WITHIN_S,
    SERVES_WITHIN_S,
    AdmitMember,
    EndMemberAlone,
    ForkProcess,
    MemberGone,
    MemberNotStarted,
    MemberRuns,
    ProcessesWakeAt,
    ProcessInstruction,
    SharedProcesses,
    SignalProcess,
)
from backbone.creator.supervision import LATE_MOST_S, TERM_S

NAMES = ("scout1", "scout2", "radio", "video1")
HOMES = {"scout1": "pool", "scout2": "pool", "radio": "pool", "video1": "other"}


class RandomHistories(RuleBasedStateMachine):
    """Processes that serve, hang and die, and members that come and go, at random; laws at every step."""

    def __init__(self) -> None:
        super().__init__()
        self.shared, self.now_s, self.wake_s, self.next_pid = SharedProcesses(), 0.0, float("inf"), 100
        self.forking: list[str] = []
        self.live: dict[str, int] = {}
        self.terminated: set[int] = set()
        self.asked_to_admit: dict[int, tuple[str, int]] = {}
        self.lives: dict[int, tuple[str, int]] = {}
        self.wanted: set[str] = set()
        self.runs: dict[str, int] = {}

    def do(self, instructions: list[ProcessInstruction]) -> None:
        for instruction in instructions:
            match instruction:
                case ForkProcess(process=process, name=name):
                    assert process not in self.live, "one pid for each process"
                    assert process not in self.forking
                    assert HOMES[name] == process
                    assert name in self.wanted
                    self.forking.append(process)
                case AdmitMember(process=process, pid=pid, name=name, life=life):
                    assert self.live[process] == pid
                    assert life not in self.asked_to_admit, "a life is given once"
                    assert life not in self.lives
                    assert name in self.wanted
                    self.asked_to_admit[life] = (name, pid)
                case EndMemberAlone(pid=pid, name=name, life=life):
                    assert self.lives[life] == (name, pid)
                case SignalProcess(process=process, pid=pid):
                    assert self.live[process] == pid
                    self.terminated.add(pid)
                case MemberRuns(name=name, pid=pid):
                    assert name in self.wanted, "a wish is answered once"
                    assert pid in self.live.values()
                    self.wanted.remove(name)
                    self.runs[name] = pid
                case MemberNotStarted(name=name):
                    assert name in self.wanted, "a wish is answered once"
                    self.wanted.remove(name)
                case MemberGone(name=name):
                    pid = self.runs.pop(name)
                    assert (name, pid) not in self.lives.values(), "gone means that nothing is left"
                    others = [each for each in self.runs.values() if each == pid]
                    assert others or pid not in self.live.values() or self.is_needed(pid)
                case ProcessesWakeAt(at_s=at_s):
                    self.wake_s = at_s

    def is_needed(self, pid: int) -> bool:
        return any(HOMES[name] == process for process, own in self.live.items() if own == pid for name in self.wanted)

    def pass_time(self, by_s: float) -> None:
        end_s = self.now_s + by_s
        while self.wake_s <= end_s:
            self.now_s, self.wake_s = max(self.now_s, self.wake_s), float("inf")
            self.do(self.shared.woken(self.now_s))
        self.now_s = end_s

    @rule(name=st.sampled_from(NAMES))
    def want(self, name: str) -> None:
        if name not in self.wanted and name not in self.runs:
            self.wanted.add(name)
            self.do(self.shared.wanted(name, HOMES[name], self.now_s))

    @rule(by_s=st.floats(0.0, 12.0))
    def wait(self, by_s: float) -> None:
        self.pass_time(by_s)

    @precondition(lambda self: self.forking)
    @rule(works=st.booleans(), serves_first=st.booleans())
    def fork(self, works: bool, serves_first: bool) -> None:
        process = self.forking.pop(0)
        if not works:
            self.do(self.shared.fork_failed(process, "no process"))
            return
        self.next_pid += 1
        self.live[process] = self.next_pid
        if serves_first:
            self.do(self.shared.serving(process, self.next_pid, self.now_s))
        self.do(self.shared.forked(process, self.next_pid, self.now_s))

    @precondition(lambda self: self.live)
    @rule(data=st.data())
    def serve(self, data: st.DataObject) -> None:
        process, pid = data.draw(st.sampled_from(sorted(self.live.items())))
        self.do(self.shared.serving(process, pid, self.now_s))

    @precondition(lambda self: self.asked_to_admit)
    @rule(data=st.data(), admits=st.booleans())
    def answer(self, data: st.DataObject, admits: bool) -> None:
        life = data.draw(st.sampled_from(sorted(self.asked_to_admit)))
        name, pid = self.asked_to_admit.pop(life)
        if admits:
            self.lives[life] = (name, pid)
            self.do(self.shared.admitted(life))
        else:
            self.do(self.shared.refused(life, "no", self.now_s))

    @precondition(lambda self: self.lives)
    @rule(data=st.data(), code=st.sampled_from([0, 1]))
    def end_member(self, data: st.DataObject, code: int) -> None:
        life = data.draw(st.sampled_from(sorted(self.lives)))
        del self.lives[life]
        self.do(self.shared.member_ended(life, code, self.now_s))

    @precondition(lambda self: self.runs)
    @rule(data=st.data(), number=st.sampled_from([signal.SIGTERM, signal.SIGKILL]))
    def signal_member(self, data: st.DataObject, number: signal.Signals) -> None:
        name = data.draw(st.sampled_from(sorted(self.runs)))
        if any(life == (name, self.runs[name]) for life in self.lives.values()):
            self.do(self.shared.signalled(name, number))

    @precondition(lambda self: self.live)
    @rule(data=st.data())
    def die(self, data: st.DataObject) -> None:
        self.exit(data.draw(st.sampled_from(sorted(self.live))))

    def exit(self, process: str) -> None:
        pid = self.live.pop(process)
        self.asked_to_admit = {life: one for life, one in self.asked_to_admit.items() if one[1] != pid}
        self.lives = {life: one for life, one in self.lives.items() if one[1] != pid}
        assert self.shared.has(pid)
        self.do(self.shared.exited(pid, -9))
        assert not self.shared.has(pid)
        assert pid not in self.runs.values(), "whoever lived there is gone"

    @invariant()
    def nothing_is_late(self) -> None:
        assert self.wake_s >= self.now_s

    def teardown(self) -> None:
        """In a world that obeys, every wanted member runs in the end, and no member's process is ended."""
        self.pass_time(SERVES_WITHIN_S + ADMITS_WITHIN_S)
        for _ in range(100):
            for process, pid in list(self.live.items()):
                if pid in self.terminated:
                    self.exit(process)
            while self.forking:
                self.fork(works=True, serves_first=False)  # type: ignore[call-arg]
            for process, pid in list(self.live.items()):
                self.do(self.shared.serving(process, pid, self.now_s))
            for life, one in list(self.asked_to_admit.items()):
                del self.asked_to_admit[life]
                self.lives[life] = one
                self.do(self.shared.admitted(life))
        assert not self.wanted
        assert set(self.live) == {HOMES[name] for name in self.runs}, "a process lives as long as it has members"


TestRandomHistories = RandomHistories.TestCase


def living(*names: str) -> SharedProcesses:
    """Return a process ``pool`` with pid 7 in which these live as lives 1, 2 …"""
    shared = SharedProcesses()
    for name in names:
        shared.wanted(name, "pool", 0.0)
    shared.forked("pool", 7, 0.0)
    shared.serving("pool", 7, 0.0)
    for life, _ in enumerate(names, start=1):
        shared.admitted(life)
    return shared


def without_wake(instructions: list[ProcessInstruction]) -> list[ProcessInstruction]:
    return [each for each in instructions if not isinstance(each, ProcessesWakeAt)]


def test_the_first_member_has_the_process_forked_and_the_others_wait_for_it() -> None:
    shared = SharedProcesses()
    assert shared.wanted("scout1", "pool", 0.0) == [ForkProcess("pool", "scout1")]
    assert shared.wanted("radio", "pool", 0.0) == []
    assert shared.forked("pool", 7, 1.0) == [ProcessesWakeAt(1.0 + SERVES_WITHIN_S)]
    admissions = shared.serving("pool", 7, 2.0)
    assert without_wake(admissions) == [AdmitMember("pool", 7, "scout1", 1), AdmitMember("pool", 7, "radio", 2)]
    assert without_wake(shared.admitted(2)) == [MemberRuns("radio", 7)]


def test_a_token_that_rises_before_the_pid_is_known_counts() -> None:
    shared = SharedProcesses()
    shared.wanted("scout1", "pool", 0.0)
    assert shared.serving("pool", 7, 0.0) == []
    assert without_wake(shared.forked("pool", 7, 0.0)) == [AdmitMember("pool", 7, "scout1", 1)]


def test_a_late_comer_is_admitted_at_once() -> None:
    shared = living("scout1")
    assert without_wake(shared.wanted("radio", "pool", 5.0)) == [AdmitMember("pool", 7, "radio", 2)]


def test_a_member_that_ends_leaves_the_others_alone() -> None:
    shared = living("scout1", "radio")
    assert shared.member_ended(1, 1, 5.0) == [MemberGone("scout1", 1, "exit code 1")]


def test_the_last_member_is_gone_when_its_process_is() -> None:
    shared = living("scout1")
    assert shared.member_ended(1, 0, 5.0) == [SignalProcess("pool", 7, signal.SIGTERM), ProcessesWakeAt(5.0 + TERM_S)]
    assert without_wake(shared.woken(5.0 + TERM_S)) == [SignalProcess("pool", 7, signal.SIGKILL)]
    assert shared.exited(7, -9) == [MemberGone("scout1", 0, "exit code 0")]


def test_a_process_that_could_not_run_while_it_ends_gets_that_time_more() -> None:
    shared = living("scout1")
    shared.member_ended(1, 0, 5.0)
    assert shared.observed(7, 0.0, 5.25, late_s=0.25) == [ProcessesWakeAt(5.25 + TERM_S)]
    assert shared.observed(7, 0.2, 5.5) == []
    shared.observed(7, 0.2, 105.5, late_s=100.0)
    assert without_wake(shared.woken(5.0 + TERM_S + LATE_MOST_S)) == [SignalProcess("pool", 7, signal.SIGKILL)]


def test_who_is_wanted_while_the_process_ends_gets_a_new_one() -> None:
    shared = living("scout1")
    shared.member_ended(1, 0, 5.0)
    assert without_wake(shared.wanted("radio", "pool", 5.1)) == []
    assert shared.exited(7, 0) == [MemberGone("scout1", 0, "exit code 0"), ForkProcess("pool", "radio")]


def test_a_killed_process_takes_everybody_along() -> None:
    shared = living("scout1", "radio")
    how = "its process pool: killed by SIGKILL"
    assert shared.exited(7, -9) == [MemberGone("scout1", -9, how), MemberGone("radio", -9, how)]
    assert shared.wanted("scout1", "pool", 6.0) == [ForkProcess("pool", "scout1")]


def test_a_process_that_hangs_takes_its_members_along_with_the_place() -> None:
    place, how = "pan.py, line 7, in update", "its process pool: killed by SIGKILL"
    assert living("scout1").exited(7, -9, place) == [MemberGone("scout1", -9, how, place)]


def test_a_member_is_told_to_end_alone_and_killed_with_its_process() -> None:
    shared = living("scout1", "radio")
    assert shared.signalled("scout1", signal.SIGTERM) == [EndMemberAlone("pool", 7, "scout1", 1)]
    assert shared.signalled("scout1", signal.SIGKILL) == [SignalProcess("pool", 7, signal.SIGKILL)]


def test_a_process_that_never_serves_is_killed_and_nobody_is_started() -> None:
    shared = SharedProcesses()
    shared.wanted("scout1", "pool", 0.0)
    shared.forked("pool", 7, 0.0)
    assert without_wake(shared.woken(SERVES_WITHIN_S)) == [SignalProcess("pool", 7, signal.SIGKILL)]
    assert shared.exited(7, -9) == [MemberNotStarted("scout1", "its process pool: did not serve within 10 s")]


def test_a_signal_that_ends_a_process_before_it_admits_is_told_as_such() -> None:
    """So that its members' start is begun again, as that of a process of their own."""
    shared = SharedProcesses()
    shared.wanted("scout1", "pool", 0.0)
    shared.forked("pool", 7, 0.0)
    how = "its process pool: killed by SIGTERM"
    assert shared.exited(7, -15) == [MemberNotStarted("scout1", how, -15)]


def test_a_process_that_does_not_admit_is_killed_and_who_lived_there_is_gone() -> None:
    shared = living("scout1")
    shared.wanted("radio", "pool", 1.0)
    assert without_wake(shared.woken(1.0 + ADMITS_WITHIN_S)) == [SignalProcess("pool", 7, signal.SIGKILL)]
    assert shared.exited(7, -9) == [
        MemberGone("scout1", -9, "its process pool: killed by SIGKILL"),
        MemberNotStarted("radio", "its process pool did not admit it within 5 s"),
    ]


def test_what_is_said_of_an_earlier_life_changes_nothing() -> None:
    shared = living("scout1", "radio")
    shared.member_ended(1, 1, 1.0)
    shared.wanted("scout1", "pool", 2.0)
    assert shared.member_ended(1, 1, 2.0) == []
    assert without_wake(shared.admitted(3)) == [MemberRuns("scout1", 7)]
