"""What is held at the page through a stop, a grant or a dialog moves nothing afterwards, in a real browser."""

from __future__ import annotations

import asyncio

import pytest
from examples import rest_thorough
from web_browser import Cable, Finger
from web_page import GAMEPAD, HANDS, Pad, Wheels, page_at, take, wait_free, wait_stopped, wait_until
from web_stage import ANYBODY, Stage

from resource_pool.commands import Move
from ui_console.model.driving import STICK_LASTS_S

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


@pytest.mark.parametrize("hand", rest_thorough(HANDS))
async def test_what_is_held_through_a_stop_and_its_end_moves_nothing_before_it_is_pressed_anew(
    stage: Stage, hand: str
) -> None:
    async with page_at(stage, script=GAMEPAD) as page, stage.browser() as other:
        await take(page)
        if hand == "gamepad":
            await Pad(page).plug_in()
        wheels, held = Wheels(stage), HANDS[hand](page)
        await held.hold()
        await wheels.wait_turning()
        await other.say(do="stop_robot", robot="scout1")
        await wait_stopped(page)
        stage.robots["scout1"].free()
        await wait_free(page)
        await wheels.assert_still("it is still held from before")
        assert await page.locator("#let-go").is_visible()
        await held.let_go()
        wheels.forget()
        await held.hold()
        await wheels.wait_turning()
        assert await page.locator("#let-go").is_hidden()
        await held.let_go()
        await wheels.wait_halted()


@pytest.mark.parametrize("hand", rest_thorough(reversed(HANDS)))
async def test_what_is_held_when_the_robot_is_granted_moves_nothing_before_it_is_pressed_anew(
    stage: Stage, hand: str
) -> None:
    async with page_at(stage, script=GAMEPAD) as page:
        if hand == "gamepad":
            await Pad(page).plug_in()
        wheels, held = Wheels(stage), HANDS[hand](page)
        await held.hold()
        await page.evaluate("() => document.querySelector('[data-robot=scout1] .row button').click()")
        await page.wait_for_selector("body[data-held=scout1]")
        await wheels.assert_still("it was held before the robot was")
        await held.let_go()
        await held.hold()
        await wheels.wait_turning()


@pytest.mark.thorough
@pytest.mark.parametrize("hand", HANDS)
async def test_what_is_held_while_a_dialog_comes_and_goes_moves_nothing_afterwards(stage: Stage, hand: str) -> None:
    async with page_at(stage, script=GAMEPAD) as page:
        await take(page)
        if hand == "gamepad":
            await Pad(page).plug_in()
        wheels, held = Wheels(stage), HANDS[hand](page)
        await held.hold()
        await wheels.wait_turning()
        await page.evaluate("() => document.getElementById('reading').showModal()")
        await wheels.wait_halted()
        await page.evaluate("() => document.getElementById('reading').close()")
        await wheels.assert_still("it was held before the dialog came")


@pytest.mark.thorough
async def test_a_hold_from_before_a_stop_moves_nothing_however_late_it_arrives(stage: Stage) -> None:
    async with (
        Cable(stage.port).plugged_in() as cable,
        stage.browser() as other,
        page_at(stage, address=f"http://127.0.0.1:{cable.port}/#token={ANYBODY}") as page,
    ):
        await take(page)
        wheels = Wheels(stage)
        await page.keyboard.down("d")
        await wheels.wait_turning()
        cable.may_pass.clear()
        await other.say(do="stop_robot", robot="scout1")
        await wait_until(lambda: stage.robots["scout1"].is_stopped, "stopped")
        stage.robots["scout1"].free()
        await asyncio.sleep(STICK_LASTS_S + 0.1)
        wheels.forget()
        cable.may_pass.set()
        await page.locator("#let-go").wait_for()
        assert not any(isinstance(one, Move) for one in wheels.news), "they were sent before the stop"
        await wheels.assert_still("the key is still down")
        await page.keyboard.up("d")
        await page.keyboard.down("d")
        await wheels.wait_turning()


@pytest.mark.thorough
async def test_a_finger_that_was_on_the_pad_at_a_stop_drives_only_when_put_down_anew(stage: Stage) -> None:
    async with page_at(stage, "phone") as page, stage.browser() as other:
        await take(page)
        wheels, finger = Wheels(stage), Finger(page)
        await finger.push_right()
        await wheels.wait_turning()
        await other.say(do="stop_robot", robot="scout1")
        await wait_stopped(page)
        stage.robots["scout1"].free()
        await wait_free(page)
        await wheels.assert_still("the finger lies there from before")
        await finger.lift()
        await finger.push_right()
        await wheels.wait_turning()
        await finger.lift()
