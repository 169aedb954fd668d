"""Keys stop and drive whatever has the focus of the page, in a real browser."""

from __future__ import annotations

import asyncio

import pytest
from web_page import Wheels, card, page_at, take, wait_until
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

FOCUS = {
    "nothing": "document.activeElement.blur()",
    "speed": "document.getElementById('speed').focus()",
    "look": "document.getElementById('theme').focus()",
    "tab": "document.getElementById('tab-log').focus()",
    "pad": "document.getElementById('pad').focus()",
    "button": "document.getElementById('release').focus()",
    "text": "document.getElementById('login').hidden = false; document.getElementById('login-user').focus()",
    "dialog": "document.getElementById('reading').showModal()",
}


@pytest.mark.thorough
async def test_keys_stop_one_and_all_whatever_has_the_focus(stage: Stage) -> None:
    async with page_at(stage) as page:
        await take(page)
        robots = stage.robots.values()
        for where, focus in FOCUS.items():
            await page.evaluate(f"() => {{ {focus} }}")
            await page.keyboard.press("x")
            await wait_until(lambda: stage.robots["scout1"].is_stopped, f"x stops the robot in hand: {where}")
            assert not stage.robots["scout2"].is_stopped
            await page.keyboard.press("Shift+X")
            await wait_until(lambda: all(robot.is_stopped for robot in robots), f"X stops all: {where}")
            assert await page.locator("#login-user").input_value() == "", "it is no letter here"
            for robot in robots:
                robot.free()


async def test_a_letter_that_stops_is_written_with_alt(stage: Stage) -> None:
    async with page_at(stage) as page:
        await page.evaluate(f"() => {{ {FOCUS['text']} }}")
        await page.keyboard.type("ma")
        await page.keyboard.press("Alt+x")
        await page.keyboard.press("Alt+Shift+X")
        assert await page.locator("#login-user").input_value() == "maxX"
        assert not any(robot.orders for robot in stage.robots.values())


@pytest.mark.thorough
async def test_space_and_escape_stop_the_wheels_whatever_has_the_focus(stage: Stage) -> None:
    async with page_at(stage) as page:
        await take(page)
        wheels = Wheels(stage)
        for key in ("Space", "Escape"):
            for focus in FOCUS.values():
                await page.evaluate(f"() => {{ {focus} }}")
                wheels.forget()
                await page.keyboard.press(key)
                await wheels.wait_halted()
        await asyncio.sleep(0.2)
        assert await page.locator("body").get_attribute("data-held") == "scout1", "it is no button's press"


async def test_arrows_drive_whatever_has_the_focus_unless_a_text_is_written_there(stage: Stage) -> None:
    async with page_at(stage) as page:
        await take(page)
        wheels = Wheels(stage)
        for where in ("nothing", "speed", "look", "tab", "pad", "button"):
            await page.evaluate(f"() => {{ {FOCUS[where]} }}")
            wheels.forget()
            await page.keyboard.down("ArrowRight")
            await wheels.wait_turning()
            await page.keyboard.up("ArrowRight")
            await wheels.wait_halted()
        assert await page.locator("#speed").input_value() == "25"
        assert await page.locator("#theme").input_value() == ""
        assert await page.locator("#tab-alarms").get_attribute("aria-selected") == "true"
        await page.keyboard.press("+")
        assert await page.locator("#speed").input_value() == "30"
        await page.evaluate(f"() => {{ {FOCUS['text']} }}")
        await page.keyboard.press("ArrowRight")
        await wheels.assert_still("it moves within the text")


async def test_without_a_robot_x_stops_the_one_whose_card_has_the_focus(stage: Stage) -> None:
    async with page_at(stage) as page:
        await card(page, "scout2").get_by_role("button", name="Take over").focus()
        await page.keyboard.press("x")
        await wait_until(lambda: stage.robots["scout2"].is_stopped, "stopped")
        assert not stage.robots["scout1"].is_stopped
