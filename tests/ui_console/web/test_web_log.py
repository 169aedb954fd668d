"""A page searches the log of the whole mission, and gets it in parts that hold up nothing."""

from __future__ import annotations

import json
from datetime import datetime
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from web_stage import Browser, Stage

from backbone.component.messages import LogLevel, StoryEvent
from backbone.mission_log.log import EVENTS_KEPT, MOST_EVENTS, Log
from backbone.mission_log.question import WrongSearch
from backbone.moments import NoMoment, Now
from ui_console.session import feed
from ui_console.session.feed import LogAway
from ui_console.web.found_log import PART_BYTES, PART_EVENTS, FoundLog

NOW = Now(1000.0, datetime(2026, 5, 4, 14, 10))


def event(at_s: float, what: str = "said so", subject: str = "scout1") -> StoryEvent:
    return StoryEvent(at_s, "ui_console/c", what, subject, "", LogLevel.NOTICE, "anna")


async def fetched(browser: Browser, number: int, **asked: str) -> list[dict[str, Any]]:
    """Search as the page does and return all that was found, the newest first."""
    events: list[dict[str, Any]] = []
    await browser.say(do="search_log", number=number, **asked)
    while True:
        await browser.wait(lambda: browser.answers, "an answer")
        part = browser.answers.pop(0)["log"]
        assert (part["number"], part["first"]) == (number, len(events))
        assert len(json.dumps(part)) < PART_BYTES + 8192, "one event more at most"
        events += part["events"]
        if len(events) >= part["total"]:
            return events
        await browser.say(do="more_log", number=number, first=len(events))


@given(st.lists(st.text(st.characters(codec="utf-8"), max_size=3000), max_size=250))
def test_parts_are_small_and_together_they_are_all_that_was_found(whats: list[str]) -> None:
    found = FoundLog(7, Log([event(float(at_s), what) for at_s, what in enumerate(whats)], 3, 0.5), NOW)
    seen: list[Any] = []
    while len(seen) < len(whats):
        part = found.part(len(seen))
        assert 0 < len(part["events"]) <= PART_EVENTS
        assert sum(map(len, part["events"][:-1])) <= PART_BYTES
        seen += [json.loads(bytes(one)) for one in part["events"]]
    assert [one["what"] for one in reversed(seen)] == whats
    assert found.part(len(whats) + 5)["events"] == []


async def test_a_page_finds_what_happened_before_it_came_and_asks_by_every_field(stage: Stage) -> None:
    stage.keep_log([event(1.0, "was stopped"), event(2.0, "moves", "scout2"), event(3.0, "was freed")])
    async with stage.browser() as anna:
        assert [one["at_s"] for one in await fetched(anna, 1)] == [3.0, 2.0, 1.0]
        found = await fetched(
            anna, 2, text="WAS", robot="scout1", person="Anna", level="notice", since="1.5", until="9"
        )
        assert [(one["at_s"], one["what"], one["person"]) for one in found] == [(3.0, "was freed", "anna")]
        assert set(found[0]) == {"at_s", "level", "subject", "what", "person", "where", "cause", "time"}
        assert await fetched(anna, 3, text="nothing of that kind") == []


async def test_of_twenty_thousand_events_a_page_gets_ten_thousand_and_reads_how_many_are_left_out(stage: Stage) -> None:
    stage.keep_log(event(float(number)) for number in range(EVENTS_KEPT))
    async with stage.browser() as anna:
        await anna.say(do="search_log", number=1)
        await anna.wait(lambda: anna.answers, "an answer")
        first = anna.answers.pop()["log"]
        assert (first["total"], first["left_out"]) == (MOST_EVENTS, EVENTS_KEPT - MOST_EVENTS)
        assert len(await fetched(anna, 2)) == MOST_EVENTS


@pytest.mark.parametrize(
    ("asked", "code"),
    [
        ({"level": "loud"}, WrongSearch.code),
        ({"since": "soon"}, NoMoment.code),
        ({"since": "9", "until": "1"}, WrongSearch.code),
    ],
)
async def test_a_wrong_search_is_refused_with_its_remedy(stage: Stage, asked: dict[str, str], code: str) -> None:
    stage.keep_log([])
    async with stage.browser() as anna:
        await anna.say(do="search_log", number=4, **asked)
        await anna.wait(lambda: anna.answers, "an answer")
        answer = anna.answers.pop()["log"]
        assert (answer["number"], answer["code"]) == (4, code)
        assert answer["refused"]
        assert answer["remedy"]


@pytest.mark.parametrize("text", ["(a+)+$", "\\", "\u202e", "%s{}", "<b>", "🤖" * 100, "\x00"], ids=range(7))
async def test_a_hostile_text_is_searched_as_it_stands(stage: Stage, text: str) -> None:
    stage.keep_log([event(1.0, "a" * 500), event(2.0, f"it said {text}")])
    async with stage.browser() as anna:
        assert {one["at_s"] for one in await fetched(anna, 1, text=text)} <= {2.0}
        assert {one["at_s"] for one in await fetched(anna, 2, robot=text[:60], person=text[:60])} <= {2.0}


async def test_a_launcher_that_is_away_is_named_and_nothing_else_waits(
    stage: Stage, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(feed, "LOG_WITHIN_S", 0.2)
    async with stage.browser() as anna:
        await anna.say(do="search_log", number=1)
        await anna.say(do="more_log", number=1, first=0)
        await anna.wait(lambda: anna.answers, "an answer")
        answer = anna.answers.pop()["log"]
        assert answer["code"] == LogAway.code
        assert "launcher" in answer["refused"]
        assert not anna.has_alarm("launcher"), "who searched reads it in the form"
