"""Supervision: laws over random histories first, then single decisions."""

from __future__ import annotations

import signal

import hypothesis.strategies as st
import pytest
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

from backbone.creator.messages import AlreadyHere, EndedBy, NotHere, RestartPolicy
from backbone.creator.supervision import (
    LEAVE_S,
    TERM_S,
    AskToStop,
    Fork,
    Instruction,
    Phase,
    ReportEnded,
    ReportFell,
    ReportLeft,
    ReportReady,
    ReportStartFailed,
    Signal,
    Supervision,
    WakeAt,
    describe,
)

NAMES = ("scout1", "scout2", "radio")
POLICIES = st.builds(
    RestartPolicy,
    restart=st.booleans(),
    back_off_s=st.floats(0.01, 1.0),
    back_off_most_s=st.floats(0.5, 2.0),
    limit=st.integers(0, 3),
    window_s=st.floats(1.0, 20.0),
    after_good_end=st.booleans(),
)


class RandomHistories(RuleBasedStateMachine):
    """A world of processes that live, fall, hang and obey at random; the laws are checked at every step."""

    def __init__(self) -> None:
        super().__init__()
        self.supervision, self.now_s, self.wake_s, self.next_pid = Supervision(), 0.0, float("inf"), 100
        self.forking: list[str] = []
        self.live: dict[str, int] = {}
        self.killed: set[int] = set()
        self.policies: dict[str, RestartPolicy] = {}
        self.restarts: dict[str, list[float]] = {}
        self.starts_open: set[str] = set()
        self.ends_open: set[str] = set()
        self.given_up: set[str] = set()

    def do(self, instructions: list[Instruction], ordered: str = "") -> None:
        for instruction in instructions:
            match instruction:
                case Fork(name=name):
                    assert name not in self.live, f"{name} would run twice"
                    assert name not in self.forking, f"{name} would be forked twice"
                    self.forking.append(name)
                    if name != ordered:
                        self.count_restart(name)
                case AskToStop(name=name):
                    assert name in self.live
                case Signal(name=name, pid=pid, number=number):
                    assert self.live[name] == pid
                    if number is signal.SIGKILL:
                        self.killed.add(pid)
                case ReportReady(name=name, pid=pid):
                    assert self.live[name] == pid
                    self.starts_open.discard(name)
                case ReportStartFailed(name=name):
                    assert name in self.starts_open, "a start is answered once"
                    self.starts_open.remove(name)
                case ReportEnded(name=name):
                    assert name in self.ends_open, "an end is answered once"
                    assert name not in self.live, "an end is answered when it is done"
                    self.ends_open.remove(name)
                case ReportLeft(name=name):
                    assert name not in self.live
                    assert not self.policies[name].after_good_end
                case ReportFell(name=name, restart_in_s=restart_in_s):
                    assert name not in self.live
                    if restart_in_s < 0:
                        self.given_up.add(name)
                    else:
                        assert restart_in_s <= self.policies[name].back_off_most_s
                case WakeAt(at_s=at_s):
                    self.wake_s = at_s

    def count_restart(self, name: str) -> None:
        policy = self.policies[name]
        assert policy.restart
        times = self.restarts.setdefault(name, [])
        times.append(self.now_s)
        within = [at_s for at_s in times if at_s > self.now_s - policy.window_s]
        assert len(within) <= policy.limit, f"{len(within)} restarts in {policy.window_s} s"

    @rule(name=st.sampled_from(NAMES), policy=POLICIES, ready_within_s=st.floats(0.1, 5.0))
    def order_start(self, name: str, policy: RestartPolicy, ready_within_s: float) -> None:
        known = self.supervision.find(name)
        try:
            instructions = self.supervision.start_ordered(name, policy, ready_within_s, self.now_s)
        except AlreadyHere:
            assert known is not None
            assert known.phase is not Phase.GIVEN_UP
            return
        self.policies[name], self.restarts[name] = policy, []
        self.given_up.discard(name)
        self.starts_open.add(name)
        self.do(instructions, ordered=name)

    @rule(name=st.sampled_from(NAMES), ask_s=st.floats(0.0, 2.0), term_s=st.floats(0.0, 1.0))
    def order_end(self, name: str, ask_s: float, term_s: float) -> None:
        try:
            instructions = self.supervision.end_ordered(name, ask_s, term_s, self.now_s)
        except NotHere:
            assert name not in self.live
            return
        self.ends_open.add(name)
        self.do(instructions)

    @precondition(lambda self: self.forking)
    @rule(data=st.data(), works=st.booleans(), token_first=st.booleans())
    def answer_fork(self, data: st.DataObject, works: bool, token_first: bool) -> None:
        name = data.draw(st.sampled_from(self.forking))
        self.forking.remove(name)
        if not works:
            self.do(self.supervision.fork_failed(name, "no processes left", self.now_s))
            return
        self.next_pid += 1
        self.live[name] = self.next_pid
        if token_first:
            self.do(self.supervision.ready(name))
        self.do(self.supervision.forked(name, self.next_pid, self.now_s))

    @rule(name=st.sampled_from(NAMES))
    def raise_token(self, name: str) -> None:
        if name in self.live:
            self.do(self.supervision.ready(name))

    @precondition(lambda self: self.live)
    @rule(data=st.data(), returncode=st.sampled_from([0, 0, 1, 5, -9, -15]))
    def exit(self, data: st.DataObject, returncode: int) -> None:
        name = data.draw(st.sampled_from(sorted(self.live)))
        pid = self.live.pop(name)
        self.do(self.supervision.exited(pid, returncode, self.now_s))
        self.do(self.supervision.exited(pid, returncode, self.now_s))  # told twice: of no effect

    @rule(name=st.sampled_from(NAMES))
    def fail_to_ask(self, name: str) -> None:
        self.do(self.supervision.ask_failed(name, self.now_s))

    @rule(duration_s=st.floats(0.0, 3.0))
    def pass_time(self, duration_s: float) -> None:
        until_s = self.now_s + duration_s
        while self.wake_s <= until_s:
            self.now_s, self.wake_s = max(self.now_s, self.wake_s), float("inf")
            self.do(self.supervision.woken(self.now_s))
        self.now_s = until_s

    @invariant()
    def the_picture_is_true(self) -> None:
        assert {one.name: one.pid for one in self.supervision if one.pid} == self.live
        for name in self.given_up:
            one = self.supervision.find(name)
            assert one is None or one.phase is Phase.GIVEN_UP
        for one in self.supervision:
            waits_for_time = one.phase in (Phase.STARTING, Phase.WAITING, Phase.ENDING) and one.pid not in self.killed
            assert one.deadline_s < float("inf") or not waits_for_time, f"{one.name} would be {one.phase} for ever"
        assert self.wake_s <= min((one.deadline_s for one in self.supervision), default=float("inf"))

    def teardown(self) -> None:
        """Whatever happened, ordering the end of all ends all and answers everybody, within the times ordered."""
        for one in list(self.supervision):
            self.ends_open.add(one.name)
            self.do(self.supervision.end_ordered(one.name, 1.0, 0.5, self.now_s))
        for name in list(self.forking):
            self.forking.remove(name)
            self.next_pid += 1
            self.live[name] = self.next_pid
            self.do(self.supervision.forked(name, self.next_pid, self.now_s))
        self.pass_time(1.6)
        assert set(self.live.values()) <= self.killed
        for pid in list(self.live.values()):
            self.live = {name: each for name, each in self.live.items() if each != pid}
            self.do(self.supervision.exited(pid, -9, self.now_s))
        assert not self.starts_open
        assert not self.ends_open
        assert not list(self.supervision)


TestRandomHistories = RandomHistories.TestCase


def running(policy: RestartPolicy | None = None, *, asked_by_signal: bool = False) -> Supervision:
    """Return a supervision under which ``scout1`` is ready, pid 7."""
    supervision = Supervision()
    supervision.start_ordered("scout1", policy or RestartPolicy(), 5.0, 0.0, asked_by_signal=asked_by_signal)
    supervision.forked("scout1", 7, 0.0)
    assert ReportReady("scout1", 7) in supervision.ready("scout1")
    return supervision


def test_ending_escalates_from_asking_to_sigterm_to_sigkill() -> None:
    supervision = running()
    assert supervision.end_ordered("scout1", 1.5, 0.5, 10.0) == [AskToStop("scout1", 1.5), WakeAt(11.5)]
    assert supervision.woken(11.5) == [Signal("scout1", 7, signal.SIGTERM), WakeAt(12.0)]
    assert supervision.woken(12.0) == [Signal("scout1", 7, signal.SIGKILL)]
    assert supervision.exited(7, -9, 12.1) == [ReportEnded("scout1", EndedBy.SIGKILL, -9)]


def test_who_cannot_be_asked_gets_sigterm_unless_it_is_about_to_leave() -> None:
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    assert supervision.ask_failed("scout1", 10.0) == [WakeAt(10.0 + LEAVE_S)]
    assert supervision.woken(10.0 + LEAVE_S)[0] == Signal("scout1", 7, signal.SIGTERM)
    assert supervision.exited(7, 0, 10.2) == [ReportEnded("scout1", EndedBy.SIGTERM, 0)]


def test_who_was_about_to_leave_when_asked_ended_by_itself() -> None:
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    supervision.ask_failed("scout1", 10.0)
    assert supervision.exited(7, 0, 10.01) == [ReportEnded("scout1", EndedBy.ITSELF, 0)]


def test_a_hub_is_asked_by_signal() -> None:
    supervision = running(asked_by_signal=True)
    assert supervision.end_ordered("scout1", 1.5, 0.5, 10.0)[0] == Signal("scout1", 7, signal.SIGTERM)
    assert supervision.exited(7, 0, 10.2) == [ReportEnded("scout1", EndedBy.ASKING, 0)]


def test_a_second_order_to_end_can_only_hurry() -> None:
    supervision = running()
    supervision.end_ordered("scout1", 1.5, 0.5, 10.0)
    assert supervision.end_ordered("scout1", 9.0, 9.0, 10.5) == [WakeAt(11.5)]
    assert supervision.end_ordered("scout1", 0.1, 0.1, 10.5) == [WakeAt(10.6)]


def test_what_is_not_ready_is_ended_without_asking() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    assert supervision.end_ordered("scout1", 1.5, 0.5, 1.0)[0] == Signal("scout1", 7, signal.SIGTERM)
    assert supervision.exited(7, 0, 1.1) == [
        ReportStartFailed("scout1", "exit code 0"),
        ReportEnded("scout1", EndedBy.SIGTERM, 0),
    ]


def test_back_off_doubles_up_to_its_most_and_the_limit_gives_up() -> None:
    policy = RestartPolicy(back_off_s=0.1, back_off_most_s=0.3, limit=3, window_s=60.0)
    supervision, now_s, pauses = running(policy), 1.0, []
    for pid in range(7, 11):
        told = supervision.exited(pid, 1, now_s)
        fell = next(each for each in told if isinstance(each, ReportFell))
        pauses.append(fell.restart_in_s)
        if fell.restart_in_s >= 0:
            now_s += fell.restart_in_s
            assert supervision.woken(now_s)[0] == Fork("scout1")
            supervision.forked("scout1", pid + 1, now_s)
            supervision.ready("scout1")
    assert pauses == [0.1, 0.2, 0.3, -1.0]
    assert supervision.end_ordered("scout1", 1.0, 1.0, now_s) == [ReportEnded("scout1", EndedBy.ITSELF, 1)]


def test_restarts_before_the_window_count_no_longer() -> None:
    policy = RestartPolicy(back_off_s=0.1, limit=1, window_s=10.0)
    supervision = running(policy)
    supervision.exited(7, 1, 1.0)
    supervision.woken(1.1)
    supervision.forked("scout1", 8, 1.1)
    assert ReportFell("scout1", "exit code 1", 0.1) in supervision.exited(8, 1, 11.2)


def test_who_ends_in_good_order_by_itself_is_let_go() -> None:
    supervision = running()
    assert supervision.exited(7, 0, 1.0) == [ReportLeft("scout1")]
    assert supervision.find("scout1") is None


def test_a_service_that_must_always_be_there_is_restarted_after_a_good_end_too() -> None:
    supervision = running(RestartPolicy(after_good_end=True, back_off_s=0.1))
    assert supervision.exited(7, 0, 1.0) == [ReportFell("scout1", "exit code 0", 0.1), WakeAt(1.1)]


def test_a_first_start_that_fails_is_not_repeated() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    assert supervision.exited(7, 1, 1.0) == [ReportStartFailed("scout1", "exit code 1")]
    assert supervision.find("scout1") is None


def test_who_is_not_ready_in_time_is_ended_before_the_start_is_answered() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.forked("scout1", 7, 0.0)
    assert supervision.woken(5.0) == [Signal("scout1", 7, signal.SIGTERM), WakeAt(5.0 + TERM_S)]
    assert supervision.ready("scout1") == []
    assert supervision.exited(7, 0, 5.1) == [ReportStartFailed("scout1", "was not ready within 5 s")]


def test_a_zygote_that_hangs_holds_no_order_up() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    assert supervision.woken(5.0) == [ReportStartFailed("scout1", "was not ready within 5 s")]
    assert supervision.forked("scout1", 7, 6.0)[0] == Signal("scout1", 7, signal.SIGTERM)
    assert supervision.exited(7, 0, 6.1) == []
    assert supervision.find("scout1") is None


def test_a_token_that_rises_before_the_pid_is_known_counts() -> None:
    supervision = Supervision()
    supervision.start_ordered("scout1", RestartPolicy(), 5.0, 0.0)
    supervision.ready("scout1")
    assert supervision.forked("scout1", 7, 0.0) == [ReportReady("scout1", 7)]


def test_tokens_say_nothing_about_those_that_are_ready() -> None:
    assert running().ready("scout1") == []


def test_a_name_given_up_may_be_ordered_anew() -> None:
    supervision = running(RestartPolicy(restart=False))
    supervision.exited(7, 1, 1.0)
    assert supervision.start_ordered("scout1", RestartPolicy(), 5.0, 2.0) == [Fork("scout1"), WakeAt(7.0)]


def test_a_name_in_use_is_refused_with_its_pid() -> None:
    with pytest.raises(AlreadyHere, match="ready, pid 7"):
        running().start_ordered("scout1", RestartPolicy(), 5.0, 1.0)


def test_signals_without_a_name_are_described_by_number() -> None:
    assert describe(-99) == "killed by signal 99"
