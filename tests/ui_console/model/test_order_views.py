"""An operator's orders on the screen: the newest of each robot; a group's places lie on the floor."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.arc_client import FloorPlan
from ui_console.model.events import OrderChanged
from ui_console.model.order_views import EDGE_M, OVER_SHOWN_S, OrderList, inside
from ui_console.model.orders import GivenOrder, Order, OrderKind, OrderState, group

GO = Order(OrderKind.GO_TO, "scout1", 2.0, 1.0)


def changed(at_s: float, number: int, state: OrderState, order: Order = GO, why: str = "") -> OrderChanged:
    return OrderChanged(at_s, GivenOrder(order, number, state, why))


def test_the_newest_order_of_a_robot_is_shown_and_its_end_for_a_moment() -> None:
    orders = OrderList()
    orders.take(changed(1.0, 1, OrderState.RUNNING))
    orders.take(changed(2.0, 2, OrderState.STARTING, Order(OrderKind.RETURN, "scout1")))
    orders.take(changed(2.1, 1, OrderState.ENDED))
    [shown] = orders.views(3.0, "scout1")
    assert (shown.kind, shown.is_over, shown.has_stick) == (OrderKind.RETURN, False, True)
    assert not orders.views(3.0, "scout2")[0].has_stick
    orders.take(changed(4.0, 2, OrderState.FAILED, Order(OrderKind.RETURN, "scout1"), "no way there"))
    [over] = orders.views(5.0, "scout1")
    assert (over.is_over, over.has_stick) == (True, False)
    assert "no way there" in over.line
    assert orders.views(4.0 + OVER_SHOWN_S, "scout1") == []


@given(st.floats(-1, 9), st.floats(-1, 6), st.integers(2, 6))
def test_a_group_keeps_its_distances_and_stands_on_the_floor(x_m: float, y_m: float, count: int) -> None:
    floor = FloorPlan(8.0, 5.0)
    robots = [f"scout{number}" for number in range(count)]
    wished = group(replace(GO, x_m=x_m, y_m=y_m), robots)
    moved = inside(wished, floor)
    assert [order.robot for order in moved] == robots
    for order in moved:
        assert EDGE_M - 1e-9 <= order.x_m <= floor.width_m - EDGE_M + 1e-9
        assert EDGE_M - 1e-9 <= order.y_m <= floor.depth_m - EDGE_M + 1e-9
    steps = [after.x_m - before.x_m for before, after in itertools.pairwise(moved)]
    assert steps == pytest.approx([0.5] * (count - 1))


def test_orders_without_a_place_and_floors_that_nobody_knows_change_nothing() -> None:
    home = [Order(OrderKind.RETURN, "scout1")]
    assert inside(home, FloorPlan(8.0, 5.0)) == home
    assert inside([GO, GO], None) == [GO, GO]
    corner = replace(GO, x_m=0.0)
    assert inside([corner], FloorPlan(8.0, 5.0)) == [corner], "it goes alone"
