"""The types that the page's JavaScript is checked by are those of the messages that are sent."""

from __future__ import annotations

from made_files.page_types import CONSOLE, MissionView
from msgspec import inspect
from sent_types import fits, odd
from web_stage import Stage

from backbone.component.messages import StoryEvent


async def test_what_a_server_sends_has_the_types_that_the_page_is_checked_by(stage: Stage) -> None:
    stage.keep_log([StoryEvent(1.0, "ui_console/c", "was stopped", "scout1", "")])
    stage.place_robots("scout1", "scout2")
    stage.grant_all()
    async with stage.browser() as anna:
        await anna.say(do="take", robot="scout1")
        await anna.wait(lambda: anna.is_held and "log" in anna.view, "held")
        await anna.say(do="stop_robot", robot="scout2")
        await anna.wait(lambda: any(robot["stop"] for robot in anna.view["robots"]), "stopped")
        await anna.say(do="beat", number=1)
        await anna.wait(lambda: "beat" in anna.view, "beat")
        assert odd(anna.view, inspect.type_info(MissionView)) == []
        await anna.say(do="search_log", number=1)
        await anna.say(do="search_log", number=2, level="loud")
        for intent in ({"do": "why", "name": "scout1"}, {"do": "parameters", "name": "scout1"}):
            await anna.say(**intent)
        await anna.say(do="set", name="scout1", parameter="speed", value=1)
        await anna.wait(lambda: len(anna.answers) == 5, "answers")
        for answer in anna.answers:
            assert len(fits(answer, CONSOLE.answers)) == 1, answer
