"""The roots of the behavior tree are ordered with all that their branches need."""

import subprocess
import sys

import msgspec
import pytest

from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode
from backbone.mission.behavior_orders import ReservedParameter, behavior_order, behavior_orders
from backbone.mission.document import MAX_DEPTH
from backbone.mission.model import MissionDescription
from backbone.ranges import wildness

WATCH = BehaviorNode(
    type="watch_for_motion",
    name="watch1",
    priority=3,
    parameters={"again_after_s": 2.0},
    arc=ArcNeed(
        kind="capture",
        wish={"scout": "scout1"},
        features={"scout": ("camera",)},
        minimum_runtime_s=5.0,
        period_s=0.1,
        packet_time_s=0.002,
    ),
)


def mission(*behaviors: BehaviorNode) -> MissionDescription:
    return MissionDescription(
        name="iros2001",
        priority=10,
        hosts=(),
        core=(),
        types=(),
        resources=(),
        components=(),
        behaviors=behaviors,
        source="mission.xml",
    )


def test_a_root_is_ordered_with_its_path_its_own_parameters_and_its_children() -> None:
    [order] = behavior_orders(mission(BehaviorNode(type="surveillance", name="watch", priority=5, children=(WATCH,))))
    assert (order.type, order.name) == ("surveillance", "watch")
    assert order.parameters["path"] == [["iros2001", 10], ["watch", 5]]
    assert order.parameters["arc"] is None
    assert [child["name"] for child in order.parameters["children"]] == ["watch1"]


def test_a_child_is_ordered_by_the_same_rule_one_step_further_down() -> None:
    [order] = behavior_orders(mission(BehaviorNode(type="surveillance", name="watch", priority=5, children=(WATCH,))))
    child = behavior_order(order.parameters["children"][0], [("iros2001", 10), ("watch", 5)])
    assert child.parameters["path"] == [["iros2001", 10], ["watch", 5], ["watch1", 3]]
    assert child.parameters["again_after_s"] == 2.0
    assert child.parameters["arc"]["wish"] == {"scout": "scout1"}


def test_orders_survive_the_wire() -> None:
    [order] = behavior_orders(mission(WATCH))
    assert msgspec.msgpack.decode(msgspec.msgpack.encode(order), type=type(order)) == order


def test_a_parameter_of_a_reserved_name_is_refused_at_any_depth() -> None:
    bad = BehaviorNode(type="wander", name="wander", priority=1, parameters={"path": []})
    with pytest.raises(ReservedParameter):
        behavior_orders(mission(bad))
    with pytest.raises(ReservedParameter):
        behavior_orders(mission(BehaviorNode(type="surveillance", name="s", priority=1, children=(bad,))))


@pytest.mark.processes
def test_ordering_a_child_needs_no_pydantic() -> None:
    check = "import sys, backbone.mission.behavior_orders; sys.exit('pydantic' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", check], check=False).returncode == 0


def test_a_tree_as_deep_as_a_mission_file_can_be_fits_into_a_message() -> None:
    branch = WATCH
    for level in range(MAX_DEPTH - len(("mission", "behaviors", "behavior", "arc", "wish"))):
        branch = BehaviorNode(type="sequence", name=f"above{level}", priority=1, children=(branch,))
    [order] = behavior_orders(mission(branch))
    assert wildness(order) == ""
