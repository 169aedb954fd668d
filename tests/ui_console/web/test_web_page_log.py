"""The page's log: searched by every field, by keyboard alone, on a phone too, and kept as a file."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from axe import serious_findings
from examples import rest_thorough
from web_browser import assert_no_sideways_scroll
from web_page import page_at
from web_stage import Stage

from backbone.component.messages import LogLevel, StoryEvent

pytestmark = [pytest.mark.processes, pytest.mark.timeout(120)]

MANY = 450


def events() -> list[StoryEvent]:
    moved = StoryEvent(5.0, "ui_console/c", "is driven by ben: left +4.0", "scout2", "", LogLevel.NOTICE, "ben")
    stopped = StoryEvent(6.0, "ui_console/c", "was stopped by anna", "scout1", "", LogLevel.ALARM, "anna")
    rest = [StoryEvent(10.0 + at, "backbone/placer", f"placed {at}", "world", "") for at in range(MANY)]
    return [moved, stopped, *rest]


async def rows(page: Any) -> list[str]:
    await page.locator("#log-status", has_text="found").wait_for()
    found: list[str] = await page.locator("#panel tbody tr").all_inner_texts()
    return found


async def test_by_keyboard_alone_the_log_is_searched_and_shown_whole_again(stage: Stage) -> None:
    stage.keep_log(events())
    async with page_at(stage) as page:
        keyboard = page.keyboard
        await page.locator("#tab-log").focus()
        await keyboard.press("Enter")
        await keyboard.press("Tab")
        await keyboard.type("driven")
        await keyboard.press("Tab")
        await keyboard.type("scout2")
        await keyboard.press("Tab")
        await keyboard.type("Ben")
        await keyboard.press("Tab")
        await keyboard.press("Tab")
        await keyboard.type("4.5")
        await keyboard.press("Enter")
        [row] = await rows(page)
        assert all(word in row for word in ("5.0 s", "notice", "scout2", "is driven by ben: left +4.0", "ben"))
        assert "1 event found" in await page.locator("#log-status").inner_text()
        for name in ("Until", "Search", "Show all"):
            await keyboard.press("Tab")
            focus = "() => document.activeElement.name || document.activeElement.textContent"
            assert (await page.evaluate(focus)).lower() == name.lower()
        await keyboard.press("Enter")
        await page.wait_for_function("() => document.getElementById('log-status').textContent === ''")
        assert await page.locator("#log-search [name=text]").input_value() == ""


async def test_a_wrong_moment_is_refused_in_the_form_and_what_was_found_stays(stage: Stage) -> None:
    stage.keep_log(events())
    async with page_at(stage) as page:
        await page.locator("#tab-log").click()
        await page.get_by_label("Level").select_option("alarm")
        await page.get_by_role("button", name="Search").click()
        assert len(await rows(page)) == 1
        await page.get_by_label("Since").fill("soon")
        await page.get_by_role("button", name="Search").click()
        await page.locator("#log-status", has_text="'soon' is no moment. Type 5m").wait_for()
        assert await page.locator("#panel tbody tr").count() == 1
        assert await page.get_by_label("Since").input_value() == "soon"


async def test_more_is_shown_at_a_touch_and_all_of_it_is_exported(stage: Stage, tmp_path: Path) -> None:
    stage.keep_log(events())
    async with page_at(stage, "tablet") as page:
        await page.locator("#tab-log").tap()
        await page.get_by_label("Words").fill("placed")
        await page.get_by_role("button", name="Search").tap()
        assert len(await rows(page)) == 100
        await page.get_by_role("button", name=f"Show more of {MANY}").tap()
        await page.wait_for_function("() => document.querySelectorAll('#panel tbody tr').length === 200")
        async with page.expect_download() as downloading:
            await page.get_by_role("button", name="Export").tap()
        download = await downloading.value
        assert download.suggested_filename.startswith("web-test-log-")
        await download.save_as(tmp_path / "log.jsonl")
        lines = [json.loads(line) for line in (tmp_path / "log.jsonl").read_text().splitlines()]
        assert [line["what"] for line in lines] == [f"placed {at}" for at in range(MANY)]
        assert {"at_s", "time", "level", "subject", "person", "where", "cause"} < set(lines[0])


@pytest.mark.parametrize(("size", "theme"), rest_thorough([("phone", "light"), ("tablet", "dark")]))
async def test_the_search_fits_a_small_screen_and_axe_finds_nothing_serious(
    stage: Stage, size: str, theme: str
) -> None:
    stage.keep_log(events())
    async with page_at(stage, size, theme=theme) as page:
        await page.locator("#tab-log").tap()
        await page.get_by_label("Level").select_option("notice")
        await page.get_by_role("button", name="Search").tap()
        assert len(await rows(page)) == 2
        narrow = await page.evaluate("""() => [...document.querySelectorAll("td, #log-search label")]
          .filter((one) => one.textContent.trim().length > 8 && one.checkVisibility())
          .map((one) => [one.textContent, one.clientWidth]).filter(([, width]) => width < 90)""")
        assert narrow == []
        await assert_no_sideways_scroll(page)
        assert await serious_findings(page) == []


async def test_what_was_found_stands_still_while_the_mission_goes_on(stage: Stage) -> None:
    stage.keep_log(events())
    async with page_at(stage) as page:
        await page.locator("#tab-log").click()
        await page.locator("#log-search").get_by_label("Robot").select_option("scout2")
        await page.get_by_role("button", name="Search").click()
        assert len(await rows(page)) == 1
        await page.evaluate("() => { window.row = document.querySelector('#panel tbody tr'); }")
        stage.hub.observer.publish_event("scout2", "did something else")
        await page.wait_for_timeout(1500)
        assert await page.evaluate("() => window.row.isConnected")
