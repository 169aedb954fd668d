"""Laws of supervision over random histories."""

from __future__ import annotations

import signal

import hypothesis.strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, precondition, rule

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
)
from backbone.creator.messages import AlreadyHere, NotHere, RestartPolicy
from backbone.creator.supervision import Phase, Supervision

NAMES = ("scout1", "scout2", "radio")


POLICIES = st.builds(
    RestartPolicy,
    restart=st.booleans(),
    back_off_s=st.floats(0.01, 1.0),
    back_off_most_s=st.floats(0.5, 2.0),
    limit=st.integers(0, 3),
    window_s=st.floats(1.0, 20.0),
    failing_pause_s=st.floats(2.0, 10.0),
    hung_after_s=st.floats(0.5, 3.0),
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
        self.failing: dict[str, bool] = {}
        self.restarts: dict[str, list[float]] = {}
        self.starts_open: set[str] = set()
        self.ends_open: set[str] = set()

    def do(self, instructions: list[Instruction], ordered: str = "") -> None:
        for instruction in instructions:
            match instruction:
                case ForkComponent(name=name):
                    assert name not in self.live, f"{name} would run twice"
                    assert name not in self.forking, f"{name} would be forked twice"
                    self.forking.append(name)
                    if name != ordered:
                        self.count_restart(name)
                case AskToStop(name=name):
                    assert name in self.live
                case SendSignal(name=name, pid=pid, number=number):
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
                    assert not self.policies[name].restart, "what is wanted is restarted however it ended"
                case ReportFell(name=name, restart_in_s=restart_in_s, failing=failing):
                    policy = self.policies[name]
                    assert name not in self.live
                    is_wanted = policy.restart or name in self.starts_open
                    assert (restart_in_s >= 0) == is_wanted, "what is wanted is restarted however it ended"
                    assert restart_in_s <= (policy.failing_pause_s if failing else policy.back_off_most_s)
                    self.failing[name] = failing
                case ReportSilent(name=name):
                    assert name in self.live
                case SupervisionWakesAt(at_s=at_s):
                    self.wake_s = at_s

    def count_restart(self, name: str) -> None:
        policy = self.policies[name]
        assert policy.restart or name in self.starts_open
        times = self.restarts.setdefault(name, [])
        times.append(self.now_s)
        within = [at_s for at_s in times if at_s > self.now_s - policy.window_s]
        if not self.failing.get(name):
            assert len(within) <= policy.limit, f"{len(within)} quick restarts in {policy.window_s} s"

    @rule(name=st.sampled_from(NAMES), policy=POLICIES, ready_within_s=st.floats(0.1, 5.0))
    def order_start(self, name: str, policy: RestartPolicy, ready_within_s: float) -> None:
        known = self.supervision.find(name)
        try:
            instructions = self.supervision.start_ordered(name, policy, ready_within_s, self.now_s)
        except AlreadyHere:
            assert known is not None
            return
        self.policies[name], self.restarts[name] = policy, []
        self.failing.pop(name, None)
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

    @rule(name=st.sampled_from(NAMES), silent_s=st.sampled_from([0.0, 0.3, 0.8, 2.0, 4.0]))
    def look(self, name: str, silent_s: float) -> None:
        self.do(self.supervision.observed(name, silent_s, self.now_s))

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
        absent = {each.name for each in self.supervision.absences(self.now_s)}
        for one in self.supervision:
            waits_for_time = one.phase in (Phase.STARTING, Phase.WAITING, Phase.ENDING) and one.pid not in self.killed
            assert one.deadline_s < float("inf") or not waits_for_time, f"{one.name} would be {one.phase} for ever"
            was_ready_and_is_not = one.start_answered and one.phase is not Phase.READY
            assert one.name in absent or not was_ready_and_is_not or one.end is not None, "an absence is reported"
        assert self.wake_s <= min((one.deadline_s for one in self.supervision), default=float("inf"))

    def teardown(self) -> None:
        """After any events, the order to end all ends all and answers every requester, within the times ordered."""
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
