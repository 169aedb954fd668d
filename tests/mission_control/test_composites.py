"""Composites do what BehaviorTree.CPP defines, by events, with any child suspended at any time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest
from begun_children import FAIL, FAILURE, NAMES, RUNNING, SKIP, SUCCESS, begun, end
from composed_trees import LONGEST, ByEvents, Plan, decide, impatient_trees, trees
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from ticked_trees import by_ticks

from mission_control.children import Children, FinishParent, Instruction, StartChild, StopChild
from mission_control.composites import InFallback, InSequence, WhileSuspended, WithRepeats, WithRetries
from mission_control.in_parallel import InParallel
from mission_control.messages import BehaviorStatus
from mission_control.timed import WithDelay, WithTimeout


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(trees())
def test_a_tree_ends_as_the_reference_does_at_the_same_instant_after_the_same_starts(tree: Plan) -> None:
    ends_as_the_reference(tree)


@pytest.mark.parametrize(
    ("kind", "how"),
    [
        *((kind, WhileSuspended.FAIL) for kind in ("sequence", "fallback", "parallel", "retry", "repeat")),
        ("parallel", WhileSuspended.SKIP),
    ],
)
@given(data=st.data())
def test_a_parent_without_patience_ends_as_the_reference_does(
    kind: str, how: WhileSuspended, data: st.DataObject
) -> None:
    ends_as_the_reference(data.draw(impatient_trees(kind, how)))


def ends_as_the_reference(tree: Plan) -> None:
    result, starts = by_ticks(tree)
    events = ByEvents(tree)
    assert events.run() == result
    assert events.runs == starts


@st.composite
def roots(draw: st.DrawFn, *kinds: str) -> Plan:
    """Draw a parent of three random children, of one of these kinds."""
    kind = draw(st.sampled_from(kinds))
    given: dict[str, Any] = {"success_count": -1, "failure_count": 1} if kind == "parallel" else {}
    return Plan(kind, "n", tuple(draw(trees(2, f"n{number}")) for number in range(3)), settings=given)


@given(roots("sequence", "fallback"), st.integers(1, 40), st.integers(0, 2))
def test_what_is_added_before_its_turn_counts_as_in_the_file_from_the_beginning(root: Plan, at: int, one: int) -> None:
    result, starts = by_ticks(root)
    undisturbed = ByEvents(root)
    undisturbed.run()
    assume(undisturbed.began.get(root.children[one].name, LONGEST) >= at)
    short = tuple(child for child in root.children if child is not root.children[one])
    events = ByEvents(replace(root, children=short), {at: root.children})
    assume(events_last(replace(root, children=short)) >= at)
    assert (events.run(), events.runs) == (result, starts)


@given(roots("sequence", "fallback"), st.integers(1, 40), st.integers(0, 2))
def test_what_is_removed_before_its_turn_counts_as_never_in_the_file(root: Plan, at: int, one: int) -> None:
    events = ByEvents(root, {at: (short := tuple(child for child in root.children if child is not root.children[one]))})
    result = events.run()
    assume(root.children[one].name not in events.runs)
    assert (result, events.runs) == by_ticks(replace(root, children=short))


@given(roots("sequence", "fallback"), st.integers(1, 40), st.permutations(range(3)))
def test_children_that_wait_run_in_their_new_order(root: Plan, at: int, order: list[int]) -> None:
    moved = tuple(root.children[number] for number in order)
    events = ByEvents(root, {at: moved})
    result = events.run()
    begun = [child for child in root.children if events.began.get(child.name, LONGEST) < at]
    assert result is None or events.result is result
    waiting = [child for child in moved if child not in begun]
    assert (result, events.runs) == by_ticks(replace(root, children=(*begun, *waiting)))


@given(roots("parallel"), st.integers(1, 12))
def test_a_child_added_to_a_parallel_counts_as_one_that_began_later(root: Plan, at: int) -> None:
    [*early, late] = root.children
    assume(events_last(replace(root, children=tuple(early))) > at)
    pause = Plan("wait", "pause", settings={"seconds": at})
    later = replace(root, children=(*early, Plan("sequence", "later", (pause, late))))
    result, starts = by_ticks(later)
    events = ByEvents(replace(root, children=tuple(early)), {at: root.children})
    assert events.run() == result
    del starts["pause"], starts["later"]
    assert events.runs == starts


def events_last(root: Plan) -> int:
    """Return the tick at which it ends."""
    result, _ = by_ticks(root)
    return LONGEST if result is None else result[1]


MAKERS: dict[str, Callable[[], Children]] = {
    "sequence": lambda: InSequence(NAMES),
    "fallback": lambda: InFallback(NAMES),
    "fallback-next": lambda: InFallback(NAMES, while_suspended=WhileSuspended.NEXT, patience_s=2.0),
    "parallel-all": lambda: InParallel(NAMES),
    "parallel-any": lambda: InParallel(NAMES, success_count=1, failure_count=-1),
    "parallel-two": lambda: InParallel(NAMES, success_count=2, failure_count=-1),
    "retry": lambda: WithRetries(["a"], most=3),
    "retry-later": lambda: WithRetries(["a"], most=-1, pause_s=2.0),
    "repeat": lambda: WithRepeats(["a"], most=3),
    "sequence-fail": lambda: InSequence(NAMES, **FAIL),
    "fallback-fail": lambda: InFallback(NAMES, **FAIL),
    "parallel-fail": lambda: InParallel(NAMES, success_count=1, failure_count=-1, **FAIL),
    "parallel-skip": lambda: InParallel(NAMES, **SKIP),
    "retry-fail": lambda: WithRetries(["a"], most=3, pause_s=1.0, **FAIL),
    "repeat-fail": lambda: WithRepeats(["a"], most=3, **FAIL),
    "timeout": lambda: WithTimeout(["a"], seconds=7.0),
    "timeout-count": lambda: WithTimeout(["a"], seconds=7.0, while_suspended=WhileSuspended.COUNT),
    "wait": lambda: WithDelay([], seconds=7.0),
}
_kinds = ["success", "failure", "running", "suspended", "resumed", "fell", "left", "time", "end", *["rearranged"] * 2]
_children = st.lists(st.sampled_from([*NAMES, "d"]), unique=True)
_events = st.lists(
    st.tuples(st.sampled_from(NAMES), st.sampled_from(_kinds), st.floats(0.0, 3.0), _children),
    max_size=40,
)


class Watched:
    """Carries instructions out and checks each."""

    def __init__(self, rules: Children) -> None:
        self.rules, self.running, self.results = rules, set[str](), list[BehaviorStatus]()

    def carry_out(self, instructions: list[Instruction]) -> None:
        for instruction in instructions:
            match instruction:
                case StartChild(name):
                    assert name not in self.running, "started twice"
                    assert not self.rules.has_finished, "started after the finish"
                    self.running.add(name)
                case StopChild(name):
                    self.running.remove(name)
                case FinishParent(status):
                    assert not self.running, "finished with children left"
                    self.results.append(status)
        assert len(self.results) <= 1, "finished twice"
        assert not (self.results and self.running)


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS.keys())
@given(events=_events)
def test_whatever_happens_children_run_once_and_none_after_the_end(
    make: Callable[[], Children], events: list[tuple[str, str, float, list[str]]]
) -> None:
    now, rules = 0.0, make()
    watched = Watched(rules)
    watched.carry_out(rules.begin(now))
    for name, event, lasts_s, children in events:
        now += lasts_s
        match event:
            case "rearranged":
                before = watched.running - {name}
                watched.carry_out(rules.rearranged(children, {name}, now))
                stays = before & set(children) if not rules.has_finished else set()
                assert watched.running <= set(children), "one that is gone runs on"
                assert stays <= watched.running, "one that stays was ended"
            case "success" | "failure" | "running":
                if rules.reported(name, BehaviorStatus(event), {}):
                    watched.carry_out(decide(rules, name, now))
            case "suspended" | "resumed":
                watched.carry_out(rules.suspended(name, "slice" if event == "suspended" else "", now))
            case "fell":
                rules.fell(name, "signal 9")
            case "left":
                instructions = rules.left(name, now)
                watched.running.discard(name)
                watched.carry_out(instructions)
            case "time":
                watched.carry_out(rules.time_passed(now))
                assert rules.wakes_at_s > now
            case "end":
                watched.carry_out(rules.end())
                assert not watched.running
        assert rules.remarks() is not None
        assert isinstance(rules.sentence, str)


def test_a_fallback_says_what_runs_and_why() -> None:
    rules = begun(InFallback(["patrol", "go-home", "hide"]))
    assert rules.sentence == "runs patrol, 1 of 3"
    end(rules, "patrol", FAILURE, detail="world does not know scout1")
    assert rules.sentence == "runs go-home, 2 of 3, because patrol failed: world does not know scout1"
    assert rules.remarks() == {
        "patrol": "failed: world does not know scout1",
        "go-home": "running",
        "hide": "not started",
    }


def test_a_fallback_fails_with_the_reason_of_its_last_child() -> None:
    rules = begun(InFallback(["a", "b"]))
    end(rules, "a", FAILURE, detail="first")
    *_, finish = end(rules, "b", FAILURE, code="x", detail="second")
    assert finish == FinishParent(FAILURE, {"child": "b", "code": "x", "detail": "second", "failed": ["a", "b"]})


def test_a_child_that_is_at_work_again_takes_over_from_the_one_that_stood_in() -> None:
    rules = begun(InFallback(NAMES, while_suspended=WhileSuspended.NEXT, patience_s=5.0))
    assert rules.suspended("a", "higher by console-1", 1.0) == []
    assert rules.wakes_at_s == 6.0
    assert rules.time_passed(6.0) == [StartChild("b")]
    assert rules.sentence == "runs b, 2 of 3, because a is suspended: higher by console-1"
    assert rules.suspended_because == ""
    assert rules.suspended("b", "slice", 7.0) == []
    assert rules.time_passed(12.0) == [StartChild("c")]
    assert rules.suspended("a", "", 13.0) == [StopChild("c"), StopChild("b")]
    assert rules.sentence == "runs a, 1 of 3"


def test_a_stand_in_that_succeeds_is_the_success_of_the_fallback() -> None:
    rules = begun(InFallback(["a", "b"], while_suspended=WhileSuspended.NEXT))
    rules.suspended("a", "slice", 0.0)
    assert end(rules, "b", SUCCESS) == [StopChild("b"), StopChild("a"), FinishParent(SUCCESS)]


def test_a_stand_in_that_failed_is_not_tried_again_and_the_fallback_waits() -> None:
    rules = begun(InFallback(["a", "b"], while_suspended=WhileSuspended.NEXT))
    rules.suspended("a", "slice", 0.0)
    assert end(rules, "b", FAILURE) == [StopChild("b")]
    assert rules.suspended_because == "a: slice"
    assert rules.sentence == "waits (a: slice), 1 of 2, because b failed"


def test_a_timeout_stands_still_while_its_child_does() -> None:
    rules = begun(WithTimeout(["a"], seconds=10.0))
    assert (rules.wakes_at_s, rules.sentence) == (10.0, "runs a, until 10.0 s of mission time")
    rules.suspended("a", "slice", 4.0)
    assert rules.time_passed(100.0) == []
    assert rules.sentence == "waits (a: slice), 6.0 s left"
    rules.suspended("a", "", 100.0)
    assert rules.wakes_at_s == 106.0
    stop, finish = rules.time_passed(106.0)
    assert stop == StopChild("a")
    assert finish == FinishParent(FAILURE, {"child": "a", "detail": "a was not done within 10 s"})


def test_whether_the_time_of_a_suspension_counts_can_be_changed_during_it() -> None:
    rules = WithTimeout(["a"], seconds=10.0)
    begun(rules)
    rules.suspended("a", "slice by other", 4.0)
    rules.while_suspended = WhileSuspended.COUNT
    assert rules.time_passed(6.0) == []
    assert rules.wakes_at_s == 12.0
    rules.while_suspended = WhileSuspended.WAIT
    assert rules.time_passed(7.0) == []
    assert rules.time_passed(100.0) == []
    rules.suspended("a", "", 100.0)
    assert rules.wakes_at_s == 105.0


def test_a_timeout_may_count_while_its_child_is_suspended() -> None:
    rules = begun(WithTimeout(["a"], seconds=10.0, while_suspended=WhileSuspended.COUNT))
    rules.suspended("a", "slice", 4.0)
    assert rules.wakes_at_s == 10.0


def test_a_parallel_that_can_no_longer_succeed_fails_at_once() -> None:
    rules = begun(InParallel(NAMES, success_count=2, failure_count=-1))
    assert end(rules, "a", FAILURE, detail="lost") == [StopChild("a")]
    assert rules.sentence == "runs b and c, 0 of 2 needed successes, because a failed: lost"
    *_, finish = end(rules, "b", FAILURE)
    assert isinstance(finish, FinishParent)
    assert finish.payload["detail"] == "0 of 3 succeeded, 2 needed: a failed: lost; b failed"


def test_a_parallel_of_too_few_children_fails_before_it_starts_any() -> None:
    [finish] = InParallel(["a"], success_count=2).begin(0.0)
    assert isinstance(finish, FinishParent)
    assert finish.status is FAILURE


@pytest.mark.parametrize(
    ("rules", "status"),
    [
        (InSequence(["a"]), SUCCESS),
        (InFallback(["a"]), FAILURE),
        (InParallel(["a"]), SUCCESS),
        (InParallel(["a"], success_count=1), FAILURE),
        (WithRetries(["a"], most=3), SUCCESS),
        (WithTimeout(["a"], seconds=3.0), SUCCESS),
    ],
)
def test_a_child_that_an_operator_ended_counts_as_none(rules: Children, status: BehaviorStatus) -> None:
    begun(rules)
    [finish] = rules.left("a", 1.0)
    assert isinstance(finish, FinishParent)
    assert finish.status is status


def test_a_setting_can_be_changed_on_the_way() -> None:
    rules = WithTimeout(["a"], seconds=10.0)
    begun(rules)
    rules.seconds = 3.0
    assert rules.time_passed(4.0)[-1] == FinishParent(FAILURE, {"child": "a", "detail": "a was not done within 3 s"})


def test_retry_and_repeat_say_which_turn_it_is() -> None:
    retry = begun(WithRetries(["a"], most=3))
    end(retry, "a", FAILURE, detail="no path")
    retry.reported("a", RUNNING, {})
    assert retry.sentence == "runs a, attempt 2 of 3, because a failed: no path"
    repeat = begun(WithRepeats(["a"], most=-1))
    end(repeat, "a", SUCCESS)
    assert repeat.sentence == "runs a, cycle 2"


def test_a_retry_pauses_before_the_next_attempt() -> None:
    retry = begun(WithRetries(["a"], most=-1, pause_s=2.0))
    assert end(retry, "a", FAILURE, 10.0, detail="no path") == [StopChild("a")]
    assert retry.sentence == "starts a again at 12.0 s of mission time, attempt 2, because a failed: no path"
    assert retry.wakes_at_s == 12.0
    assert retry.remarks() == {"a": "not started"}
    assert retry.time_passed(12.0) == [StartChild("a")]


def test_a_sequence_says_what_came_before() -> None:
    rules = begun(InSequence(NAMES))
    assert end(rules, "a", SUCCESS) == [StopChild("a"), StartChild("b")]
    assert rules.sentence == "runs b, 2 of 3, after a succeeded"


def test_a_child_put_before_the_running_one_comes_after_it() -> None:
    rules = begun(InSequence(["a", "b"]))
    assert rules.rearranged(["new", "a", "b"], (), 1.0) == []
    assert end(rules, "a", SUCCESS) == [StopChild("a"), StartChild("new")]
    assert rules.sentence == "runs new, 1 of 3, after a succeeded"
    assert end(rules, "new", SUCCESS) == [StopChild("new"), StartChild("b")]


def test_a_composite_whose_last_child_is_removed_finishes_as_if_it_were_skipped() -> None:
    rules = begun(InSequence(["a", "b"]))
    end(rules, "a", SUCCESS)
    assert rules.rearranged(["a"], (), 1.0) == [StopChild("b"), FinishParent(SUCCESS)]
    assert rules.rearranged(["a", "c"], (), 2.0) == []


def test_a_replaced_child_of_a_retry_has_all_attempts() -> None:
    retry = begun(WithRetries(["a"], most=2, pause_s=5.0))
    end(retry, "a", FAILURE, 1.0)
    assert retry.rearranged(["a"], {"a"}, 2.0) == [StartChild("a")]
    assert end(retry, "a", FAILURE, 3.0) == [StopChild("a")]
    assert retry.wakes_at_s == 8.0


def test_the_clock_of_a_timeout_goes_on_when_its_suspended_child_is_replaced() -> None:
    rules = begun(WithTimeout(["a"], seconds=10.0))
    rules.suspended("a", "slice", 4.0)
    assert rules.wakes_at_s == float("inf")
    assert rules.rearranged(["b"], (), 20.0) == [StopChild("a"), StartChild("b")]
    assert rules.wakes_at_s == 26.0


def test_before_its_begin_a_parent_only_notes_its_children() -> None:
    rules = InSequence(["a"])
    assert rules.rearranged(["b", "a"], (), 0.0) == []
    assert rules.begin(0.0) == [StartChild("b")]
