"""Stops are lifted on the page only by who means it, in a real browser."""

from __future__ import annotations

import asyncio

import pytest
from web_page import card, page_at, stop_button, wait_free, wait_stopped
from web_stage import LOW, Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

HOLD_S = 1.0  # as holding.js has it

HELD_FOR = """async (button, [by, forMs]) => {
  const fire = (kind) => button.dispatchEvent(
    by === "mouse"
      ? new PointerEvent(`pointer${kind}`, { bubbles: true, isPrimary: true })
      : new KeyboardEvent(`key${kind}`, { bubbles: true, key: "Enter", code: "Enter" }),
  );
  fire("down");
  await new Promise((resolve) => setTimeout(resolve, forMs));
  fire("up");
}"""
"""Held by the page's own timers, which also on a busy machine end in their order: no machine holds it longer."""


@pytest.mark.thorough
@pytest.mark.parametrize("by", ["mouse", "enter"])
async def test_a_stop_is_lifted_by_holding_for_a_second_and_by_nothing_shorter(stage: Stage, by: str) -> None:
    async def press() -> None:
        if by == "mouse":
            await page.mouse.down()
        else:
            await page.keyboard.down("Enter")

    async def let_go() -> None:
        if by == "mouse":
            await page.mouse.up()
        else:
            await page.keyboard.up("Enter")

    async with page_at(stage) as page:
        await stop_button(page).click()
        await wait_stopped(page)
        lift = card(page).locator(".lift")
        await lift.focus()
        await lift.hover()
        for held_s in (0.05, 0.4, 0.95 * HOLD_S):
            await lift.evaluate(HELD_FOR, [by, 1000 * held_s])
        await lift.dblclick()
        await page.keyboard.press("Space")
        await asyncio.sleep(HOLD_S)
        assert stage.robots["scout1"].lifts == 0
        await lift.focus()
        await lift.hover()
        await press()
        await wait_free(page)
        await let_go()
        assert stage.robots["scout1"].lifts == 1


async def test_another_stop_that_comes_while_lift_is_held_is_not_lifted(stage: Stage) -> None:
    async with page_at(stage) as page:
        await stop_button(page).click()
        await wait_stopped(page)
        await card(page).locator(".lift").hover()
        await page.mouse.down()
        await asyncio.sleep(0.5)
        stage.robots["scout1"].stop("ben", "", "somebody on the floor")
        await asyncio.sleep(HOLD_S + 0.5)
        await page.mouse.up()
        assert stage.robots["scout1"].is_stopped


@pytest.mark.thorough
async def test_who_lifts_anothers_stop_reads_whose_it_is_and_that_one_is_asked(stage: Stage) -> None:
    async with page_at(stage) as page, stage.browser(LOW) as ben:
        await ben.say(do="stop_robot", robot="scout1")
        await wait_stopped(page)
        standing = card(page).locator(".standing")
        assert "STOPPED by ben" in await standing.inner_text()
        assert "asks ben first" in await standing.inner_text()
        for is_given in (False, True):
            await standing.locator(".lift").hover()
            await page.mouse.down()
            await ben.wait(lambda: ben.view["own"]["consent"], "ben is asked")
            await page.mouse.up()
            assert ben.view["own"]["consent"]["topic"] == "lift"
            assert stage.robots["scout1"].is_stopped
            await ben.decide(is_given=is_given)
            if is_given:
                await wait_free(page)
            else:
                await page.locator("#asked").get_by_text("ben keeps scout1 stopped").wait_for()


async def test_who_stopped_a_robot_reads_that_a_yes_lets_it_move(stage: Stage) -> None:
    async with page_at(stage) as page, stage.browser(LOW) as ben:
        await stop_button(page).click()
        await wait_stopped(page)
        await ben.say(do="lift", robot="scout1", number=stage.robots["scout1"].latch.state.number)
        asked = page.get_by_role("alertdialog", name="ben asks whether scout1, which you stopped, may move again")
        await asked.get_by_role("button", name="Keep it stopped").wait_for()
        await asked.get_by_role("button", name="Let it move").click()
        await wait_free(page)


async def test_a_yes_pressed_twice_answers_one_question_and_not_the_next(stage: Stage) -> None:
    async with page_at(stage) as page, stage.browser(LOW) as ben, stage.browser() as anna:
        for robot, asks in (("scout1", ben), ("scout2", anna)):
            await stop_button(page, robot).click()
            await wait_stopped(page, robot)
            await asks.say(do="lift", robot=robot, number=stage.robots[robot].latch.state.number)
            await asks.wait(lambda asks=asks: "asked desktop" in asks.view["own"]["asked"], "asked")  # type: ignore[misc]
        await page.locator("#consent-line").get_by_text("1 more ask").wait_for()
        yes = page.locator("#consent-yes")
        await yes.click()
        await wait_free(page, "scout1")
        box = await yes.bounding_box()
        await page.mouse.click(box["x"] + 9, box["y"] + 9)
        await asyncio.sleep(0.3)
        assert stage.robots["scout2"].is_stopped
        await page.locator("#consent-line").get_by_text("anna asks whether scout2").wait_for()
