"""``scout-console serve`` beside a running mission: driven by a program, and by a real browser at three sizes."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import re
import stat
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import asynccontextmanager
from functools import partial
from typing import Any

import pytest
import web_browser
from free_ports import free_port
from program_console import program, wait_until
from running_mission import MISSION_XML, mission_up
from served_page import Served, hold_until, serving
from web_browser import Cable, Finger, assert_no_sideways_scroll

from backbone.addresses import RC_MANAGER
from backbone.bus.interface import Bus
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from resource_pool.localization import AskPose, Pose

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

STOPPED_WITHIN_S = 3.0  # of which 0.3 s are the rule; the rest is a machine that also runs other tests
WORLD = "resource_pool/world"
LOCALIZER = '<resource type="localizer" name="localizer" process="hardware"/>'
SECOND_WATCHER = re.search(
    r'<behavior type="watch_for_motion" name="watch-scout2".*?</behavior>', MISSION_XML.read_text(), re.DOTALL
)


@pytest.fixture(scope="module")
def served() -> Iterator[Served]:
    assert SECOND_WATCHER is not None
    with (
        mission_up(name="iros2001", change={SECOND_WATCHER.group(): "", LOCALIZER: ""}) as mission,
        serving(mission) as made,
    ):
        yield made
        made.process.terminate()
        assert made.process.wait(20) == 0


async def pose(bus: Bus, robot: str = "scout1") -> Pose:
    return await bus.ask(WORLD, AskPose(robot), Pose, within_s=5.0)


def differs(one: Pose, other: Pose) -> bool:
    turned_rad = abs(math.remainder(one.heading_rad - other.heading_rad, math.tau))
    return math.hypot(one.x_m - other.x_m, one.y_m - other.y_m) > 0.005 or turned_rad > 0.03


def moved(bus: Bus, before: Pose) -> Callable[[], Awaitable[bool]]:
    """Return a question: has the robot moved since?"""

    async def has_moved() -> bool:
        return differs(before, await pose(bus))

    return has_moved


async def hold_key(page: Any, bus: Bus, before: Pose) -> None:
    """Hold the key D until the robot has moved, and further."""
    down, up = partial(page.keyboard.down, "d"), partial(page.keyboard.up, "d")
    await hold_until(page, down, up, moved(bus, before), "the pose changed")


async def wait_still(bus: Bus) -> None:
    """Return when the robot stands, which it must soon."""

    async def stands() -> bool:
        before = await pose(bus)
        await asyncio.sleep(0.5)
        after = await pose(bus)
        return math.hypot(after.x_m - before.x_m, after.y_m - before.y_m) < 0.001

    await wait_until(stands, "the wheels stopped", STOPPED_WITHIN_S)


async def test_a_program_drives_a_robot_and_when_it_vanishes_the_wheels_stop_and_the_behavior_goes_on(
    served: Served,
) -> None:
    async with served.mission.bus() as bus, program(served, "program") as one:
        await one.say(do="watch", robots=["scout1"])
        await one.wait(lambda: one.pictures, "the watcher's pictures, before any grant")
        await one.say(do="take", robot="scout1")
        await one.wait(lambda: one.is_held, "held")
        before, driving = await pose(bus), asyncio.create_task(one.drive())
        await wait_until(moved(bus, before), "the pose changed")
        one.socket.transport.abort()  # no goodbye
        await wait_still(bus)
        await wait_until(lambda: holds(bus, "watch-scout1"), "the behavior went on")
        await driving


async def test_where_no_localizer_is_the_map_has_the_places_of_the_simulator_and_says_so(served: Served) -> None:
    async with served.mission.bus() as bus, program(served, "mapper") as one:
        await one.wait(lambda: len(one.view.get("bodies", [])) == 3, "all robots on the map")
        shown = {body["name"]: body for body in one.view["bodies"]}
        truth = await pose(bus, "scout3")
        assert math.hypot(shown["scout3"]["x_m"] - truth.x_m, shown["scout3"]["y_m"] - truth.y_m) < 0.05
        assert {body["source"] for body in one.view["bodies"]} == {"from the simulator"}
        await one.wait(lambda: not any(body["is_stale"] for body in one.view["bodies"]), "fresh places of all robots")
        await one.wait(lambda: one.view["floor"] is not None, "a floor")


async def test_of_two_operators_the_higher_has_the_robot_and_the_other_is_told_who_and_why(served: Served) -> None:
    async with program(served, "anna", 100) as anna, program(served, "ben", 50) as ben:
        await ben.say(do="take", robot="scout1")
        await ben.wait(lambda: ben.is_held, "ben holds it")
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held, "anna holds it")
        await ben.wait(lambda: not ben.is_held, "ben lost it")
        await ben.wait(lambda: "anna" in ben.view["own"]["taken_because"], "ben is told by whom")
        assert "waiting for scout1" in ben.view["own"]["status"]
        await anna.say(do="release")
        await ben.wait(lambda: ben.is_held, "ben has it back")


@pytest.mark.thorough
async def test_two_equal_operators_have_the_robot_in_turns(served: Served) -> None:
    async with program(served, "carla", 70) as carla, program(served, "dora", 70) as dora:
        for one in (carla, dora):
            await one.say(do="take", robot="scout1")
        await carla.wait(lambda: carla.is_held and not dora.is_held, "carla's turn")
        await dora.wait(lambda: dora.is_held and not carla.is_held, "dora's turn")


async def holds(bus: Bus, behavior: str) -> bool:
    """Return whether this behavior has scout1."""
    schedule = await bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=5.0)
    return any(holder.arc.startswith(behavior) for rc in schedule.rcs if rc.rc == "scout1" for holder in rc.holders)


@asynccontextmanager
async def page_at(size: str, port: int, token: str, script: str = "") -> AsyncIterator[Any]:
    """Open the page in a browser of this size, with a script that is run before its own."""
    address = f"http://127.0.0.1:{port}/#token={token}"
    async with web_browser.page_at(size, address, shows=".robot[data-robot=scout1]", script=script) as page:
        yield page


async def keep_picture(page: Any, name: str) -> None:
    seen = page.locator("#alarm-bar").get_by_role("button", name="Seen")
    while os.environ.get("SCOUT_PICTURES") and await seen.is_visible():
        await seen.click()
        await page.wait_for_timeout(300)
    await web_browser.keep_picture(page, f"web-{name}")


async def shown(page: Any) -> str:
    """Return the picture of scout1 on the screen."""
    picture: str = await page.locator(".robot[data-robot=scout1] canvas").evaluate("canvas => canvas.toDataURL()")
    return picture


async def take(page: Any) -> None:
    await page.locator(".robot[data-robot=scout1]").get_by_role("button", name="Take over").click()
    await page.wait_for_selector("body[data-held=scout1]")


async def test_at_a_desk_a_person_watches_drives_by_keys_and_releases(served: Served) -> None:
    async with served.mission.bus() as bus, page_at("desktop", served.port, served.token) as page:
        await page.wait_for_selector(".robot[data-robot=scout1]:not(.is-stale)")
        await take(page)
        first, before = await shown(page), await pose(bus)
        await hold_key(page, bus, before)

        async def changed() -> bool:
            return await shown(page) != first

        await wait_until(changed, "the picture changed")
        await page.locator("#tab-timeline").click()
        await page.wait_for_selector("svg.timeline")
        await page.wait_for_selector(".robot[data-robot=scout1] .age:has-text('ms')")
        await page.evaluate("scrollTo(0, 0)")
        await keep_picture(page, "desktop")
        await page.keyboard.up("d")
        await wait_still(bus)
        await assert_no_sideways_scroll(page)
        await page.locator("#release").click()
        await page.wait_for_selector("body[data-held='']")
        await wait_until(lambda: holds(bus, "watch-scout1"), "the behavior went on")


@pytest.mark.thorough
async def test_on_a_tablet_a_finger_on_the_pad_drives_and_a_lifted_one_stops(served: Served) -> None:
    async with served.mission.bus() as bus, page_at("tablet", served.port, served.token) as page:
        await take(page)
        before = await pose(bus)
        finger = Finger(page)
        await hold_until(page, finger.push_right, finger.lift, moved(bus, before), "the pose changed")
        await keep_picture(page, "tablet")
        await finger.lift()
        await page.wait_for_selector("#pad:not(.is-held)")
        await wait_still(bus)
        await assert_no_sideways_scroll(page)
        await page.locator("#release").click()
        await page.wait_for_selector("body[data-held='']")


@pytest.mark.thorough
async def test_on_a_phone_that_loses_its_network_the_wheels_stop_and_the_behavior_goes_on(served: Served) -> None:
    async with (
        served.mission.bus() as bus,
        Cable(served.port).plugged_in() as cable,
        page_at("phone", cable.port, served.token) as page,
    ):
        await take(page)
        await assert_no_sideways_scroll(page)
        before = await pose(bus)
        await page.wait_for_selector(".robot[data-robot=scout1]:not(.is-stale)")
        finger = Finger(page)
        await hold_until(page, finger.push_right, finger.lift, moved(bus, before), "the pose changed")
        await page.evaluate("() => scrollTo(0, 0)")
        await keep_picture(page, "phone")
        cable.is_cut = True  # the finger stays where it is
        await wait_still(bus)
        await page.wait_for_selector("#link.is-down")
        await wait_until(lambda: holds(bus, "watch-scout1"), "the behavior went on")
        cable.is_cut = False
        await page.wait_for_selector("#link:not(.is-down)")
        await page.wait_for_selector("body[data-held='']")


GAMEPAD = """
window.shoulder = false;
const buttons = () => [0, 1, 2, 3, 4, 5].map((n) => ({ pressed: n === 5 && window.shoulder }));
const pad = () => ({ connected: true, axes: [1, 0, 0, 0], buttons: buttons() });
Object.defineProperty(navigator, "getGamepads", { value: () => [pad()] });
"""

SHOULDER = """(isHeld) => {
  window.shoulder = isHeld;
  return new Promise((seen) => requestAnimationFrame(() => requestAnimationFrame(() => seen())));
}"""
"""The page looks at the gamepad before each of its frames."""


@pytest.mark.thorough
async def test_by_one_touch_a_page_asks_an_equal_for_the_robot_and_lets_an_equal_have_it(served: Served) -> None:
    async with program(served, "erna") as erna, page_at("phone", served.port, served.token) as page:
        await erna.say(do="take", robot="scout1")
        await erna.wait(lambda: erna.is_held, "erna holds it")
        await page.locator(".robot[data-robot=scout1]").get_by_role("button", name="Take over").tap()
        await page.locator("#may-i:enabled").tap()
        await erna.wait(lambda: erna.view["own"]["consent"], "erna is asked")
        assert erna.view["own"]["consent"]["user"] == "phone"
        await erna.say(do="decide", is_given=True, number=erna.view["own"]["consent"]["number"])
        await page.wait_for_selector("body[data-held=scout1]")

        await erna.say(do="take", robot="scout1")
        await erna.wait(lambda: erna.view["own"]["is_asked"], "erna waits")
        await erna.say(do="may_i", why="mine is stuck")
        await page.wait_for_selector("#consent-line:has-text('erna asks for scout1: mine is stuck')")
        await assert_no_sideways_scroll(page)
        await page.locator("#consent-yes").tap()
        await erna.wait(lambda: erna.is_held, "erna has it")
        await page.locator("#consent").wait_for(state="hidden")
        await erna.say(do="release")


@pytest.mark.thorough
async def test_a_gamepad_drives_only_while_its_shoulder_button_is_held(served: Served) -> None:
    async with served.mission.bus() as bus, page_at("desktop", served.port, served.token, script=GAMEPAD) as page:
        await take(page)
        await page.evaluate("() => { dispatchEvent(new Event('gamepadconnected')); }")
        before = await pose(bus)
        await asyncio.sleep(1.0)
        assert not differs(before, await pose(bus)), "the stick alone does nothing"
        hold, let_go = (partial(page.evaluate, SHOULDER, is_held) for is_held in (True, False))
        await hold_until(page, hold, let_go, moved(bus, before), "the pose changed")
        await let_go()
        await wait_still(bus)


@pytest.mark.thorough
async def test_an_emergency_stop_holds_against_the_hands_until_it_is_lifted(served: Served) -> None:
    async with served.mission.bus() as bus, page_at("desktop", served.port, served.token) as page:
        card = page.locator(".robot[data-robot=scout1]")
        await take(page)
        for _ in range(3):
            await card.locator("button.emergency").click()
        await page.wait_for_selector(".robot[data-robot=scout1].is-stopped")
        before = await pose(bus)
        await page.keyboard.down("d")
        await asyncio.sleep(1.0)
        assert not differs(before, await pose(bus))
        await card.locator(".lift").hover()
        await page.mouse.down()
        await page.wait_for_selector(".robot[data-robot=scout1]:not(.is-stopped)")
        await page.mouse.up()
        await asyncio.sleep(1.0)
        assert not differs(before, await pose(bus)), "the key that is still down was pressed before"
        await page.keyboard.up("d")
        await hold_key(page, bus, before)
        await page.keyboard.up("d")


async def test_a_stranger_is_asked_for_the_token_and_told_that_it_is_wrong(served: Served) -> None:
    async with page_at("desktop", served.port, served.token) as page:
        other = await page.context.new_page()
        await other.goto(f"http://127.0.0.1:{served.port}/#token=wrong")
        await other.wait_for_selector("#login:not([hidden])")
        assert "wrong token" in await other.locator("#login-why").inner_text()
        await page.wait_for_selector("#panel:has-text('wrong token')")
        await other.locator("#login-token").fill(served.token)
        await other.locator("#login button").click()
        await other.wait_for_selector(".robot[data-robot=scout1]")


@pytest.mark.thorough
async def test_when_the_server_was_killed_and_is_started_again_open_pages_come_back_by_themselves(
    served: Served,
) -> None:
    port = free_port()
    async with contextlib.AsyncExitStack() as open_page:
        with serving(served.mission, port) as first:
            kept = served.mission.directory / f"web-{port}.json"
            assert stat.S_IMODE(kept.stat().st_mode) == 0o600
            page = await open_page.enter_async_context(page_at("tablet", port, first.token))
            await take(page)
        await page.get_by_text("THIS PAGE CANNOT STOP A ROBOT").wait_for()
        with serving(served.mission, port) as second:
            assert second.token == first.token
            await page.wait_for_selector("body:not(.is-blind)")
            await page.get_by_role("button", name="Take scout1 again").tap()
            await page.wait_for_selector("body[data-held=scout1]")
            await page.context.close()
