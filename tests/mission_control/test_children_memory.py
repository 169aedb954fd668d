"""The rules of a parent continue from what its last process knew."""

from __future__ import annotations

import msgspec
import pytest
from begun_children import RUNNING, SKIP, SUCCESS, begun, end
from composed_trees import ByEvents, Plan, impatient_trees, trees
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from ticked_trees import by_ticks

from mission_control.children import Children, ChildrenMemory, FinishParent, StartChild, StopChild
from mission_control.composites import InSequence, WhileSuspended, WithRepeats
from mission_control.in_parallel import InParallel
from mission_control.messages import BehaviorStatus
from mission_control.timed import WithDelay, WithTimeout

_trees = trees() | st.sampled_from(["parallel", "fallback", "retry", "repeat"]).flatmap(impatient_trees)


@settings(suppress_health_check=[HealthCheck.too_slow])
@given(_trees | impatient_trees("parallel", WhileSuspended.SKIP), st.data())
def test_a_tree_whose_processes_are_killed_ends_as_an_undisturbed_one(tree: Plan, data: st.DataObject) -> None:
    dead = st.frozensets(st.sampled_from(sorted(names_of(tree))), min_size=1)
    kills = data.draw(st.dictionaries(st.integers(1, 40), dead, min_size=1, max_size=8))
    events = ByEvents(tree, kills=kills)
    assert (events.run(), events.runs) == by_ticks(tree)


def names_of(tree: Plan) -> set[str]:
    return {tree.name}.union(*map(names_of, tree.children))


def kept(rules: Children) -> ChildrenMemory:
    return msgspec.msgpack.decode(msgspec.msgpack.encode(rules.memory()), type=ChildrenMemory)


def test_an_end_that_was_not_decided_is_counted_when_it_is_reported_again() -> None:
    rules = begun(WithRepeats(["a"], most=2))
    rules.reported("a", SUCCESS, {})
    then = WithRepeats(["a"], most=2)
    then.resume(kept(rules), 1.0)
    assert then.begin(1.0) == [StartChild("a")]
    assert end(then, "a", SUCCESS, 1.0) == [StopChild("a"), StartChild("a")]
    assert end(then, "a", SUCCESS, 2.0) == [StopChild("a"), FinishParent(SUCCESS)]


@pytest.mark.parametrize(("kind", "names"), [(WithTimeout, ["a"]), (WithDelay, [])])
def test_the_time_of_a_node_runs_on_while_no_process_counts_it(
    kind: type[WithTimeout | WithDelay], names: list[str]
) -> None:
    rules = begun(kind(names, seconds=10.0))
    then = kind(names, seconds=10.0)
    then.resume(kept(rules), 7.0)
    then.begin(7.0)
    assert then.wakes_at_s == 10.0


def test_the_time_of_a_suspended_child_does_not_run_on() -> None:
    rules = begun(WithTimeout(["a"], seconds=10.0))
    rules.suspended("a", "slice", 4.0)
    then = WithTimeout(["a"], seconds=10.0)
    then.resume(kept(rules), 7.0)
    then.begin(7.0)
    then.suspended("a", "", 7.0)
    assert then.wakes_at_s == 13.0


def test_a_verdict_stands() -> None:
    rules = begun(WithTimeout(["a"], seconds=10.0))
    [*_, verdict] = rules.time_passed(10.0)
    then = WithTimeout(["a"], seconds=10.0)
    then.resume(kept(rules), 11.0)
    assert then.begin(11.0) == [verdict]


def test_the_children_may_have_changed_meanwhile() -> None:
    rules = begun(InSequence(["a", "b", "c"]))
    end(rules, "a", SUCCESS)
    then = InSequence(["a", "d", "c"])
    then.resume(kept(rules), 1.0)
    assert then.begin(1.0) == [StartChild("d")]
    assert then.status == {"a": SUCCESS, "d": RUNNING}


@pytest.mark.parametrize("how", [WhileSuspended.FAIL, WhileSuspended.SKIP])
def test_patience_with_a_suspended_child_goes_on(how: WhileSuspended) -> None:
    def parallel() -> InParallel:
        return InParallel(["a", "b"], while_suspended=how, patience_s=3.0)

    rules = begun(parallel())
    rules.suspended("a", "slice", 1.0)
    then = parallel()
    then.resume(kept(rules), 2.0)
    then.begin(2.0)
    assert then.wakes_at_s == 4.0
    then.suspended("a", "slice", 2.5)
    assert then.wakes_at_s == 4.0


def test_a_skipped_child_is_skipped_on() -> None:
    rules = begun(InParallel(["a", "b"], success_count=1, failure_count=2, **SKIP))
    rules.suspended("a", "slice", 1.0)
    rules.time_passed(3.0)
    then = InParallel(["a", "b"], success_count=1, failure_count=2, **SKIP)
    then.resume(kept(rules), 4.0)
    then.begin(4.0)
    assert then.sentence.endswith("without a, suspended for too long")


@given(st.sampled_from(list(BehaviorStatus)), st.sets(st.sampled_from(["a", "b", "c"])))
def test_a_child_that_another_component_ended_stays_ended(status: BehaviorStatus, left: set[str]) -> None:
    rules = begun(Children(["a", "b", "c"]))
    for name in sorted(left):
        rules.left(name, 0.0)
    rules.reported("a", status, {})
    then = Children(["a", "b", "c"])
    then.resume(kept(rules), 1.0)
    started = {each.name for each in then.begin(1.0) if isinstance(each, StartChild)}
    assert started == {"a", "b", "c"} - left
