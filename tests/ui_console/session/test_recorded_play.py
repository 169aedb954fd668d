"""A recording is shown at once; a step leads to the next message that is shown, also from one to the next."""

from __future__ import annotations

import asyncio
import io
import threading

import pytest
from hypothesis import given
from hypothesis import strategies as st
from small_recordings import SCOUT, Said, recorded

from backbone.bus.clock import MissionClock, VirtualClock, run_virtual
from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.recording.markers import Marker, markers_in
from backbone.recording.reader import Recording
from backbone.recording.writer import NS
from ui_console.session.recorded_play import RecordedPlay


class Screen:
    """A console that shows nothing."""

    async def run(self) -> None:
        await asyncio.Event().wait()


def test_a_recording_is_shown_before_its_markers_are_read(monkeypatch: pytest.MonkeyPatch) -> None:
    """They took eight seconds in a recording of three million messages."""
    alarm = StoryEvent(2.0, SCOUT, "fell over", "scout1", "", LogLevel.ALARM)
    file = recorded([Said(2.0, SCOUT, Conversation.LOG, alarm)]).getvalue()
    read = threading.Event()

    def markers_once_read(recording: Recording) -> list[Marker]:
        assert read.wait(10.0)
        return markers_in(recording)

    monkeypatch.setattr("ui_console.session.recorded_play.markers_in", markers_once_read)

    async def show() -> None:
        machine = MissionClock.started_now()
        play = RecordedPlay(lambda: io.BytesIO(file), machine, "console-1", lambda *_about: Screen())
        life = asyncio.create_task(play.run())
        await play.wait_arrived()
        assert (play.markers, play.has_markers) == ([], False)
        read.set()
        async with asyncio.timeout(10.0):
            while not play.has_markers:
                await machine.sleep_s(0.01)
        assert [one.line for one in play.markers] == ["scout1: fell over"]
        play.end("the test is over")
        await life

    asyncio.run(show())


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
