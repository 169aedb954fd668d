"""What a page shows of the playing of a recording."""

from __future__ import annotations

import msgspec


class PlaybackView(msgspec.Struct, frozen=True):
    """How far a recording was played.

    Attributes:
        begin_s: Mission time of its first message.
        end_s: Of its last.
        at_s: The mission time that is shown.
        is_playing: False: it stands still.
        speed: Mission seconds per second of the machine while it plays.
    """

    begin_s: float
    end_s: float
    at_s: float
    is_playing: bool
    speed: float
