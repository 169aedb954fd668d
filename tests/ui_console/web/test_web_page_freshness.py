"""What a page says of itself when it is cut off: across the screen, within a second, and what else stops robots."""

from __future__ import annotations

import asyncio
import os
import signal
import time
from itertools import pairwise
from typing import Any

import pytest
from web_browser import Cable
from web_page import Key, Wheels, card, page_at, take
from web_stage import ANYBODY, Stage

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

SAID_WITHIN_S = 1.0
TOLERANCE_S = 0.2  # of a machine that also runs other tests; the page's own rule is judged without a clock below
LOOKS_EACH_S = 0.1  # as link.js has it: a page that does not run for longer cannot look meanwhile

WATCH_BANNER = """
window.said = null;
window.ran = [];
addEventListener("DOMContentLoaded", () => setInterval(() => {
  window.ran.push(Date.now() / 1000);
  const isShown = !document.getElementById("blind").hidden;
  if (isShown && window.said === null) window.said = window.ran.at(-1);
  if (!isShown) window.said = null;
}, 20));
"""


async def said_after_s(page: Any, since_s: float) -> float:
    """Return the seconds until the banner was shown, without those in which the machine did not let the page run."""
    said_s, ran_s = await page.evaluate("() => [window.said, window.ran]")
    times_s = [since_s, *(at_s for at_s in ran_s if since_s < at_s <= said_s)]
    return float(sum(min(later - earlier, LOOKS_EACH_S) for earlier, later in pairwise(times_s)))


async def test_the_age_of_what_is_shown_counts_from_the_newest_beat_that_came_back(stage: Stage) -> None:
    """The pure part: beats may come back late, out of order or never; no content counts as younger than it is."""
    async with page_at(stage) as page:
        ages = await page.evaluate("""async () => {
          const { Freshness, makeClock } = await import("./freshness.js");
          const one = new Freshness();
          one.begin(1000);
          const ages = [one.age(1200)];
          const [first, second, third] = [one.beat(1250), one.beat(1500), one.beat(1750)];
          one.returned(second); ages.push(one.age(1800));
          one.returned(first); ages.push(one.age(1800));
          one.returned(99); ages.push(one.age(1900));
          one.returned(third); ages.push(one.age(9000));
          let [steady, wall] = [0, 5000];
          const clock = makeClock(() => steady, () => wall);
          wall += 60000; ages.push(clock());               // the device slept
          steady += 100; wall -= 3600000; ages.push(clock()); // the clock was set back
          return ages;
        }""")
        assert ages == [200, 300, 300, 400, 7250, 60000, 60100]


async def test_a_page_whose_device_was_busy_for_seconds_keeps_its_robot(stage: Stage) -> None:
    async with page_at(stage) as page:
        await take(page)
        await page.evaluate("() => { for (const until = Date.now() + 3000; Date.now() < until; ); }")
        said = [await page.locator("#link").text_content()]
        while said[-1] != "connected" or len(said) < 20:  # the beat after it has returned
            said.append(await page.locator("#link").text_content())
            await asyncio.sleep(0.05)
        assert await page.locator("body").get_attribute("data-held") == "scout1", said
        assert [arc.released for arc in stage.placer.arcs.values()] == [""]


@pytest.mark.thorough
@pytest.mark.parametrize("way", ["up", "down", "both"])
async def test_a_page_that_is_cut_off_says_within_a_second_that_it_cannot_stop_a_robot(stage: Stage, way: str) -> None:
    async with (
        Cable(stage.port).plugged_in() as cable,
        page_at(stage, address=f"http://127.0.0.1:{cable.port}/#token={ANYBODY}", script=WATCH_BANNER) as page,
    ):
        await take(page)
        await page.wait_for_function("() => document.getElementById('link').textContent === 'connected'")
        cable.is_cut_up, cable.is_cut_down = way in ("up", "both"), way in ("down", "both")
        cut_s = time.time()
        await page.wait_for_selector("body.is-blind")
        await page.wait_for_function("() => window.said")  # the banner's observer runs a moment after
        assert await said_after_s(page, cut_s) < SAID_WITHIN_S + TOLERANCE_S
        await page.get_by_text("THIS PAGE CANNOT STOP A ROBOT").wait_for()
        for button in await page.locator("button.emergency").all():
            assert await button.is_disabled()
        assert await page.locator("body").get_attribute("data-held") == "", "it may be somebody else's by now"
        banner = await page.locator("#blind").inner_text()
        assert all(words in banner for words in ("another page", "scout-console monitor", "switch on the robot"))
        box, width = await page.locator("#blind").bounding_box(), page.viewport_size["width"]
        assert box["width"] > 0.95 * width, "across the screen"
        await page.keyboard.press("x")
        await page.locator("#unsure").get_by_text("NOT SENT").wait_for()
        cable.is_cut = False
        await page.wait_for_selector("body:not(.is-blind)")
        assert await card(page).locator("button.emergency").is_enabled()


async def test_a_server_that_does_not_hear_the_mission_has_its_pages_say_so(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with page_at(stage) as page:
        await take(page)
        silent_s = stage.clock.now_s()
        monkeypatch.setattr(stage.hub.team.links, "down_s", lambda _now_s: silent_s)
        await page.get_by_text("A STOP PRESSED HERE MAY NOT ARRIVE").wait_for()
        assert "has received nothing from the mission" in await page.locator("#blind-why").inner_text()
        assert await card(page).locator("button.emergency").is_enabled(), "it may arrive all the same"
        monkeypatch.undo()
        await page.wait_for_selector("body:not(.is-blind)")


@pytest.mark.slow  # the browser takes a minute to put a page to sleep
async def test_a_page_that_slept_drives_nothing_when_it_wakes_and_offers_the_lost_robot_with_one_touch(
    stage: Stage,
) -> None:
    async with page_at(stage) as page:
        await take(page, "scout2")
        wheels, key = Wheels(stage, "scout2"), Key(page)
        await key.hold()
        await wheels.wait_turning()
        asleep = await renderers(page)
        signal_all(asleep, signal.SIGSTOP)
        try:
            await wheels.wait_halted()
            await stage.placer.wait(lambda: not stage.hub.clients)
        finally:
            signal_all(asleep, signal.SIGCONT)
        await page.wait_for_selector("#lost:not([hidden])")
        line = await page.locator("#lost-line").inner_text()
        assert line.startswith("You lost scout2")
        assert "s ago" in line
        await wheels.assert_still("the key is held from before")
        await page.reload()
        await page.wait_for_selector("#lost:not([hidden])")
        await page.locator("#retake").click()
        await page.wait_for_selector("body[data-held=scout2]")
        assert await page.locator("#lost").is_hidden()


@pytest.mark.thorough
async def test_a_page_that_comes_back_has_its_robot_again_at_once(stage: Stage) -> None:
    """The server need not find out first that the connection before is dead."""
    async with Cable(stage.port).plugged_in() as cable:
        address = f"http://127.0.0.1:{cable.port}/#token={ANYBODY}"
        async with page_at(stage, address=address) as page:
            await take(page)
            cable.is_cut = True
            await page.get_by_text("THIS PAGE CANNOT STOP A ROBOT").wait_for()
            assert len(stage.hub.clients) == 1
            cable.is_cut = False
            await page.locator("#retake").click()
            await page.wait_for_selector("body[data-held=scout1]")
            assert len(stage.hub.clients) == 1, "one page is one client"


@pytest.mark.thorough
async def test_a_robot_that_was_lost_can_be_left(stage: Stage) -> None:
    async with Cable(stage.port).plugged_in() as cable:
        address = f"http://127.0.0.1:{cable.port}/#token={ANYBODY}"
        async with page_at(stage, address=address) as page:
            await take(page)
            cable.is_cut = True
            await page.get_by_text("THIS PAGE CANNOT STOP A ROBOT").wait_for()
            cable.is_cut = False
            await page.locator("#dismiss").click()
            await page.wait_for_selector("#lost", state="hidden")
            await page.reload()
            await page.wait_for_selector(".robot")
            await asyncio.sleep(0.5)
            assert await page.locator("#lost").is_hidden()


async def renderers(page: Any) -> list[int]:
    """Return the processes that run the browser's pages."""
    browser = await page.context.browser.new_browser_cdp_session()
    found = await browser.send("SystemInfo.getProcessInfo")
    return [one["id"] for one in found["processInfo"] if one["type"] == "renderer"]


def signal_all(pids: list[int], number: signal.Signals) -> None:
    for pid in pids:
        os.kill(pid, number)
