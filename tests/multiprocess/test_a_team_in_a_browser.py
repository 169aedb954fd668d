"""The mixed team driven from a page in a real browser: on wheels, on legs, a camera that pans, a lamp."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
import web_browser
from running_mission import mission_up
from served_page import Served, hold_until, serving, truth, wait_until

from backbone.keys import Conversation
from resource_pool.localization import Pose
from resource_pool.messages import Applied

pytest.importorskip("mink", reason="the walker's legs need the extra 'walker'")
pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

TEAM = Path(__file__).parents[2] / "docs" / "examples" / "team.xml"
WITHIN_S = 30.0
AHEAD_M = 0.1


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with mission_up(mission_xml=TEAM) as mission, serving(mission) as made:
        yield made
        made.process.terminate()
        assert made.process.wait(20) == 0


async def take(page: Any, robot: str) -> None:
    await page.locator(f".robot[data-robot={robot}]").get_by_role("button", name="Take over").click()
    await page.wait_for_selector(f"body[data-held={robot}]")


@pytest.mark.thorough
async def test_each_of_a_team_is_taken_over_and_driven_from_the_page(served: Served) -> None:
    address = f"http://127.0.0.1:{served.port}/#token={served.token}"
    async with (
        served.mission.bus() as bus,
        web_browser.page_at("desktop", address, shows=".robot[data-robot=walker1]") as page,
    ):
        applied: list[Applied] = []
        for robot in ("rover1", "wall-camera"):
            at = f"resource_pool/{robot}"
            bus.subscribe(at, Conversation.MOTIONS, Applied, lambda heard: applied.append(heard.body))

        def is_applied(word: str, **values: float) -> Callable[[], Awaitable[bool]]:
            async def is_so() -> bool:
                return any(one.command == word and values.items() <= one.values.items() for one in applied)

            return is_so

        for robot in ("rover1", "walker1", "scout1"):
            await take(page, robot)
            before = await truth(bus, robot)

            async def is_ahead(robot: str = robot, before: Pose = before) -> bool:
                now = await truth(bus, robot)
                return math.dist((now.x_m, now.y_m), (before.x_m, before.y_m)) > AHEAD_M

            down, up = partial(page.keyboard.down, "ArrowUp"), partial(page.keyboard.up, "ArrowUp")
            await hold_until(page, down, up, is_ahead, f"{robot} moves while the key is down")
            await up()

        await page.get_by_role("combobox", name="Taken with").select_option("lit_drive")
        await page.get_by_role("button", name="Take anew").click()
        await page.get_by_role("slider", name="brightness").fill("0.8")
        await page.locator("#commands").get_by_role("button", name="Shine", exact=True).click()
        await page.locator("#applied", has_text="shine brightness 0.8").wait_for()

        await take(page, "rover1")
        await page.get_by_role("slider", name="closed").fill("1")
        await page.locator("#commands").get_by_role("button", name="Grip", exact=True).click()
        await wait_until(is_applied("grip", closed=1.0), "the gripper closes", WITHIN_S)

        await take(page, "wall-camera")
        await page.get_by_role("slider", name="pan").fill("-0.28")
        await page.locator("#commands").get_by_role("button", name="Look", exact=True).click()
        await wait_until(is_applied("look", pan_rad=-0.28), "the camera pans", WITHIN_S)
