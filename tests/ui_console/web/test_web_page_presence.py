"""An operator who uses the page is there: by mouse or finger, and by the keyboard alone."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest
from examples import rest_thorough
from web_page import page_at, wait_until
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

TOUCHES: dict[str, Callable[[Any], Awaitable[Any]]] = {
    "pointer": lambda page: page.mouse.click(5, 5),
    "keyboard": lambda page: page.keyboard.press("Tab"),
}


@pytest.mark.parametrize("touch", rest_thorough(reversed(TOUCHES)))
async def test_an_operator_who_touches_the_page_is_there_again(stage: Stage, touch: str) -> None:
    async with page_at(stage) as page:
        [operator] = stage.hub.clients
        operator.is_there = False
        await TOUCHES[touch](page)
        await wait_until(lambda: operator.is_there, f"there by {touch}")
