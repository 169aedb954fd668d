"""In a recording, a step leads to the next message that is shown, also from one to the next."""

from __future__ import annotations

import asyncio
import io

from hypothesis import given
from hypothesis import strategies as st
from small_recordings import SCOUT, Said, recorded

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.recording.writer import NS
from ui_console.session.recorded_play import RecordedPlay


class Screen:
    """A console that shows nothing."""

    async def run(self) -> None:
        await asyncio.Event().wait()


@given(times=st.lists(st.integers(0, 100 * NS), min_size=1, max_size=6, unique=True))
def test_each_step_leads_to_the_next_message_and_the_last_to_the_end(times: list[int]) -> None:
    ordered = [each / NS for each in sorted(times)]
    events = [StoryEvent(at_s, SCOUT, "is seen", "scout1", "", LogLevel.INFO) for at_s in ordered]
    file = recorded(Said(event.at_s, SCOUT, Conversation.LOG, event) for event in events).getvalue()

    async def step() -> list[float]:
        play = RecordedPlay(lambda: io.BytesIO(file), VirtualClock(), "console-1", lambda *_about: Screen())
        seen = []
        for _message in ordered:
            seen.append(play.playback.now_s())
            play.step()
        assert play.playback.now_s() == play.playback.end_s
        return seen

    assert run_virtual(step()) == ordered
