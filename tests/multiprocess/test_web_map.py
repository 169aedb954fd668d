"""The map of a real mission in a real browser: robots are sent by taps, and the world tells where they went."""

from __future__ import annotations

import math
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

import pytest
import web_browser
from running_mission import mission_up
from served_page import Served, hold_until, serving, truth, wait_until

from backbone.bus.interface import Bus

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

WITHIN_S = 60.0
ROOM_M = (9.0, 6.0)
NEAR_M = 0.4  # as the test of go_to itself: dead reckoning


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    with mission_up() as mission, serving(mission) as made:
        yield made
        made.process.terminate()
        assert made.process.wait(20) == 0


async def wait_there(page: Any, bus: Bus, robot: str, x_m: float, y_m: float) -> None:
    """Return when the robot is at the place in truth."""

    async def is_there() -> bool:
        pose = await truth(bus, robot)
        return math.dist((pose.x_m, pose.y_m), (x_m, y_m)) < NEAR_M

    try:
        await wait_until(is_there, f"{robot} at {x_m}, {y_m}", WITHIN_S)
    except pytest.fail.Exception:
        told = await page.locator("#orders").text_content()
        pytest.fail(f"{robot} is at {await truth(bus, robot)}, not at {x_m}, {y_m}; orders: {told}")


@asynccontextmanager
async def page_at(served: Served) -> AsyncIterator[Any]:
    address = f"http://127.0.0.1:{served.port}/#token={served.token}"
    async with web_browser.page_at("desktop", address, shows="#map-plan [data-body=scout3]") as page:
        yield page


async def tap(page: Any, x_m: float, y_m: float) -> None:
    """Tap this place on the map."""
    plan = page.locator("#map-plan")
    box = await plan.bounding_box()
    scale = box["width"] / ROOM_M[0]
    await plan.click(position={"x": scale * x_m, "y": box["height"] - scale * y_m})


async def tap_picture(page: Any, robot: str) -> None:
    """Tap the floor ahead in the fresh picture of the robot."""
    canvas = page.locator(f".robot.is-large[data-robot={robot}]:not(.is-stale) canvas")
    box = await canvas.bounding_box()
    await canvas.click(position={"x": 0.5 * box["width"], "y": 0.75 * box["height"]})


async def order(page: Any, tap_once: Callable[[], Awaitable[None]], shown: str) -> None:
    """Tap until the order is shown. A page that refuses a tap, as in an old picture, says so, and one taps again."""
    said = page.locator("#notices")
    while await page.locator(shown).count() == 0:
        await said.evaluate("notices => notices.replaceChildren()")
        await tap_once()
        await page.locator(shown).or_(said.locator(":scope > *")).first.wait_for(state="attached")


@pytest.mark.thorough
async def test_robots_go_where_a_person_taps_on_the_map_and_one_goes_on_while_the_person_drives_another(
    served: Served,
) -> None:
    async with served.mission.bus() as bus, page_at(served) as page:
        assert await page.locator("#map-plan [data-body=scout3] .source").text_content() == "dead reckoning"
        assert await page.locator("#map-plan .furniture").count() == 4
        await page.locator("#map-bodies [data-body=scout3]").click()
        await order(page, partial(tap, page, 5.5, 2.2), "#orders [data-order=scout3]")
        await page.locator(".robot[data-robot=scout1]").get_by_role("button", name="Take over").click()
        await page.wait_for_selector("body[data-held=scout1]")
        await page.wait_for_selector("#map-plan [data-goal=scout3]")
        await wait_there(page, bus, "scout3", 5.5, 2.2)
        assert await page.locator("body").get_attribute("data-held") == "scout1"
        await web_browser.keep_picture(page, "web-map")


@pytest.mark.thorough
async def test_a_robot_goes_to_the_place_that_was_tapped_in_its_picture_and_the_stick_takes_it_back(
    served: Served,
) -> None:
    async with served.mission.bus() as bus, page_at(served) as page:
        before = await truth(bus, "scout2")
        await page.locator(".robot[data-robot=scout2]").get_by_role("button", name="Take over").click()
        await page.wait_for_selector("body[data-held=scout2]")
        await order(page, partial(tap_picture, page, "scout2"), "body[data-ordered=scout2]")
        goal = page.locator("#orders .is-over[data-order=scout2]")
        down, up = partial(page.keyboard.down, "ArrowRight"), partial(page.keyboard.up, "ArrowRight")
        await hold_until(page, down, up, goal.is_visible, "the stick ends the order")
        await up()
        await page.wait_for_selector("body[data-held=scout2]")
        assert "by the stick" in await goal.text_content()
        place = (await goal.text_content()).split("go to ")[1].split(" (")[0].split(", ")
        x_m, y_m = map(float, place)
        ahead_m = math.dist((x_m, y_m), (before.x_m, before.y_m))
        bearing_rad = math.atan2(y_m - before.y_m, x_m - before.x_m)
        assert 0.2 < ahead_m < 1.6
        assert abs(math.remainder(bearing_rad - before.heading_rad, math.tau)) < 0.2, "straight ahead, as it was tapped"


@pytest.mark.thorough
async def test_a_group_goes_to_places_side_by_side_and_an_order_is_stopped(served: Served) -> None:
    async with served.mission.bus() as bus, page_at(served) as page:
        for robot in ("scout1", "scout2"):
            await page.locator(f"#map-bodies [data-body={robot}]").click()
        places = [await truth(bus, robot) for robot in ("scout1", "scout2")]
        between_m = (places[0].x_m + places[1].x_m) / 2
        await order(page, partial(tap, page, between_m, 2.5), "#map-plan [data-goal=scout1]")
        await page.wait_for_selector("#map-plan [data-goal=scout2]")

        async def has_moved() -> bool:
            now = await truth(bus, "scout1")
            return math.dist((now.x_m, now.y_m), (places[0].x_m, places[0].y_m)) > 0.3

        await wait_until(has_moved, "scout1 goes", WITHIN_S)
        await page.locator("#map-end").click()
        for robot in ("scout1", "scout2"):
            await page.wait_for_selector(f"#orders .is-over[data-order={robot}]")
