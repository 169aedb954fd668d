"""From an order to its behavior: who tells positions, which kind of ARC, which path and parameters."""

from __future__ import annotations

import msgspec
import pytest

from backbone.component.abilities import Abilities, CommandForm
from backbone.component.messages import ComponentState, LifeState
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.naming import Subsystem
from ui_console.model.arc_kinds import NoArcKind
from ui_console.model.order_facts import CannotOrder, FoundLocalizer, NoLocalizer, kind_for, localizer_of, start_of
from ui_console.model.orders import Order, OrderKind

POOL, MISSION_CONTROL = Subsystem.RESOURCE_POOL, Subsystem.MISSION_CONTROL
ROBOTS = [Resource("scout1", "scout", is_robot=True), Resource("sensor1", "sensor", is_robot=True)]
CONSOLE = "ui_console/console-7"


def there(name: str, kind: str) -> ComponentState:
    return ComponentState(f"{POOL}/{name}", kind, "base", 1, LifeState.READY, 0.0, "", "")


def arc(name: str, body: str, *, moves: bool, gives_pictures: bool = False) -> ComponentType:
    commands = [CommandForm("move", moves=True, roles=[body])] if moves else []
    able = Abilities(body=body, commands=commands, gives_pictures=gives_pictures)
    return ComponentType(name, "x:Y", POOL, needs={body: body}, abilities=able)


def behavior(kind: OrderKind) -> ComponentType:
    return ComponentType(kind.value, "x:Y", MISSION_CONTROL)


TYPES = [
    arc("drive", "scout", moves=True),
    arc("look", "scout", moves=True, gives_pictures=True),
    arc("sense", "sensor", moves=False),
    *map(behavior, OrderKind),
]


def test_the_missions_localizer_goes_before_its_simulated_world_which_is_called_by_its_name() -> None:
    world, tracker = there("world", "simulated_world"), there("tracker", "localizer")
    assert localizer_of([world, tracker]) == FoundLocalizer("resource_pool/tracker", "positions from tracker")
    assert "simulator" in localizer_of([world]).words


def test_without_either_the_order_is_refused_with_a_remedy() -> None:
    with pytest.raises(NoLocalizer) as refused:
        localizer_of([there("scout1", "scout")])
    assert "localizer" in refused.value.remedy


@pytest.mark.parametrize(
    ("kind", "arc_kind"), [(OrderKind.GO_TO, "drive"), (OrderKind.RETURN, "drive"), (OrderKind.WATCH, "look")]
)
def test_the_kind_of_arc_drives_or_gives_pictures_as_the_order_needs(kind: OrderKind, arc_kind: str) -> None:
    assert kind_for(Order(kind, "scout1"), TYPES, ROBOTS) == arc_kind


@pytest.mark.parametrize(
    ("order", "why"),
    [
        (Order(OrderKind.GO_TO, "sensor1"), "sensor1 cannot drive"),
        (Order(OrderKind.WATCH, "sensor1"), "sensor1 gives no pictures"),
        (Order(OrderKind.GO_TO, ""), "no robot is meant"),
    ],
)
def test_a_robot_that_cannot_is_named_in_the_refusal(order: Order, why: str) -> None:
    with pytest.raises(CannotOrder, match=why):
        kind_for(order, TYPES, ROBOTS)


@pytest.mark.parametrize("x_m", [1e300, float("nan"), -1000.5])
def test_a_place_that_no_room_has_is_refused(x_m: float) -> None:
    with pytest.raises(CannotOrder, match="no place in a room"):
        kind_for(Order(OrderKind.GO_TO, "scout1", x_m, 1.0), TYPES, ROBOTS)


def test_without_a_framegrabber_nothing_can_be_watched() -> None:
    types = [
        msgspec.structs.replace(one, needs={**one.needs, "grabber": "grabber"}) for one in TYPES if one.name == "look"
    ]
    with pytest.raises(CannotOrder, match="gives no pictures"):
        kind_for(Order(OrderKind.WATCH, "scout1"), [*types, *map(behavior, OrderKind)], ROBOTS)


def test_a_wrong_name_and_a_mission_without_the_behavior_are_refused() -> None:
    with pytest.raises(NoArcKind, match="no robot is named 'scuot1'"):
        kind_for(Order(OrderKind.GO_TO, "scuot1"), TYPES, ROBOTS)
    with pytest.raises(CannotOrder, match="no behavior go_to"):
        kind_for(Order(OrderKind.GO_TO, "scout1"), TYPES[:3], ROBOTS)


def test_the_behavior_is_below_its_console_and_wishes_exactly_its_robot() -> None:
    order, localizer = Order(OrderKind.GO_TO, "scout1", 2.0, 1.5), FoundLocalizer("resource_pool/tracker", "")
    start = start_of(order, 3, "drive", localizer, console=CONSOLE, priority=100, runtime_s=5.0)
    assert (start.type, start.name) == ("go_to", "console-7-order-3")
    assert start.parameters == {
        "localizer": "resource_pool/tracker",
        "x_m": 2.0,
        "y_m": 1.5,
        "path": [["console-7", 100], ["console-7-order-3", 1]],
        "arc": {"kind": "drive", "minimum_runtime_s": 5.0, "wish": {"robot": "scout1"}},
        "children": [],
        "keeper": CONSOLE,
    }


def test_each_kind_of_order_has_the_parameters_of_its_behavior_and_no_others() -> None:
    own = {"path", "arc", "children", "keeper"}
    localizer = FoundLocalizer("resource_pool/tracker", "")
    for kind, further in ((OrderKind.RETURN, {"localizer"}), (OrderKind.FOLLOW, {"localizer", "target"})):
        order = Order(kind, "scout1", target="anna")
        start = start_of(order, 1, "drive", localizer, console=CONSOLE, priority=100, runtime_s=5.0)
        assert start.parameters.keys() == own | further
    start = start_of(Order(OrderKind.WATCH, "scout1"), 1, "look", None, console=CONSOLE, priority=1, runtime_s=5.0)
    assert start.parameters.keys() == own
