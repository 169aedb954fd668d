"""Several missions of one server: each has its own page, tokens and robots, and none reaches another's."""

from __future__ import annotations

import asyncio
import urllib.error
import urllib.request
from typing import Any

import pytest
from axe import serious_findings
from typer.testing import CliRunner
from web_browser import assert_no_sideways_scroll
from web_page import page_at, stop_button, take, wait_stopped, wait_until
from web_stage import ANYBODY, HIGH, WITHIN_S, Stage
from websockets.exceptions import ConnectionClosed, InvalidStatus

from ui_console.cli import app

NIGHTLY = f"{HIGH}-night"
SAME = ("scout1", "scout2")


def place_same_robots(stages: list[Stage]) -> None:
    for one in stages:
        one.place_robots(*SAME)
        one.grant_all()


async def test_a_stop_on_one_page_stops_no_robot_of_the_same_name_elsewhere(stages: list[Stage]) -> None:
    day, night = stages
    place_same_robots(stages)
    async with day.browser() as anna, night.browser(NIGHTLY) as ben:
        assert anna.view["welcome"]["mission"] == "day"
        assert ben.view["welcome"]["mission"] == "night"
        assert anna.view["welcome"]["missions"] == ben.view["welcome"]["missions"] == ["day", "night"]
        for one in (anna, ben):
            await one.wait(lambda one=one: one.view["robots"], "robots")
        await anna.say(do="stop_robot", robot="scout1")
        await day.placer.wait(lambda: day.robots["scout1"].is_stopped)
        await anna.say(do="stop_all")
        await day.placer.wait(lambda: day.robots["scout2"].is_stopped)
        await ben.say(do="take", robot="scout1")
        await ben.wait(lambda: ben.is_held, "held in the other mission")
        assert [robot.orders for robot in night.robots.values()] == [0, 0]


@pytest.mark.parametrize(("at", "token"), [(0, NIGHTLY), (1, HIGH)])
async def test_a_token_opens_the_page_of_its_own_mission_only(stages: list[Stage], at: int, token: str) -> None:
    async with stages[at].connection() as connection:
        await connection.send('{"do": "hello", "token": "%s"}' % token)  # noqa: UP031
        with pytest.raises(ConnectionClosed, match="wrong token"):
            async with asyncio.timeout(WITHIN_S):
                await connection.recv()


async def test_no_path_but_those_of_the_missions_leads_anywhere(stages: list[Stage]) -> None:
    def status(path: str) -> int:
        try:
            with urllib.request.urlopen(f"http://127.0.0.1:{stages[0].port}{path}", timeout=WITHIN_S) as answer:
                return int(answer.status)
        except urllib.error.HTTPError as error:
            return error.code

    for path in ("/m/day/", "/m/night/", "/m/night/main.js"):
        assert await asyncio.to_thread(status, path) == 200
    for path in ("/", "/main.js", "/m/day", "/m/noon/", "/m/day/../night/", "/m/day/m/night/", "/m/"):
        assert await asyncio.to_thread(status, path) == 404
    day, night = stages
    for path in ("/", "/m/", "/m/noon/", "/m/day"):
        day.path = path
        with pytest.raises(InvalidStatus):
            await day.connection()
    assert not night.hub.clients


async def test_when_one_mission_is_over_the_other_goes_on(stages: list[Stage]) -> None:
    day, night = stages
    place_same_robots(stages)
    async with night.browser(NIGHTLY) as ben:
        async with day.browser() as anna:
            day.hub.observer.end("the mission is over")
            await day.placer.wait(lambda: not day.hub.clients)
            await anna.socket.wait_closed()
            assert "not served any more" in (anna.socket.close_reason or "")
        with pytest.raises(InvalidStatus):
            await day.connection()
        await ben.say(do="take", robot="scout1")
        await ben.wait(lambda: ben.is_held, "held")


@pytest.mark.parametrize(
    "words", [["--mission", "a", "--mission", "a"], ["--mission", "a", "--mission", "b", "--connect", "tcp/x:1"]]
)
def test_missions_that_cannot_be_served_together_are_refused(words: list[str]) -> None:
    assert CliRunner().invoke(app, ["serve", *words]).exit_code == 2


@pytest.mark.thorough
@pytest.mark.processes
@pytest.mark.timeout(120)
@pytest.mark.parametrize(("size", "theme"), [("desktop", "light"), ("phone", "dark")])
async def test_red_buttons_say_whose_robots_they_stop_and_a_tab_remembers_each_mission_apart(
    stages: list[Stage], size: str, theme: str
) -> None:
    day, night = stages
    place_same_robots(stages)
    async with page_at(day, size, theme=theme) as page:
        assert await shown_by(page, "#stop-all") == '" · day"'
        assert await stop_button(page).get_attribute("aria-label") == "Stop scout1 of day"
        await take(page)
        await assert_no_sideways_scroll(page)
        assert await serious_findings(page) == []
        await page.get_by_role("link", name="night").click()
        await page.wait_for_selector("#login:not([hidden])")
        await wait_until(lambda: not day.hub.clients, "the robot is given back")
        await page.goto(f"{night.address}-night&user=anna")
        await page.wait_for_selector(".robot[data-robot=scout1]")
        assert await page.locator("#lost").is_hidden(), "the robot held in the other mission is not this one's"
        await stop_button(page).click()
        await wait_stopped(page)
        assert [robot.orders for robot in day.robots.values()] == [0] * len(day.robots)
        await page.get_by_role("link", name="day").click()
        await page.wait_for_selector("#console:not([hidden])")
        assert await page.locator("#mission").inner_text() == f"day · {size}, priority 10"


async def shown_by(page: Any, button: str) -> str:
    """Return the text that the style adds to a button."""
    text: str = await page.locator(button).evaluate("one => getComputedStyle(one, '::after').content")
    return text


async def test_the_page_of_a_mission_that_is_alone_says_no_name_on_its_buttons(stage: Stage) -> None:
    async with stage.browser(ANYBODY) as anna:
        assert anna.view["welcome"]["missions"] == [anna.view["welcome"]["mission"]]
        assert stage.address.startswith(f"http://127.0.0.1:{stage.port}/#")
