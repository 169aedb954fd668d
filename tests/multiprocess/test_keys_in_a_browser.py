"""The page's panel "Messages on the bus" beside a running mission, between processes."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest
from axe import serious_findings
from running_mission import mission_up
from served_page import Served, serving, wait_until
from web_browser import keep_picture, page_at

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus
from backbone.component.messages import AskStatistics, Statistics

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

WITHIN_S = 30.0
LEASES = "leases"


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with mission_up() as mission, serving(mission) as made:
        yield made


async def copies(bus: Bus) -> float:
    """Return how often the RC manager made copies."""
    told = await bus.ask(RC_MANAGER, AskStatistics(), Statistics, within_s=5.0)
    return float(dict(told.values)["bus_told"])


async def choose(page: Any, words: str, key: str) -> None:
    await page.locator("#bus-words").fill(words)
    await page.locator("#bus-keys").get_by_role("button", name=key, exact=True).first.click()


@pytest.mark.thorough
async def test_any_key_is_viewed_and_afterwards_nobody_makes_copies(served: Served) -> None:
    address = f"http://127.0.0.1:{served.port}/#token={served.token}"
    async with served.mission.bus() as bus, page_at("desktop", address, shows=".robot[data-robot=scout1]") as page:
        assert await copies(bus) == 0.0
        await page.locator("#bus summary").click()
        await choose(page, "scout1 telemetry", "resource_pool/scout1/telemetry")
        await page.locator("#bus-fields button").first.click()
        await page.locator("#bus-plots .line").wait_for(state="attached")
        await page.get_by_role("button", name="Back to the keys").click()
        await choose(page, "frames capture", "resource_pool/watch-scout1-capture/frames")
        await page.wait_for_selector("#bus-place canvas[data-number]")
        await page.locator("#bus-fields").get_by_role("button", name="number", exact=True).click()
        await page.locator("#bus-plots .line").wait_for(state="attached")
        await page.locator("#bus-place").scroll_into_view_if_needed()
        await keep_picture(page, "web-keys")
        assert await serious_findings(page) == []
        await page.get_by_role("button", name="Back to the keys").click()
        await choose(page, f"rc_manager {LEASES}", f"{RC_MANAGER}/{LEASES}")  # of copies: it is never dropped
        await page.locator("#bus-fields td").first.wait_for()
        before = await copies(bus)
        assert before > 0.0
        await page.locator("#bus summary").click()

        async def is_silent() -> bool:
            nonlocal before
            former, before = before, await copies(bus)
            return former == before

        await wait_until(is_silent, "no copies are made", WITHIN_S)
