"""All that a robot reports, behind the fold on its card, in a real browser."""

from __future__ import annotations

import pytest
from axe import serious_findings
from web_browser import assert_no_sideways_scroll
from web_page import card, page_at
from web_stage import Stage

from backbone.component.abilities import Abilities, field_forms
from backbone.component_database.messages import ComponentType, TypeCount, Types
from backbone.keys import Conversation
from backbone.naming import Subsystem
from resource_pool.messages import Readings
from resource_pool.robots.rover.report import RoverReport
from ui_console.model.events import Heard

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

VALUES = {"battery_share": 0.87, "lift": 0.25, "left_wheel_m": 12.3, "front_bumper": False, "is_holding": True}


@pytest.mark.thorough
@pytest.mark.parametrize(("size", "theme"), [("desktop", "dark"), ("phone", "light")])
async def test_each_report_is_a_bar_a_lamp_or_words_and_stays_in_its_place(stage: Stage, size: str, theme: str) -> None:
    abilities = Abilities(is_robot=True, reports=field_forms(RoverReport))
    scout = ComponentType("scout", "x:Y", Subsystem.RESOURCE_POOL, abilities=abilities)
    async with page_at(stage, size, theme=theme) as page:
        stage.hub.team.apply(Heard(stage.clock.now_s(), Types([TypeCount(scout, 1)])))
        assert await card(page).locator(".reports").is_hidden()
        tell(stage, VALUES)
        reports = card(page).locator(".reports")
        await reports.locator("summary").click()
        rows = [[await row.inner_text() for row in await reports.locator(kind).all()] for kind in ("dt", "dd")]
        assert [name.strip() for name in rows[0]] == ["battery", "lift", "left wheel", "front bumper", "is holding"]
        assert [" ".join(text.split()) for text in rows[1]] == ["87 %", "0.25 0 to 1", "12.3 m", "off", "on"]
        assert await reports.locator("meter").count() == 2
        assert await reports.locator(".lamp.is-on").count() == 1
        assert await card(page).locator(".gauges").inner_text() == "battery 87 %"
        await reports.locator("meter").nth(1).evaluate("one => { one.dataset.kept = 'yes'; }")
        tell(stage, {**VALUES, "lift": 0.75})
        await page.wait_for_selector("meter[data-kept] + .text:text-is('0.75')")
        assert await page.locator("meter[data-kept]").evaluate("one => one.value") == 0.75
        await assert_no_sideways_scroll(page)
        assert await serious_findings(page) == []


def tell(stage: Stage, values: dict[str, float | bool]) -> None:
    """Let scout1 report these values."""
    bus = stage.robots["scout1"].bus
    bus.publish(bus.source, Conversation.READINGS, Readings("scout1", stage.clock.now_s(), values))
