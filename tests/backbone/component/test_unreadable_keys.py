"""What a component cannot read is told once for each key, and not without end."""

from __future__ import annotations

from component_stage import TOWER, Stage, live

from backbone.component.messages import LogLevel, StoryEvent
from backbone.component.unreadable_keys import MOST_LOGGED
from backbone.keys import Conversation
from backbone.wire import MalformedMessage


def test_a_key_that_cannot_be_read_is_told_once_and_garbage_on_many_keys_fills_no_log() -> None:
    async def law() -> None:
        stage, told = Stage(), list[StoryEvent]()
        stage.tower.subscribe("*/*", Conversation.LOG, StoryEvent, lambda heard: told.append(heard.body))
        life = await stage.begin()
        for number in (1, 1, *range(100)):
            garbage = MalformedMessage("Expected `float` <= 1.0")
            stage.walker.bus.on_unreadable(f"scout/m/{TOWER}/events/{number}", garbage)
        await stage.clock.sleep_s(0.1)
        unread = [one for one in told if one.what.startswith("cannot read")]
        assert len({one.what for one in unread}) == len(unread) == MOST_LOGGED
        assert {(one.subject, one.level) for one in unread} == {("walker", LogLevel.WARNING)}
        assert "Expected `float` <= 1.0" in unread[0].what
        stage.walker.end("enough")
        await life

    live(law())
