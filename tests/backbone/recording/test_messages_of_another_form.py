"""A message of another form than its class has in this release costs itself alone, and is counted."""

from __future__ import annotations

import io
from pathlib import Path

import msgspec
import pytest
from small_recordings import CLASSES, MISSION, SCOUT, Said, recorded

from backbone.addresses import RC_MANAGER
from backbone.command_line.recording_work import print_events
from backbone.component.messages import ComponentState, LifeState, LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.launcher.endings import ExitCode
from backbone.rc_manager.messages import ScheduleSnapshot
from backbone.recording.markers import markers_in
from backbone.recording.presence import Presence
from backbone.recording.reader import Recording
from backbone.recording.reasons import reasons_at
from backbone.recording.restoring import mission_at
from backbone.recording.revival import message_as_sent
from backbone.recording.writer import RecordingWriter
from backbone.wire import WIRE_VERSION, Envelope, write


def event(at_s: float, what: str) -> Said:
    return Said(at_s, SCOUT, Conversation.LOG, StoryEvent(at_s, SCOUT, what, "scout1", "", LogLevel.ALARM))


STATE = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, "drives")
READABLE = [
    Said(0.5, SCOUT, Conversation.ALIVE, Presence(True), ""),
    event(1.0, "begins"),
    Said(2.0, SCOUT, Conversation.STATUS, STATE),
    Said(2.6, RC_MANAGER, Conversation.ASK, ScheduleSnapshot(4, 2.6, b"of another release"), RC_MANAGER),
    event(3.0, "goes on"),
]
OTHER = [
    (1.5, Conversation.LOG, ["StoryEvent/1", ["of another release"]]),
    (1.6, Conversation.LOG, ["StoryEvent/9", 1.6]),
    (2.1, Conversation.STATUS, ["ComponentState/1", "of an earlier release"]),
]


def night() -> io.BytesIO:
    file, readable = io.BytesIO(), Recording(recorded(READABLE))
    writer = RecordingWriter(file, CLASSES, {"mission": MISSION})
    for message in readable.messages():
        said = message_as_sent(CLASSES, message)
        assert said is not None
        raw = write(Envelope(WIRE_VERSION, message.source, message.sequence, message.at_s, "", said))
        writer.write(message.key, raw, message.at_s)
    for at_s, conversation, body in OTHER:
        raw = msgspec.msgpack.encode([WIRE_VERSION, SCOUT, 9, at_s, "", body])
        writer.write(key_of(MISSION, SCOUT, conversation), raw, at_s)
    writer.finish()
    return file


async def test_the_story_goes_on_without_it(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "night.mcap"
    path.write_bytes(night().getvalue())
    assert await print_events(path, "", 0.0, None, as_json=False) is ExitCode.DONE
    printed = capsys.readouterr()
    assert [line.rpartition(": ")[2] for line in printed.out.splitlines()] == ["begins", "goes on"]
    assert printed.err == "incomplete: 2 messages of another form cannot be read\n"


def test_the_reasons_are_told_without_it() -> None:
    lines = reasons_at(Recording(night()), "scout1", 3.0).lines(3.0)
    assert lines == ["incomplete: 2 messages of another form cannot be read", "scout1 is ready on base: drives"]


def test_the_line_of_a_page_and_the_playing_go_on_without_it() -> None:
    recording = Recording(night())
    assert [marker.line for marker in markers_in(recording)] == ["scout1: begins", "scout1: goes on"]
    mission = mission_at(recording, CLASSES, 3.0)
    assert list(mission.present) == [SCOUT]
