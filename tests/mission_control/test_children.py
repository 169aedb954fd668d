"""The laws of what a parent does about its children."""

from hypothesis import given
from hypothesis import strategies as st

from mission_control.children import Children, Decision, FinishParent, Instruction, StartChild, StopChild
from mission_control.messages import BehaviorStatus


def test_together_all_children_start_at_once() -> None:
    assert Children(["a", "b"]).begin(0.0) == [StartChild("a"), StartChild("b")]


def test_in_order_the_next_starts_when_the_one_before_is_left() -> None:
    children = Children(["a", "b"], together=False)
    assert children.begin(0.0) == [StartChild("a")]
    children.reported("a", BehaviorStatus.SUCCESS, {})
    assert children.decided("a", Decision.NEXT, 0.0) == [StopChild("a"), StartChild("b")]
    children.reported("b", BehaviorStatus.SUCCESS, {})
    assert children.decided("b", Decision.NEXT, 0.0) == [StopChild("b"), FinishParent(BehaviorStatus.SUCCESS)]


def test_a_retried_child_is_stopped_before_it_is_started_again() -> None:
    children = Children(["a"])
    children.begin(0.0)
    children.reported("a", BehaviorStatus.FAILURE, {"code": "x"})
    assert children.decided("a", Decision.RETRY, 0.0) == [StopChild("a"), StartChild("a")]
    assert children.status["a"] is BehaviorStatus.RUNNING


def test_an_abort_stops_all_and_the_parent_fails_with_the_childs_reason() -> None:
    children = Children(["a", "b"])
    children.begin(0.0)
    children.reported("a", BehaviorStatus.FAILURE, {"code": "x"})
    assert children.decided("a", Decision.ABORT, 0.0) == [
        StopChild("b"),
        StopChild("a"),
        FinishParent(BehaviorStatus.FAILURE, {"child": "a", "code": "x"}),
    ]


def test_a_final_status_is_decided_on_once() -> None:
    children = Children(["a", "b"])
    children.begin(0.0)
    assert children.reported("a", BehaviorStatus.SUCCESS, {}) is True
    assert children.reported("a", BehaviorStatus.SUCCESS, {}) is False


def test_a_child_ended_by_somebody_else_is_not_started_again() -> None:
    children = Children(["a", "b"])
    children.begin(0.0)
    assert children.left("a", 0.0) == []
    assert children.left("b", 0.0) == [FinishParent(BehaviorStatus.SUCCESS)]


_steps = st.lists(
    st.tuples(
        st.sampled_from(["a", "b", "c"]),
        st.sampled_from(list(BehaviorStatus)),
        st.sampled_from([*Decision, "left", "end"]),
    ),
    max_size=30,
)


@given(_steps, st.booleans())
def test_whatever_happens_no_child_runs_twice_and_none_after_the_end(
    steps: list[tuple[str, BehaviorStatus, str]], together: bool
) -> None:
    children = Children(["a", "b", "c"], together=together)
    running: set[str] = set()
    finished = 0

    def carry_out(instructions: list[Instruction]) -> None:
        nonlocal finished
        for instruction in instructions:
            match instruction:
                case StartChild(name):
                    assert name not in running
                    assert finished == 0
                    running.add(name)
                case StopChild(name):
                    running.discard(name)
                case FinishParent():
                    finished += 1
                    assert not running
        assert together or len(running) <= 1
        assert finished <= 1

    carry_out(children.begin(0.0))
    for name, status, then in steps:
        must_decide = children.reported(name, status, {})
        if then == "left" and not must_decide:
            running.discard(name)
            carry_out(children.left(name, 0.0))
        elif then == "end":
            carry_out(children.end())
            assert not running
        elif isinstance(then, Decision):
            carry_out(children.decided(name, then, 0.0))


def test_a_parent_of_no_rule_goes_on_without_children_until_it_gets_some() -> None:
    children = Children(["a"])
    children.begin(0.0)
    assert children.rearranged([], (), 1.0) == [StopChild("a")]
    assert not children.has_finished
    assert children.rearranged(["b"], (), 2.0) == [StartChild("b")]
