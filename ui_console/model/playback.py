"""State of the playback of a recording, for pages."""

from __future__ import annotations

import msgspec


class PlaybackView(msgspec.Struct, frozen=True):
    """Position and state of the playback.

    Attributes:
        begin_s: Mission time of its first message.
        end_s: Mission time of its last message.
        at_s: Shown mission time.
        is_playing: False: paused.
        speed: Mission seconds per second of the machine while it plays.
    """

    begin_s: float
    end_s: float
    at_s: float
    is_playing: bool
    speed: float
