"""The tree's paths and drawing, and the laws of what a parent does about its children."""

from hypothesis import given
from hypothesis import strategies as st

from mission_control.behavior_tree import (
    ArcNeed,
    BehaviorNode,
    Children,
    Decision,
    FinishParent,
    Instruction,
    StartChild,
    StopChild,
    draw,
    walk,
)
from mission_control.messages import BehaviorStatus

TREE = [
    BehaviorNode(
        "surveillance",
        "watch",
        5,
        children=[
            BehaviorNode("watch_for_motion", "left", 3, {"again_after_s": 2.0}, ArcNeed("capture", 5.0)),
            BehaviorNode("watch_for_motion", "right", 4),
        ],
    ),
    BehaviorNode("wander", "wander", 1),
]


def test_paths_lead_from_the_root_to_every_node() -> None:
    paths = {node.name: path for path, node in walk(TREE, [("mission", 10)])}
    assert paths["left"] == [("mission", 10), ("watch", 5), ("left", 3)]
    assert list(paths) == ["watch", "left", "right", "wander"]


def test_the_drawing_puts_higher_siblings_first_and_says_what_is_remarked() -> None:
    assert draw(TREE, {"left": "running"}).splitlines() == [
        "watch (surveillance, priority 5)",
        "├─ right (watch_for_motion, priority 4)",
        "└─ left (watch_for_motion, priority 3): running",
        "wander (wander, priority 1)",
    ]


def test_a_node_orders_itself_with_its_own_parameters_beside_the_trees() -> None:
    order = TREE[0].children[0].order([("mission", 10), ("watch", 5)])
    assert order.parameters["again_after_s"] == 2.0
    assert order.parameters["path"][-1] == ["left", 3]
    assert order.parameters["arc"]["kind"] == "capture"


def test_together_all_children_start_at_once() -> None:
    assert Children(["a", "b"]).begin() == [StartChild("a"), StartChild("b")]


def test_in_order_the_next_starts_when_the_one_before_is_left() -> None:
    children = Children(["a", "b"], together=False)
    assert children.begin() == [StartChild("a")]
    children.reported("a", BehaviorStatus.SUCCESS, {})
    assert children.decided("a", Decision.NEXT) == [StopChild("a"), StartChild("b")]
    children.reported("b", BehaviorStatus.SUCCESS, {})
    assert children.decided("b", Decision.NEXT) == [StopChild("b"), FinishParent(BehaviorStatus.SUCCESS)]


def test_a_retried_child_is_stopped_before_it_is_started_again() -> None:
    children = Children(["a"])
    children.begin()
    children.reported("a", BehaviorStatus.FAILURE, {"code": "x"})
    assert children.decided("a", Decision.RETRY) == [StopChild("a"), StartChild("a")]
    assert children.status["a"] is BehaviorStatus.RUNNING


def test_an_abort_stops_all_and_the_parent_fails_with_the_childs_reason() -> None:
    children = Children(["a", "b"])
    children.begin()
    children.reported("a", BehaviorStatus.FAILURE, {"code": "x"})
    assert children.decided("a", Decision.ABORT) == [
        StopChild("b"),
        StopChild("a"),
        FinishParent(BehaviorStatus.FAILURE, {"child": "a", "code": "x"}),
    ]


def test_a_final_status_is_decided_on_once() -> None:
    children = Children(["a", "b"])
    children.begin()
    assert children.reported("a", BehaviorStatus.SUCCESS, {}) is True
    assert children.reported("a", BehaviorStatus.SUCCESS, {}) is False


def test_a_child_ended_by_somebody_else_is_not_started_again() -> None:
    children = Children(["a", "b"])
    children.begin()
    assert children.left("a") == []
    assert children.left("b") == [FinishParent(BehaviorStatus.SUCCESS)]


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

    carry_out(children.begin())
    for name, status, then in steps:
        must_decide = children.reported(name, status, {})
        if then == "left" and not must_decide:
            running.discard(name)
            carry_out(children.left(name))
        elif then == "end":
            carry_out(children.end())
            assert not running
        elif isinstance(then, Decision):
            carry_out(children.decided(name, then))
