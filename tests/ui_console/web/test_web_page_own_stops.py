"""Stops that one operator alone has set are lifted together, in a real browser."""

from __future__ import annotations

import pytest
from web_page import card, page_at, stop_button, wait_free, wait_stopped
from web_stage import LOW, Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]


async def test_an_operator_lifts_all_stops_of_his_own_by_one_button_and_no_other_stop(stage: Stage) -> None:
    robots = [f"scout{number}" for number in range(1, 7)]
    stage.place_robots(*robots)
    async with page_at(stage) as page, stage.browser(LOW) as ben:
        await stop_button(page).click()
        await wait_stopped(page)
        assert await card(page).locator(".lift-own").is_hidden(), "there is one stop"
        await page.get_by_role("button", name="Stop all robots").click()
        for robot in robots:
            await wait_stopped(page, robot)
        await ben.say(do="stop_robot", robot=robots[1])
        await card(page).get_by_text(f"Hold to lift your {len(robots) - 1} stops").hover()
        await page.mouse.down()
        for robot in (robots[0], *robots[2:]):
            await wait_free(page, robot)
        await page.mouse.up()
        assert [robot for robot in robots if stage.robots[robot].is_stopped] == [robots[1]]
