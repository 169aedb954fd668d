"""Stops on the page, in a real browser: pressed at any place and in any focus, lifted only by who means it."""

from __future__ import annotations

import asyncio

import pytest
from examples import rest_thorough
from web_browser import Cable, Finger
from web_page import (
    ALL_SIZES,
    GAMEPAD,
    HANDS,
    Pad,
    Wheels,
    card,
    page_at,
    stop_button,
    take,
    wait_free,
    wait_stopped,
    wait_until,
)
from web_stage import ANYBODY, LOW, Stage

from resource_pool.commands import Move
from ui_console.model.driving import STICK_LASTS_S

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
