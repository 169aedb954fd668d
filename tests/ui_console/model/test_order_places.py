"""The places of a group lie on the floor, as far from each other as they were."""

from __future__ import annotations

import itertools
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.arc_client import FloorPlan
from ui_console.model.orders import EDGE_M, Order, OrderKind, group, inside

GO = Order(OrderKind.GO_TO, "scout1", 2.0, 1.0)


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
