"""Tests of a process share a browser: each has a context of its own, and a browser that has crashed is replaced."""

from __future__ import annotations

import contextlib

import pytest
from web_page import page_at
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

KEPT = "() => { const kept = localStorage.left; localStorage.left = 'here'; return kept ?? ''; }"


async def test_nothing_a_page_keeps_is_left_for_the_next(stage: Stage) -> None:
    for _ in range(2):
        async with page_at(stage) as page:
            assert await page.evaluate(KEPT) == ""


async def test_after_a_crash_of_the_browser_the_next_page_has_another(stage: Stage) -> None:
    with contextlib.suppress(Exception):  # whatever a crashed browser answers
        async with page_at(stage) as page:
            browser = page.context.browser
            await (await browser.new_browser_cdp_session()).send("Browser.crash")
    assert not browser.is_connected()
    async with page_at(stage) as page:
        assert await page.locator(".robot").count() == 3
