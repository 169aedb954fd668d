"""Login by hand: a token and a name may have any letters; what no server reads is asked for again."""

from __future__ import annotations

import pytest
from examples import rest_thorough
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


@pytest.mark.parametrize(("token", "user"), rest_thorough([("x" * 10_000, ""), ("x" * 300, ""), (ANYBODY, "n" * 64)]))
async def test_a_token_or_a_name_that_is_too_long_is_asked_for_again(stage: Stage, token: str, user: str) -> None:
    async with page_at(stage, expects=("WebSocket",)) as page:
        await page.goto("about:blank")
        await page.goto(f"http://127.0.0.1:{stage.port}/#token={token}&user={user}")
        await page.wait_for_selector("#login:not([hidden])")
        assert await page.locator("#login-why").inner_text()
        await page.locator("#login-token").fill(ANYBODY)
        await page.locator("#login-user").fill("anna")
        await page.keyboard.press("Enter")
        await page.wait_for_selector(".robot[data-robot=scout1]")
