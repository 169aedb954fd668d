"""What composites do with a child that is suspended for longer than their patience."""

from __future__ import annotations

import math

import pytest
from begun_children import FAIL, FAILURE, NAMES, SKIP, SUCCESS, begun, end

from mission_control.children import FinishParent, StartChild, StopChild
from mission_control.composites import InFallback, InSequence, WhileSuspended, WithRepeats, WithRetries
from mission_control.in_parallel import InParallel


def test_a_report_that_repeats_a_suspension_does_not_prolong_the_patience() -> None:
    rules = begun(InFallback(["a", "b"], while_suspended=WhileSuspended.NEXT, patience_s=5.0))
    rules.suspended("a", "slice", 1.0)
    rules.suspended("a", "higher by console-1", 4.0)
    assert rules.wakes_at_s == 6.0
    assert rules.sentence == "waits (a: higher by console-1), 1 of 2"


def test_a_sequence_without_patience_fails_with_the_child_that_is_suspended_too_long() -> None:
    rules = begun(InSequence(["a", "b"], **FAIL))
    assert rules.suspended("a", "higher by console-1", 1.0) == []
    assert rules.wakes_at_s == 3.0
    rules.suspended("a", "", 2.0)
    rules.suspended("a", "slice", 2.5)
    assert (rules.wakes_at_s, rules.time_passed(4.0)) == (4.5, [])
    stop, finish = rules.time_passed(4.5)
    assert stop == StopChild("a")
    assert finish == FinishParent(FAILURE, {"child": "a", "detail": "it was suspended for 2 s: slice"})


def test_a_retry_without_patience_begins_the_next_attempt() -> None:
    rules = begun(WithRetries(["a"], most=2, pause_s=1.0, **FAIL))
    rules.suspended("a", "slice", 0.0)
    assert rules.time_passed(2.0) == [StopChild("a")]
    assert rules.sentence == (
        "starts a again at 3.0 s of mission time, attempt 2 of 2, because a failed: it was suspended for 2 s: slice"
    )
    assert rules.time_passed(3.0) == [StartChild("a")]
    rules.suspended("a", "slice", 3.0)
    *_, finish = rules.time_passed(5.0)
    assert isinstance(finish, FinishParent)
    assert finish.status is FAILURE


def test_a_repeat_without_patience_fails_with_its_cycle() -> None:
    rules = begun(WithRepeats(["a"], most=-1, **FAIL))
    rules.suspended("a", "slice", 0.0)
    *_, finish = rules.time_passed(2.0)
    assert isinstance(finish, FinishParent)
    assert finish.status is FAILURE


def test_a_fallback_without_patience_leaves_a_child_for_good() -> None:
    rules = begun(InFallback(["a", "b"], **FAIL))
    rules.suspended("a", "slice", 0.0)
    assert rules.time_passed(2.0) == [StopChild("a"), StartChild("b")]
    assert rules.suspended("a", "", 3.0) == []
    assert rules.sentence == "runs b, 2 of 2, because a failed: it was suspended for 2 s: slice"


def test_a_parallel_counts_a_child_that_is_suspended_too_long_as_failed() -> None:
    rules = begun(InParallel(NAMES, success_count=1, failure_count=-1, **FAIL))
    rules.suspended("a", "slice", 0.0)
    rules.suspended("b", "slice", 0.0)
    assert rules.time_passed(2.0) == [StopChild("a"), StopChild("b")]
    assert end(rules, "c", SUCCESS, 3.0)[-1] == FinishParent(SUCCESS)


def test_a_parallel_may_skip_a_child_until_it_is_at_work_again() -> None:
    rules = begun(InParallel(["a", "b"], **SKIP))
    rules.suspended("a", "slice", 0.0)
    assert rules.time_passed(2.0) == []
    assert rules.wakes_at_s == math.inf
    assert rules.sentence == "runs b, 0 of 1 needed successes, without a, suspended for too long"
    rules.suspended("a", "", 3.0)
    assert rules.sentence == "runs a and b, 0 of 2 needed successes"
    rules.suspended("a", "slice", 4.0)
    assert end(rules, "b", SUCCESS, 5.0) == [StopChild("b")]
    assert rules.time_passed(6.0) == [StopChild("a"), FinishParent(SUCCESS)]


def test_a_parallel_that_would_skip_all_waits_for_them() -> None:
    rules = begun(InParallel(["a", "b"], **SKIP))
    rules.suspended("a", "slice", 0.0)
    rules.suspended("b", "slice", 1.0)
    assert (rules.time_passed(2.0), rules.time_passed(3.0)) == ([], [])
    rules.suspended("b", "", 4.0)
    assert end(rules, "b", SUCCESS, 5.0)[-1] == FinishParent(SUCCESS)


@pytest.mark.parametrize("counts", [{"success_count": -2}, {"failure_count": -2}, {"success_count": -9}])
def test_a_parallel_that_skips_children_is_not_over_before_another_one_is(counts: dict[str, int]) -> None:
    rules = begun(InParallel(["a", "b"], **SKIP, **counts))
    rules.suspended("a", "slice", 0.0)
    assert rules.time_passed(2.0) == []
    assert end(rules, "b", SUCCESS, 3.0)[-1] == FinishParent(SUCCESS)
