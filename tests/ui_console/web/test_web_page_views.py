"""The page's panel "What the behaviors see", in a real browser."""

from __future__ import annotations

import pytest
from axe import serious_findings
from shown_views import BEHAVIOR, shower_at
from web_browser import assert_no_sideways_scroll
from web_page import page_at, wait_until
from web_stage import Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

PIXEL = "() => [...document.querySelector('#seen-place canvas').getContext('2d').getImageData(5, 5, 1, 1).data]"


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "theme"), [("desktop", "light"), ("phone", "dark")])
async def test_a_behavior_and_a_view_are_chosen_and_a_closed_panel_costs_nothing(
    stage: Stage, size: str, theme: str
) -> None:
    shower = await shower_at(stage.placer)
    async with page_at(stage, size, theme=theme) as page:
        await page.wait_for_selector(f"#seen-behavior option[value={BEHAVIOR}]", state="attached")
        assert shower.made == {}
        await page.locator("#seen summary").click()
        await page.wait_for_selector("#seen-place canvas[data-number]")
        red, green, _blue, _alpha = await page.evaluate(PIXEL)
        assert (red > 200, green < 60) == (True, True)
        assert await page.locator("#seen-values").inner_text() == "threshold\n28"
        assert await page.locator("#seen-place canvas").get_attribute("aria-label") == f"picture of red of {BEHAVIOR}"
        await page.locator("#seen-view").select_option("white")
        await page.wait_for_selector("#seen-place canvas[aria-label^='picture of white'][data-number]")
        assert (await page.evaluate(PIXEL))[1] > 200
        await assert_no_sideways_scroll(page)
        assert await serious_findings(page) == []
        await page.locator("#seen summary").click()
        await wait_until(lambda: not stage.hub.sights.looked_at, "no look")


@pytest.mark.thorough
async def test_a_page_whose_connection_comes_back_looks_again(stage: Stage) -> None:
    await shower_at(stage.placer)
    async with page_at(stage) as page:
        await page.wait_for_selector(f"#seen-behavior option[value={BEHAVIOR}]", state="attached")
        await page.locator("#seen summary").click()
        await page.wait_for_selector("#seen-place canvas[data-number]")
        await page.context.set_offline(True)
        await page.wait_for_selector("body.is-blind")
        await page.context.set_offline(False)
        await page.wait_for_selector("body:not(.is-blind)")
        await page.wait_for_selector("#seen-place:not(.is-stale) canvas[data-number]")
