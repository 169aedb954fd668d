"""The map on the page: robots are seen on it, selected, sent to places on it and in pictures, and taken back."""

from __future__ import annotations

import asyncio
import itertools
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import cv2
import numpy as np
import pytest
from axe import serious_findings
from examples import rest_thorough
from fake_resource_pool import FakeArc
from map_stage import PLAN, Floor, floor_on
from msgspec.structs import replace
from web_browser import Finger, assert_no_sideways_scroll, keep_picture
from web_page import ALL_SIZES, COVERED, page_at, take, wait_until
from web_stage import Stage

from resource_pool.rcs.scout import Scout
from ui_console.model.floor_pick import Stand, floor_place

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

NEAR_M = 0.06  # a pixel of the smallest map, and a centimeter of rounding


@pytest.fixture
async def floor(stage: Stage, beside: Any) -> AsyncIterator[Floor]:
    async with floor_on(stage, beside) as made:
        yield made


@asynccontextmanager
async def map_at(floor: Floor, size: str = "desktop", **options: Any) -> AsyncIterator[Any]:
    """Open the page; the three robots are on its map."""
    async with page_at(floor.stage, size, **options) as page:
        await page.wait_for_selector("#map-plan .furniture")
        await page.wait_for_selector("#map-plan [data-body=scout3]")
        yield page


async def point_at(page: Any, x_m: float, y_m: float) -> tuple[float, float]:
    """Return where a place of the floor is on the screen, after it was scrolled into view."""
    plan = page.locator("#map-plan")
    await plan.scroll_into_view_if_needed()
    box = await plan.bounding_box()
    scale = box["width"] / PLAN.width_m
    return box["x"] + scale * x_m, box["y"] + box["height"] - scale * y_m


async def tap(page: Any, x_m: float, y_m: float) -> None:
    await page.mouse.click(*await point_at(page, x_m, y_m))


async def wait_sent(floor: Floor, robot: str, kind: str, x_m: float = 0.0, y_m: float = 0.0) -> None:
    def is_sent() -> bool:
        orders = floor.ordered.get(robot, [])
        return bool(orders) and orders[-1][0] == kind and math.dist(orders[-1][1:], (x_m, y_m)) < NEAR_M

    try:
        await wait_until(is_sent, f"{robot} gets its order")
    except pytest.fail.Exception:
        pytest.fail(f"{robot} never got {kind} {x_m} {y_m}, but: {floor.ordered}")


@asynccontextmanager
async def publishing(arc: FakeArc) -> AsyncIterator[None]:
    """Have the ARC publish pictures until the block ends."""
    picture = np.full((240, 320), 90, np.uint8).tobytes()

    async def publish() -> None:
        for number in itertools.count():
            arc.publish(picture, 320, 240, number)
            await asyncio.sleep(0.1)

    task = asyncio.create_task(publish(), name="pictures")
    try:
        yield
    finally:
        task.cancel()
        await asyncio.wait({task})


@pytest.mark.thorough
async def test_robots_are_on_the_map_with_name_source_spread_and_trail_and_an_old_place_is_marked(floor: Floor) -> None:
    async with map_at(floor) as page:
        for step in range(1, 20):
            floor.eye.place("scout1", 1.0 + 0.06 * step, 1.0, math.pi / 2, spread_m=0.1)
        await page.wait_for_function(
            "() => document.querySelector('[data-body=scout1] .trail').getAttribute('points').split(' ').length >= 19"
        )
        mark = page.locator("#map-plan [data-body=scout1]")
        assert await mark.locator(".name").text_content() == "scout1"
        assert await mark.locator(".source").text_content() == "tracked from above"
        spread_px = float(await mark.locator(".spread").get_attribute("r"))
        assert spread_px == pytest.approx(0.1 * (await page.locator("#map-plan").bounding_box())["width"] / 6, rel=0.05)
        turn = await mark.locator(".arrow").evaluate("one => one.parentNode.getAttribute('transform')")
        assert float(turn.removeprefix("rotate(").removesuffix(")")) == pytest.approx(-90, abs=0.1)
        assert await page.locator("#map-plan .furniture").count() == 1
        chip = page.get_by_role("button", name="scout1 tracked")
        assert "±0.10 m" in await chip.text_content()
        floor.eye.is_silent = True
        await page.wait_for_selector("#map-plan [data-body=scout1].is-stale")
        assert "s old" in await mark.locator(".source").text_content()


async def test_a_robot_is_selected_by_a_tap_and_sent_to_a_place_and_the_order_can_be_stopped(floor: Floor) -> None:
    async with map_at(floor) as page:
        assert await page.locator("#map-go").is_disabled()
        await tap(page, 2.0, 1.0)
        await page.wait_for_selector("#map-plan [data-body=scout2].is-selected")
        await tap(page, 5.0, 0.5)
        await wait_sent(floor, "scout2", "go_to", 5.0, 0.5)
        await page.wait_for_selector("#orders [data-order=scout2]")
        await page.wait_for_selector("#map-plan [data-goal=scout2]")
        await page.get_by_role("button", name="Stop the order of scout2").click()
        await page.wait_for_selector("#orders .is-over[data-order=scout2]")
        stood_m = floor.eye.poses["scout2"].x_m
        assert stood_m < 5.0
        assert "scout1" not in floor.ordered


@pytest.mark.thorough
async def test_one_person_holds_two_robots_and_the_order_of_the_other_goes_on(floor: Floor) -> None:
    async with map_at(floor) as page:
        await take(page)
        await tap(page, 1.0, 3.9)
        await wait_sent(floor, "scout1", "go_to", 1.0, 3.9)
        await take(page, "scout2")
        await wait_until(lambda: floor.eye.poses["scout1"].y_m == pytest.approx(3.9, abs=NEAR_M), "scout1 arrives")
        assert await page.locator("body").get_attribute("data-held") == "scout2"


@pytest.mark.parametrize("key", rest_thorough(["Space", "ArrowUp"]))
async def test_stick_and_space_take_the_robot_back_from_its_order(floor: Floor, key: str) -> None:
    async with map_at(floor) as page:
        await take(page)
        await page.locator("#map-watch").click()
        await wait_sent(floor, "scout1", "watch_for_motion")
        await page.wait_for_selector("body[data-ordered=scout1][data-held='']")
        await page.keyboard.down(key)
        await page.keyboard.up(key)
        [arc] = floor.stage.placer.arcs.values()
        await wait_until(lambda: not arc.is_idle, "the stick wants it")
        await arc.grant()
        await page.wait_for_selector("body[data-held=scout1]")
        assert "by the stick" in await page.locator("#orders [data-order=scout1]").text_content()


async def test_a_group_goes_to_places_side_by_side_and_follows(floor: Floor) -> None:
    async with map_at(floor) as page:
        for robot in ("scout1", "scout3"):
            await page.locator(f"#map-bodies [data-body={robot}]").click()
        assert "scout1 and scout3" in await page.locator("#map-who").text_content()
        await tap(page, 4.0, 2.0)
        await wait_sent(floor, "scout1", "go_to", 3.75, 2.0)
        await wait_sent(floor, "scout3", "go_to", 4.25, 2.0)
        await page.locator("#map-target").select_option("scout2")
        await page.locator("#map-follow").click()
        await wait_sent(floor, "scout1", "follow")
        await wait_sent(floor, "scout3", "follow")
        await page.locator("#map-return").click()
        await wait_sent(floor, "scout3", "return_home")


async def test_a_tap_in_the_picture_sends_the_robot_to_that_place_on_the_floor(floor: Floor) -> None:
    floor.eye.place("scout1", 2.0, 2.0, 0.5)
    async with map_at(floor) as page:
        await take(page)
        [arc] = floor.stage.placer.arcs.values()
        floor.stage.publish_schedule(scout1=arc.name, scout2="", scout3="")

        async def tap_picture(column: float, row: float) -> None:
            """Tap there, shares of its width and height."""
            canvas = page.locator(".robot.is-large[data-robot=scout1]:not(.is-stale) canvas")
            box = await canvas.bounding_box()
            await canvas.click(position={"x": column * box["width"], "y": row * box["height"]})

        async with publishing(arc):
            await tap_picture(0.5, 0.2)
            await page.locator("#notices", has_text="above the horizon").wait_for()
            assert "scout1" not in floor.ordered
            await tap_picture(0.25, 0.9)
            assert Scout.camera is not None
            seen = floor_place(79.5, 215.5, (320, 240), Scout.camera, Stand(2.0, 2.0, 0.5))
            await wait_sent(floor, "scout1", "go_to", *seen)


async def test_by_keyboard_alone_a_robot_is_selected_the_cross_moved_and_the_robot_sent_there(floor: Floor) -> None:
    async with map_at(floor) as page:
        await page.locator("#map-bodies [data-body=scout2]").focus()
        await page.keyboard.press("Enter")
        await page.locator("#map-plan").focus()
        for key in ("ArrowRight", "ArrowRight", "ArrowUp", "Shift+ArrowDown"):
            await page.keyboard.press(key)
        assert "3.50, 2.23 m" in await page.locator("#map-told").text_content()
        await page.keyboard.press("Enter")
        await wait_sent(floor, "scout2", "go_to", 3.5, 2.23)
        assert await page.evaluate("() => document.activeElement.id") == "map-plan"


async def test_a_finger_selects_and_sends_on_a_phone(floor: Floor) -> None:
    async with map_at(floor, "phone") as page:
        finger = Finger(page)
        for x_m, y_m in ((3.0, 1.0), (1.5, 3.0)):
            await finger.put_down(*await point_at(page, x_m, y_m))
            await finger.lift()
            await page.wait_for_selector("#map-plan [data-body=scout3].is-selected")
        await wait_sent(floor, "scout3", "go_to", 1.5, 3.0)


@pytest.mark.parametrize("size", rest_thorough(reversed(ALL_SIZES)))
async def test_the_map_has_large_targets_reached_by_focus_and_axe_finds_nothing_serious(
    floor: Floor, size: str
) -> None:
    async with map_at(floor, size) as page:
        await page.locator("#map-bodies [data-body=scout1]").click()
        await tap(page, 4.0, 1.0)
        await page.wait_for_selector("#orders [data-order=scout1]")
        sides = await page.evaluate("""() => [...document.querySelectorAll("#map button, #map select, #orders button")]
          .flatMap((one) => { const box = one.getBoundingClientRect(); return [box.width, box.height]; })""")
        assert min(sides) >= 44
        ring_px = await page.locator("#map-plan [data-body=scout1] .ring").get_attribute("r")
        assert float(ring_px) >= 22
        await assert_no_sideways_scroll(page)
        assert await page.evaluate(COVERED) == []
        assert await serious_findings(page) == []
        await page.locator("#map").scroll_into_view_if_needed()
        await keep_picture(page, f"web-map-{size}")


async def test_the_picture_of_a_plan_lies_below_its_shapes(stage: Stage, beside: Any) -> None:
    red = np.zeros((400, 600, 3), np.uint8)
    red[:, :, 2] = 255
    image = cv2.imencode(".png", red)[1].tobytes()
    async with floor_on(stage, beside, replace(PLAN, image=image)) as floor, map_at(floor) as page:
        await page.wait_for_selector("#map-image:not([hidden])")
        await page.wait_for_function("() => document.querySelector('#map-image').width === 600")
        pixel = await page.evaluate(
            "() => [...document.querySelector('#map-image').getContext('2d').getImageData(300, 200, 1, 1).data]"
        )
        assert pixel[0] > 200
        assert pixel[1] < 60
        await page.locator("#map-plan").scroll_into_view_if_needed()
        same = await page.evaluate("""() => ["map-image", "map-plan"]
          .map((id) => document.getElementById(id).getBoundingClientRect().toJSON())""")
        assert same[0] == pytest.approx(same[1], abs=1)
        on_top = await page.evaluate("""() => { const box = document.querySelector("#map-plan").getBoundingClientRect();
          return document.elementFromPoint(box.x + 50, box.y + 50)?.id; }""")
        assert on_top == "map-plan", "taps are the map's"
