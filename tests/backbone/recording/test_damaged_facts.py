"""Damage in the facts about a mission, or in its mission file, costs no message."""

from __future__ import annotations

import io

import pytest
from small_recordings import CLASSES, MISSION, SCOUT

from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.recording.reader import Recording
from backbone.recording.recovering import recover
from backbone.recording.writer import RecordingWriter
from backbone.wire import WIRE_VERSION, Envelope, write

XML = "<mission/>"


def recorded(*, is_whole: bool) -> bytes:
    """Return a recording of two messages in two chunks; if it is not whole, its recorder was killed."""
    file = io.BytesIO()
    writer = RecordingWriter(file, CLASSES, {"mission": MISSION}, mission_xml=XML)
    for number in range(2):
        event = StoryEvent(float(number), SCOUT, "it moves", "scout1", "")
        raw = write(Envelope(WIRE_VERSION, SCOUT, number, float(number), "", event))
        writer.write(key_of(MISSION, SCOUT, Conversation.LOG), raw, float(number))
        writer.flush()
    if is_whole:
        writer.finish()
    return file.getvalue()


@pytest.mark.parametrize("is_whole", [True, False])
@pytest.mark.parametrize(("of", "before"), [(MISSION.encode(), 4), (b"mission.xml", 4), (XML.encode(), 8)])
@pytest.mark.parametrize("byte", [0, 1, 3])
def test_a_damaged_length_in_the_facts_costs_no_message(of: bytes, before: int, byte: int, *, is_whole: bool) -> None:
    broken, made = bytearray(recorded(is_whole=is_whole)), io.BytesIO()
    broken[broken.index(of) - before + byte] ^= 0x70  # the length of a text stands before it
    assert recover(io.BytesIO(broken), made) == (2, 1, 0)
    recording = Recording(made)
    assert [one.sequence for one in recording.messages()] == [0, 1]
    assert (recording.contents().about, recording.mission_xml()) in [({}, XML), ({"mission": MISSION}, "")]
