"""The gate as a state machine: commands pass only between open and close, and a close wins."""

from __future__ import annotations

import pytest
from examples import share
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from resource_pool.gate import Gate
from resource_pool.messages import SwappedOut


class GateHistory(RuleBasedStateMachine):
    """Plays preparations, openings and closings in any order against a model of two words."""

    def __init__(self) -> None:
        super().__init__()
        self.gate = Gate("arc")
        self.epoch = 0
        self.prepared: int | None = None
        self.open: int | None = None
        self.reason = "waiting"

    @rule()
    def prepare(self) -> None:
        self.epoch += 1
        self.gate.prepare({"scout": self.epoch})
        self.prepared, self.open = self.epoch, None

    @rule(back=st.integers(0, 3), now_s=st.floats(0, 100))
    def finish_preparation(self, back: int, now_s: float) -> None:
        """A preparation ends, perhaps one that began before a close or before another preparation."""
        finished = self.epoch - back
        opens = self.gate.open({"scout": finished}, now_s)
        assert opens == (finished == self.prepared)
        if opens:
            self.open = finished
            assert self.gate.granted_s == now_s

    @rule(reason=st.sampled_from(["slice", "higher", "rc"]))
    def close(self, reason: str) -> None:
        assert self.gate.close(reason, "console", 7.0) == (self.prepared is not None)
        self.prepared = self.open = None
        self.reason = reason

    @invariant()
    def commands_pass_only_while_open_and_only_under_the_last_epoch(self) -> None:
        if self.open is not None:
            assert self.gate.epoch_of("scout") == self.open == self.epoch
            return
        with pytest.raises(SwappedOut):
            self.gate.epoch_of("scout")
        assert self.gate.granted_s < 0


GateHistory.TestCase.settings = settings(max_examples=share(60), stateful_step_count=25)
TestGateHistory = GateHistory.TestCase


def test_a_shut_gate_says_why_by_whom_and_until_when() -> None:
    gate = Gate("arc")
    gate.prepare({"scout": 1})
    gate.open({"scout": 1}, 3.0)
    gate.close("higher", "console1", 42.0)
    with pytest.raises(SwappedOut) as refused:
        gate.epoch_of("scout")
    assert refused.value.facts == {"reason": "higher", "by": "console1", "expected_start_s": 42.0}
    assert "console1" in str(refused.value)


def test_a_refusal_does_not_claim_that_the_reason_of_the_last_end_holds_now() -> None:
    """The other ARC may have ended since, and the robot may be out of reach; only the RC manager knows."""
    gate = Gate("anna-drive")
    gate.prepare({"scout": 1})
    gate.open({"scout": 1}, 1.0)
    gate.close("higher", "watch", -1.0)
    with pytest.raises(SwappedOut) as refused:
        gate.epoch_of("scout")
    assert refused.value.detail == "anna-drive holds nothing now; the last reason: higher because of watch"
