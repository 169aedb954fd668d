"""Login by hand: a token and a name may have any letters, also those that stop robots on a connected page."""

from __future__ import annotations

import pytest
from web_page import page_at, wait_until
from web_stage import ANYBODY, Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


async def test_a_name_with_the_letter_of_the_stop_is_typed_at_the_login(stage: Stage) -> None:
    async with page_at(stage) as page:
        await page.evaluate("() => sessionStorage.clear()")
        await page.reload()
        await page.wait_for_selector("#login:not([hidden])")
        await page.locator("#login-token").press_sequentially(ANYBODY)
        await page.locator("#login-user").press_sequentially("Max X")
        await page.keyboard.press("Enter")
        await page.wait_for_selector(".robot[data-robot=scout1]")
        await wait_until(lambda: [one.welcome.user for one in stage.hub.clients] == ["Max X"], "the typed name")
