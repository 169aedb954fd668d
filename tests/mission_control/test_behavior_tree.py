"""The tree's paths and drawing."""

from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode, walk
from backbone.mission.behavior_orders import behavior_order, node_of
from mission_control.behavior_tree import draw

TREE = [
    BehaviorNode(
        "surveillance",
        "watch",
        5,
        children=(
            BehaviorNode("watch_for_motion", "left", 3, {"again_after_s": 2.0}, ArcNeed("capture", 5.0)),
            BehaviorNode("watch_for_motion", "right", 4),
        ),
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
    order = behavior_order(node_of(TREE[0].children[0]), [("mission", 10), ("watch", 5)])
    assert order.parameters["again_after_s"] == 2.0
    assert order.parameters["path"][-1] == ["left", 3]
    assert order.parameters["arc"]["kind"] == "capture"
