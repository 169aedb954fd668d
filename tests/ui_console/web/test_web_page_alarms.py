"""Alarms on the page: each is asked why at one touch, and says what follows from it and where to look."""

from __future__ import annotations

import pytest
from web_page import page_at, take
from web_stage import Stage

from ui_console.model.views import AlarmKind

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


async def test_an_alarm_is_asked_why_at_one_touch_and_says_what_follows_from_it(stage: Stage) -> None:
    async with page_at(stage) as page:
        await take(page)
        alarms, now_s = stage.hub.team.alarms, stage.hub.clock.now_s()
        alarms.begin(AlarmKind.ABSENT, "scout1", "scout1 is absent: killed by SIGKILL", now_s)
        alarms.begin(AlarmKind.RC_DOWN, "scout1", "scout1 cannot be reached", now_s)
        row = page.locator("#panel tr", has_text="scout1 is absent")
        await row.wait_for()
        assert "what follows from it: scout1 cannot be reached" in await row.inner_text()
        assert await page.locator("#panel tr", has_text="scout1 cannot be reached").count() == 1
        await row.get_by_role("button", name="Why?").click()
        await page.get_by_text("Why scout1?").wait_for()
