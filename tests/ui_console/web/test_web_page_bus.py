"""The page's panel "Messages on the bus", in a real browser."""

from __future__ import annotations

from typing import Any

import pytest
from axe import serious_findings
from bus_speaker import LOGGED, PICTURES, SPEAKER, speaker
from web_browser import assert_no_sideways_scroll
from web_page import page_at, wait_until
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

PIXEL = "() => [...document.querySelector('#bus-place canvas').getContext('2d').getImageData(5, 5, 1, 1).data]"


async def open_list(page: Any) -> None:
    await page.locator("#bus summary").click()
    await key_button(page, LOGGED["key"]).wait_for()


def key_button(page: Any, key: str) -> Any:
    return page.locator("#bus-keys").get_by_role("button", name=key, exact=True)


def field_button(page: Any, field: str) -> Any:
    return page.locator("#bus-fields").get_by_role("button", name=field, exact=True)


async def wait_points(page: Any, count: int) -> None:
    await page.wait_for_function(
        f"() => document.querySelector('#bus-plots .line')?.getAttribute('points').split(' ').length >= {count}"
    )


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "theme"), [("desktop", "light"), ("phone", "dark")])
async def test_a_key_is_found_viewed_and_plotted_and_a_closed_panel_costs_nothing(
    stage: Stage, size: str, theme: str
) -> None:
    async with speaker(stage), page_at(stage, size, theme=theme) as page:
        assert stage.network.overhearers == []
        await open_list(page)
        await assert_no_sideways_scroll(page)
        assert await serious_findings(page) == []
        await page.locator("#bus-words").fill("frame capture")
        await page.locator("#bus-told").get_by_text("1 shown").wait_for()
        await page.locator("#bus-words").fill("story")
        await key_button(page, PICTURES["key"]).wait_for(state="detached")
        await key_button(page, LOGGED["key"]).click()
        await page.locator("#bus-fields").get_by_text("round").wait_for()
        assert not stage.hub.keys.is_counting
        assert stage.hub.keys.looked_at == {tuple(LOGGED.values())}
        await field_button(page, "at_s").click()
        await wait_points(page, 5)
        await page.get_by_role("img", name="at_s: now").wait_for()
        await assert_no_sideways_scroll(page)
        assert await serious_findings(page) == []
        await field_button(page, "at_s").click()
        await page.locator("#bus-plots svg").wait_for(state="detached")
        await page.get_by_role("button", name="Back to the keys").click()
        await wait_until(lambda: stage.hub.keys.is_counting, "the list again")
        assert await page.evaluate("() => document.activeElement.textContent") == LOGGED["key"]
        await page.locator("#bus summary").click()
        await wait_until(lambda: not stage.network.overhearers, "nothing is heard")


@pytest.mark.thorough
async def test_a_picture_is_shown_as_one_and_comes_back_with_the_connection(stage: Stage) -> None:
    async with speaker(stage), page_at(stage) as page:
        await open_list(page)
        await key_button(page, PICTURES["key"]).click()
        await page.wait_for_selector("#bus-place canvas[data-number]")
        assert (await page.evaluate(PIXEL))[0] == pytest.approx(200, abs=5)
        assert await page.locator("#bus-place canvas").get_attribute("aria-label") == f"picture of {SPEAKER}/frames"
        await page.context.set_offline(True)
        await page.wait_for_selector("body.is-blind")
        await wait_until(lambda: not stage.network.overhearers, "nothing is heard for a page that is gone")
        await page.context.set_offline(False)
        await page.wait_for_selector("body:not(.is-blind)")
        await page.wait_for_selector("#bus-place:not(.is-stale) canvas[data-number]")


async def test_a_hidden_page_looks_at_nothing(stage: Stage) -> None:
    hides = "isHidden => { Object.defineProperty(document, 'hidden', { value: isHidden, configurable: true });"
    tells = "document.dispatchEvent(new Event('visibilitychange')); }"
    async with speaker(stage), page_at(stage) as page:
        await open_list(page)
        await page.evaluate(hides + tells, True)
        await wait_until(lambda: not stage.network.overhearers, "nothing is heard")
        await page.evaluate(hides + tells, False)
        await wait_until(lambda: stage.hub.keys.is_counting, "the list again")
