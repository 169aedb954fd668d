"""Stops on the page, in a real browser: pressed at any place, with a dialog before them, and by a gamepad."""

from __future__ import annotations

import asyncio

import pytest
from examples import rest_thorough
from web_page import ALL_SIZES, GAMEPAD, Pad, card, page_at, stop_button, take, wait_stopped, wait_until
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


@pytest.mark.parametrize(
    ("size", "robot", "gap_s"),
    rest_thorough((size, *way) for size in ALL_SIZES for way in (("scout1", 0.15), ("scout2", 0.3), ("scout3", 0.6))),
)
async def test_stop_pressed_twice_at_one_place_stops_and_never_lifts(
    stage: Stage, size: str, robot: str, gap_s: float
) -> None:
    async with page_at(stage, size) as page:
        button = stop_button(page, robot)
        await button.scroll_into_view_if_needed()
        box = await button.bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        for _ in range(3):
            await page.mouse.click(x, y)
            await asyncio.sleep(gap_s)
        await wait_stopped(page, robot)
        await asyncio.sleep(0.3)
        assert stage.robots[robot].is_stopped
        assert stage.robots[robot].lifts == 0


async def test_take_over_pressed_twice_takes_and_never_gives_back(stage: Stage) -> None:
    async with page_at(stage) as page:
        box = await card(page).get_by_role("button", name="Take over").bounding_box()
        for _ in range(3):
            await page.mouse.click(box["x"] + 9, box["y"] + 9)
            await asyncio.sleep(0.4)
        await page.wait_for_selector("body[data-held=scout1]")
        await asyncio.sleep(0.3)
        assert not any(arc.is_idle or arc.released for arc in stage.placer.arcs.values())


IN_REACH = """(words) => [...document.querySelectorAll("button.emergency")].some((button) => {
  if (!button.checkVisibility() || !button.textContent.startsWith(words)) return false;
  const box = button.getBoundingClientRect();
  return document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2) === button;
})"""


@pytest.mark.thorough
@pytest.mark.parametrize("size", ALL_SIZES)
async def test_a_dialog_leaves_red_buttons_of_one_and_of_all_in_reach_of_a_finger(stage: Stage, size: str) -> None:
    async with page_at(stage, size) as page:
        await take(page)
        await page.evaluate("() => document.getElementById('reading').showModal()")
        dialog = page.locator("dialog[open]")
        for words, count in (("Stop scout1", 1), ("Stop all", 3)):
            assert await page.evaluate(IN_REACH, words), words
            button = dialog.get_by_role("button", name=words)
            await (button.click() if size == "desktop" else button.tap())
            await wait_until(lambda: sum(one.is_stopped for one in stage.robots.values()) == count, words)  # noqa: B023
        assert await dialog.count() == 1, "the reading goes on"


@pytest.mark.parametrize(("button", "robots"), rest_thorough([(3, ["scout1", "scout2", "scout3"]), (1, ["scout1"])]))
async def test_a_gamepad_stops_one_and_all(stage: Stage, button: int, robots: list[str]) -> None:
    async with page_at(stage, script=GAMEPAD) as page:
        await take(page)
        await Pad(page).plug_in()
        await Pad(page).hold(button)
        await wait_until(lambda: all(stage.robots[robot].is_stopped for robot in robots), "stopped")
        assert [robot for robot, rc in stage.robots.items() if rc.is_stopped] == robots
        assert all(stage.robots[robot].orders == 1 for robot in robots), "once for each press"


@pytest.mark.thorough
async def test_a_stop_that_nobody_confirms_is_said_across_the_page(stage: Stage) -> None:
    async with page_at(stage) as page:
        stage.robots["scout2"].is_deaf = True
        await stop_button(page, "scout2").click()
        await page.locator("#unsure").get_by_text("NOT CERTAIN to have stopped: scout2").wait_for()
        assert await page.locator("dialog[open]").count() == 0, "nothing stands before the red buttons"
