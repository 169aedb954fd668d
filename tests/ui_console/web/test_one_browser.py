"""Tests of a process share a browser: each has a page like new, and a browser that has crashed is replaced."""

from __future__ import annotations

import contextlib

import pytest
from web_page import page_at
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

KEPT = """() => {
  const kept = [localStorage.left, sessionStorage.left, document.cookie, window.name].filter(Boolean);
  localStorage.left = sessionStorage.left = document.cookie = window.name = "here";
  window.pressed = [];
  for (const kind of ["keydown", "mousedown"])
    addEventListener(kind, (event) => window.pressed.push([kind, event.repeat ?? false, event.buttons ?? 0]));
  return kept;
}"""


async def test_nothing_a_page_keeps_is_left_for_the_next(stage: Stage) -> None:
    for _ in range(2):
        async with page_at(stage) as page:
            assert await page.evaluate(KEPT) == []
            await page.keyboard.down("d")
            await page.mouse.down(button="middle")
            assert await page.evaluate("() => window.pressed") == [["keydown", False, 0], ["mousedown", False, 4]]


@pytest.mark.parametrize("theme", ["dark", "light"])
async def test_each_test_has_the_theme_it_asks_for(stage: Stage, theme: str) -> None:
    async with page_at(stage, theme=theme) as page:
        assert await page.evaluate("() => document.documentElement.dataset.theme") == theme


async def test_a_page_of_a_test_that_failed_is_not_kept(stage: Stage) -> None:
    with contextlib.suppress(ZeroDivisionError):
        async with page_at(stage) as failed:
            raise ZeroDivisionError
    assert failed.is_closed()
    async with page_at(stage) as page, page_at(stage) as beside:
        assert await page.locator(".robot").count() == await beside.locator(".robot").count() == 3


async def test_after_a_crash_of_the_browser_the_next_page_has_another(stage: Stage) -> None:
    with contextlib.suppress(Exception):  # whatever a crashed browser answers
        async with page_at(stage) as page:
            browser = page.context.browser
            await (await browser.new_browser_cdp_session()).send("Browser.crash")
    assert not browser.is_connected()
    async with page_at(stage) as page:
        assert await page.locator(".robot").count() == 3
