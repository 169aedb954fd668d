"""A recording with the largest messages is recovered, too."""

from __future__ import annotations

import io
from random import Random

from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.ranges import Bulk
from backbone.recording.reader import Recording
from backbone.recording.recovering import recover
from backbone.recording.writer import CHUNK_BYTES, RecordingWriter
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, WIRE_VERSION, Envelope, Message, schema_of, write

UNIT = "mission_control/mapper"
HEADING_BYTES = 200
SIZES = (1, CHUNK_BYTES // 2, MAX_LARGE_MESSAGE_BYTES - HEADING_BYTES, 1)


class MapsOfFloors(Message, frozen=True):
    maps: list[Bulk]


def test_the_largest_message_is_recovered_from_a_file_without_an_end() -> None:
    """Noise cannot be compressed, so its chunk is larger than the largest message."""
    file, made = io.BytesIO(), io.BytesIO()
    writer = RecordingWriter(file, {schema_of(MapsOfFloors): MapsOfFloors}, {})
    for number, size in enumerate(SIZES):
        noise = memoryview(Random(number).randbytes(size))
        maps = MapsOfFloors([noise[: size // 2], noise[size // 2 :]])
        raw = write(Envelope(WIRE_VERSION, UNIT, number, float(number), "", maps), MAX_LARGE_MESSAGE_BYTES)
        writer.write(key_of("night", UNIT, Conversation.OUTPUTS), raw, float(number))
    writer.flush()
    assert recover(file, made) == (len(SIZES), 0, 0)
    assert [one.sequence for one in Recording(made).messages()] == [0, 1, 2, 3]
