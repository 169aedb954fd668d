"""The dialog of orders, the lines about orders, and the key to the next robot; stops work in the dialog."""

from __future__ import annotations

import pytest
from console_scenes import held_model, model
from screen_text import screen_text
from written_session import WrittenSession, settle

from ui_console.model.console import ConsoleModel
from ui_console.model.events import GivenBack, OrderChanged, TurnedTo
from ui_console.model.orders import GivenOrder, Order, OrderKind, OrderState
from ui_console.terminal.app import ConsoleApp

SIZE = (120, 40)
STOPS = [(["x"], ("stop robot", "scout1")), (["X"], ("stop all",))]


def given(robot: str, state: OrderState = OrderState.RUNNING, **options: str) -> GivenOrder:
    return GivenOrder(Order(OrderKind.GO_TO, robot, 2.0, 1.5), 1, state, **options)


def ordered(*orders: GivenOrder) -> ConsoleModel:
    """A console whose robot, scout1, was given to its order."""
    shown = held_model()
    for order in orders:
        shown.apply(OrderChanged(11.0, order))
    shown.apply(GivenBack(11.0, "ordered", True))
    return shown


@pytest.mark.parametrize(
    ("keys", "orders"),
    [
        (["down", "enter"], [Order(OrderKind.RETURN, "scout1")]),
        (["down"] * 3 + ["enter"], [Order(OrderKind.WATCH, "scout1")]),
        (["enter", "2", "enter", "1", "comma", "5", "enter"], [Order(OrderKind.GO_TO, "scout1", 2.0, 1.5)]),
        (["down", "down", "enter", *"anna", "enter"], [Order(OrderKind.FOLLOW, "scout1", target="anna")]),
    ],
)
async def test_an_order_is_chosen_and_its_fields_are_typed(keys: list[str], orders: list[Order]) -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("O")
        await settle(pilot)
        for key in keys:
            await pilot.press(key)
            await settle(pilot)
        assert ("order", orders) in session.wanted


async def test_all_robots_in_hand_are_ordered_at_once_side_by_side() -> None:
    session = WrittenSession(shown=held_model())
    session.robots_held = lambda: ["scout1", "scout2"]  # type: ignore[method-assign]
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("O")
        await settle(pilot)
        for key in [*["down"] * 4, "enter", "2", "enter", "1", "enter"]:
            await pilot.press(key)
            await settle(pilot)
    wanted = [Order(OrderKind.GO_TO, robot, x_m, 1.0) for robot, x_m in (("scout1", 1.75), ("scout2", 2.25))]
    assert ("order", wanted) in session.wanted


async def test_a_wrong_number_is_told_and_orders_nothing() -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("O", "enter")
        await settle(pilot)
        await pilot.press("t", "enter", "1", "enter")
        await settle(pilot)
        assert "'t' is no number of meters" in screen_text(pilot.app)
    assert not [one for one in session.wanted if one[0] == "order"]


@pytest.mark.parametrize("opening", [["O"], ["O", "enter"]])
@pytest.mark.parametrize(("keys", "wanted"), STOPS)
async def test_the_emergency_stop_works_in_the_dialog(
    opening: list[str], keys: list[str], wanted: tuple[str, ...]
) -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press(*opening)
        await settle(pilot)
        await pilot.press(*keys)
        await settle(pilot)
        assert wanted in [one if isinstance(one, tuple) else (one,) for one in session.wanted]


async def test_the_first_line_tells_the_order_of_the_robot_and_the_next_lines_those_of_others() -> None:
    shown = ordered(given("scout1"), given("scout2", OrderState.WAITING, why="higher by ben"))
    async with ConsoleApp(WrittenSession(shown=shown)).run_test(size=SIZE) as pilot:
        lines = screen_text(pilot.app)
        assert "scout1: go to 2, 1.5 (running)" in lines
        assert "scout2: go to 2, 1.5 (waiting: higher by ben)" in lines


async def test_the_robot_of_an_order_is_the_one_that_a_stop_means() -> None:
    session = WrittenSession(shown=ordered(given("scout1")))
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        await pilot.press("x")
        await settle(pilot)
    assert ("stop robot", "scout1") in session.wanted


async def test_one_key_goes_to_the_next_robot_and_from_the_last_to_the_first() -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=SIZE) as pilot:
        robots = [robot.robot for robot in session.model.view(12.0).robots]
        for robot in robots:
            session.model.apply(TurnedTo(12.0, robot))
            await pilot.press("N")
            await settle(pilot)
    assert session.wanted == [("switch", robot) for robot in [*robots[1:], robots[0]]]


def test_an_order_that_is_over_is_shown_for_a_while_and_an_older_one_changes_nothing() -> None:
    shown = model()
    shown.apply(OrderChanged(10.0, given("scout1", OrderState.DONE, why="there")))
    assert [one.line for one in shown.own(12.0).orders] == ["scout1: go to 2, 1.5 (done: there)"]
    assert shown.own(30.0).orders == []
    newer = GivenOrder(Order(OrderKind.RETURN, "scout1"), 2)
    shown.apply(OrderChanged(31.0, newer))
    shown.apply(OrderChanged(31.5, given("scout1", OrderState.ENDED)))
    assert [one.number for one in shown.own(32.0).orders] == [2]
