"""Messages of a page that shows a recording: for viewing and for playback, and the state of the playback."""

from __future__ import annotations

from typing import Annotated

import msgspec

from backbone.ranges import Instant
from backbone.recording.playback import FASTEST, SLOWEST
from ui_console.web.login import BeatRequest, Hello
from ui_console.web.protocol import (
    Acknowledge,
    Drawn,
    Here,
    Intent,
    ListKeys,
    LookInto,
    MoreLog,
    ParametersRequest,
    SearchLog,
    ViewKey,
    Watch,
    WhyRequest,
)

Looking = (
    Acknowledge
    | Drawn
    | Here
    | ListKeys
    | LookInto
    | MoreLog
    | ParametersRequest
    | SearchLog
    | ViewKey
    | Watch
    | WhyRequest
)
"""Intents that command nothing."""


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


class PlayOn(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="play_on"):
    """Play at this number of mission seconds per second."""

    speed: Annotated[float, msgspec.Meta(ge=SLOWEST, le=FASTEST)] = 1.0


class StandStill(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="pause"):
    """Stand still."""


class StepOn(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="step_on"):
    """Go to the next picture, decision or event, and pause there."""


class ShowTime(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="go_to"):
    """Show another time."""

    at_s: Instant


Playing = PlayOn | StandStill | StepOn | ShowTime
_intents: msgspec.json.Decoder[Hello | BeatRequest | Intent | Playing] = msgspec.json.Decoder(
    Hello | BeatRequest | Intent | Playing
)
understand = _intents.decode
"""Returns the decoded message; raises ``msgspec.DecodeError`` for one that is not valid."""
