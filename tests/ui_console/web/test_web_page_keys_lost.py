"""Keys whose release a browser does not report: they drive no robot on."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from examples import rest_thorough
from web_page import Key, Wheels, page_at, take
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

DRAG = "() => document.querySelector('#mission').dispatchEvent(new DragEvent('dragstart', { bubbles: true }))"
TAKERS: dict[str, Callable[[Any], Awaitable[Any]]] = {
    "menu": lambda page: page.locator("#mission").click(button="right"),
    "drag": lambda page: page.evaluate(DRAG),
    "command": lambda page: page.keyboard.down("Meta"),
    "list": lambda page: page.locator("#theme").click(),
    "list by a key": lambda page: page.locator("#theme").press("F4"),
}


@pytest.mark.parametrize("taker", rest_thorough(TAKERS))
async def test_a_key_whose_release_may_not_be_reported_counts_as_released(stage: Stage, taker: str) -> None:
    async with page_at(stage) as page:
        await take(page)
        wheels = Wheels(stage)
        await Key(page).hold()
        await wheels.wait_turning()
        await TAKERS[taker](page)
        await wheels.wait_halted()
        await wheels.assert_still("its release is not reported")
