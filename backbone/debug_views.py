"""Messages of debug views: named intermediate pictures and values of a component, sent only while a person looks.

* console → behavior: ``ListViews``, ``LookAt``.
* behavior → all subscribers: ``ViewPicture`` and ``ViewValue``, published under ``view_address`` (conversation
  ``views``) while a person looks.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from msgspec import Meta

from backbone.errors import Refusal
from backbone.ranges import Instant, Line, Measure, Mention, Name, PixelCount, Pixels
from backbone.wire import Message

MOST_VIEWS = 64  # chosen: more than a person chooses from; the largest behavior has four
LONGEST_LOOK_S = 60.0  # chosen: a viewer that died costs its behavior a minute of pictures at most
LOOK_FOR_S, LOOK_AGAIN_S = 5.0, 2.0  # chosen: one lost question leaves no gap; seconds of the machine
SHOWN_EVERY_S = 0.1  # chosen: people follow ten pictures a second; seconds of the machine


class ViewKind(StrEnum):
    """Kind of a view."""

    PICTURE = "picture"
    VALUE = "value"


class ListViews(Message, frozen=True):
    """Ask a behavior for its debug views."""


class ViewEntry(Message, frozen=True):
    """One debug view.

    Attributes:
        view: Its name; for a value with a unit, with the unit.
        kind: A picture or a value.
        value: The newest value; empty for a picture, and before the first value.
    """

    view: Name
    kind: ViewKind
    value: Measure | bool | Line = ""


class Views(Message, frozen=True):
    """Answer to ``ListViews``: the views that the behavior has shown so far, sorted by name."""

    views: Annotated[list[ViewEntry], Meta(max_length=MOST_VIEWS)]


class LookAt(Message, frozen=True):
    """Ask a behavior to publish a view for this time; to go on, ask again before the time is over.

    Attributes:
        for_s: Seconds of the machine.
    """

    view: Mention
    for_s: Annotated[float, Meta(gt=0, le=LONGEST_LOOK_S)] = LOOK_FOR_S


class LookedAt(Message, frozen=True):
    """Answer to ``LookAt``: the view is published when it changes, until this mission time at least."""

    view: Name
    kind: ViewKind
    until_s: Instant


class ViewPicture(Message, frozen=True):
    """A picture of a view, published under ``view_address``.

    Attributes:
        at_s: Mission time at which it was made.
        is_color: True: red, green and blue for each pixel; False: grey levels.
        pixels: Row by row from the top; ``width_px`` times ``height_px`` times 1 or, in color, 3 bytes.
    """

    view: Name
    at_s: Instant
    width_px: PixelCount
    height_px: PixelCount
    is_color: bool
    pixels: Pixels

    def __post_init__(self) -> None:
        if self.width_px * self.height_px * (3 if self.is_color else 1) != len(self.pixels):
            raise ValueError(f"{len(self.pixels)} bytes for {self.width_px} x {self.height_px}")


class ViewValue(Message, frozen=True):
    """A value of a view, published under ``view_address``.

    Attributes:
        at_s: Mission time at which it was sent.
    """

    view: Name
    at_s: Instant
    value: Measure | bool | Line


class UnknownView(Refusal):
    """The behavior has not shown a view of this name since it started."""

    code = "views.unknown"
    remedy = "List its views with 'scout-console look BEHAVIOR'; a view exists once the behavior has shown it."


def view_address(behavior: str, view: str) -> str:
    """Return the address under which a view is published.

    Example:
        >>> view_address("mission_control/watch-scout1", "difference")
        'mission_control/watch-scout1/difference'
    """
    return f"{behavior}/{view}"
