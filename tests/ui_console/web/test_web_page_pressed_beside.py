"""Buttons and keys pressed beside the control that drives, in a real browser."""

from __future__ import annotations

import pytest
from examples import rest_thorough
from web_page import Key, Mouse, Wheels, page_at, take, wait_stopped
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


@pytest.mark.parametrize("other", rest_thorough(["right", "middle"]))
async def test_a_second_mouse_button_halts_and_neither_button_drives_before_a_new_press(
    stage: Stage, other: str
) -> None:
    """A browser reports the release of one button only when all are up."""
    async with page_at(stage) as page:
        await take(page)
        wheels, mouse = Wheels(stage), Mouse(page)
        await mouse.hold()
        await wheels.wait_turning()
        await page.mouse.down(button=other)
        await wheels.wait_halted()
        await mouse.let_go()
        await wheels.assert_still("only the other button is down")
        await page.mouse.up(button=other)
        await mouse.hold()
        await wheels.wait_turning()
        await mouse.let_go()
        await wheels.wait_halted()


@pytest.mark.parametrize(("letter", "robot"), rest_thorough([("x", "scout1"), ("Shift+X", "scout2")]))
async def test_a_letter_that_stops_does_so_while_alt_is_held_beside_a_drive_key(
    stage: Stage, letter: str, robot: str
) -> None:
    """As in a terminal, where the letter arrives with Alt if Escape was pressed just before."""
    async with page_at(stage) as page:
        await take(page)
        wheels, key = Wheels(stage), Key(page)
        await key.hold()
        await wheels.wait_turning()
        await page.keyboard.down("Alt")
        await page.keyboard.press(letter)
        await wait_stopped(page, robot)
