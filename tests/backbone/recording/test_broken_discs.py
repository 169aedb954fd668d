"""A recording on a disc that cannot be read any more is refused as such, at its begin and in its middle."""

from __future__ import annotations

import errno
import io
import os
from collections.abc import Callable

import pytest
from small_recordings import SCOUT, Said, recorded

from backbone.component.messages import ComponentState, LifeState
from backbone.keys import Conversation
from backbone.recording.reader import NoRecording, Recording
from backbone.recording.recovering import recover


class Disc(io.BytesIO):
    """A file on a disc that breaks."""

    is_broken = False

    def read(self, size: int | None = -1) -> bytes:
        if self.is_broken:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return super().read(size)


@pytest.fixture
def disc() -> Disc:
    state = ComponentState(SCOUT, "scout", "base", 7, LifeState.READY, 0.5, "drives")
    return Disc(recorded([Said(1.0, SCOUT, Conversation.STATUS, state)]).getvalue())


@pytest.mark.parametrize("read", [Recording, lambda disc: recover(disc, io.BytesIO())])
def test_one_that_is_broken_at_once(disc: Disc, read: Callable[[Disc], object]) -> None:
    disc.is_broken = True
    with pytest.raises(NoRecording, match="no recording: it cannot be read: Input/output error"):
        read(disc)


def test_one_that_breaks_while_it_is_read(disc: Disc) -> None:
    recording = Recording(disc)
    disc.is_broken = True
    with pytest.raises(NoRecording, match="Input/output error"):
        list(recording.messages())
