"""A story book keeps its size with any events."""

from __future__ import annotations

from backbone.bus.clock import MissionClock
from backbone.bus.interface import current_cause
from backbone.component.messages import Story
from backbone.component.story import LENGTH, LONGEST_WHAT, StoryBook
from backbone.wire import Envelope, Reader, write


def test_a_story_of_long_notes_stays_small_and_can_be_told() -> None:
    book = StoryBook("backbone/nameserver", MissionClock.started_now())
    token = current_cause.set("c" * 1_000_000)
    for number in range(2 * LENGTH):
        book.note("s" * 1_000_000, f"{number} " + "w" * 1_000_000)
    current_cause.reset(token)
    raw = write(Envelope(1, "backbone/nameserver", 1, 0.0, "", Story(book.of())))
    assert len(raw) < LENGTH * (LONGEST_WHAT + 1_000)
    assert len(Reader(Story).read(raw).body.events) == LENGTH
