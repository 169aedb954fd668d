"""A recording is recovered although its recorder still writes it."""

from __future__ import annotations

import io

from small_recordings import CLASSES, MISSION, SCOUT

from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.recording.reader import Recording
from backbone.recording.recovering import recover
from backbone.recording.writer import RecordingWriter
from backbone.wire import WIRE_VERSION, Envelope, write

KEY = key_of(MISSION, SCOUT, Conversation.LOG)


class GrowingFile(io.BytesIO):
    """A file that grows once, when its reader has come to its end."""

    def __init__(self, begin: bytes, rest: bytes) -> None:
        super().__init__(begin)
        self._rest = rest

    def read(self, size: int | None = -1, /) -> bytes:
        if self.tell() == len(self.getbuffer()) and self._rest:
            at, rest, self._rest = self.tell(), self._rest, b""
            self.write(rest)
            self.seek(at)
        return super().read(size)


def test_the_unread_end_of_a_file_that_grows_is_never_shorter_than_nothing() -> None:
    file, ends = io.BytesIO(), list[int]()
    writer = RecordingWriter(file, CLASSES, {"mission": MISSION})
    for number in range(2):
        event = StoryEvent(float(number), SCOUT, "it moves", "scout1", "")
        writer.write(KEY, write(Envelope(WIRE_VERSION, SCOUT, number, float(number), "", event)), float(number))
        writer.flush()
        ends.append(len(file.getvalue()))
    data, cut = file.getvalue(), ends[0]
    made = io.BytesIO()
    assert recover(GrowingFile(data[:cut], data[cut:]), made) == (2, 0, 0)
    assert [one.sequence for one in Recording(made).messages()] == [0, 1]
    assert recover(GrowingFile(data[:cut], data[cut : cut + 60]), io.BytesIO()) == (1, 0, 60)
