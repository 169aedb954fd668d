"""Debug views of a behavior: named intermediate pictures and values that cost nothing unless a console watches them.

A behavior calls ``picture`` or ``value`` whenever it has new data. The function that makes a picture is called only
while a console watches the view, at most once in ``SHOWN_EVERY_S``. Otherwise no picture is made and nothing is
published.
"""

from __future__ import annotations

import contextlib
import math
from collections.abc import Callable
from threading import Lock
from typing import TYPE_CHECKING, Any, Protocol

from backbone.bus.interface import Clock
from backbone.debug_views import (
    MOST_VIEWS,
    SHOWN_EVERY_S,
    LookAt,
    LookedAt,
    UnknownView,
    ViewEntry,
    ViewKind,
    ViewPicture,
    Views,
    ViewValue,
    view_address,
)
from backbone.keys import Conversation
from backbone.naming import did_you_mean, legal
from backbone.printable_text import printable
from backbone.ranges import LONGEST_LINE, MOST_MEASURE, MOST_PIXEL_BYTES, MOST_PX
from backbone.wire import Message

if TYPE_CHECKING:  # most behaviors use no pictures and need no NumPy
    from numpy.typing import NDArray

Shown = float | bool | str


class Publisher(Protocol):
    """The interface of a bus that views need."""

    @property
    def source(self) -> str:
        """Address of the component."""

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all present subscribers."""


class LookBook:
    """Records which views consoles watch, and when each may be published again. Pure: times are arguments.

    Args:
        every_s: Least time between two publications of one view.
    """

    def __init__(self, every_s: float) -> None:
        self._every_s, self._lock = every_s, Lock()  # a unit may publish in a thread beside its event loop
        self._until_s: dict[str, float] = {}
        self._again_s: dict[str, float] = {}

    def look(self, view: str, until_s: float) -> float:
        """Record that a console watches the view until this time; return the latest such time of all consoles."""
        with self._lock:
            self._until_s[view] = until_s = max(until_s, self._until_s.get(view, until_s))
        return until_s

    @property
    def is_empty(self) -> bool:
        """True while no console watches a view."""
        return not self._until_s

    def take(self, view: str, now_s: float) -> bool:
        """Return whether to publish the view now; if so, the next publication is due after ``every_s``."""
        with self._lock:
            until_s = self._until_s.get(view)
            if until_s is None:
                return False
            if now_s >= until_s:
                del self._until_s[view]
                return False
            if now_s < self._again_s.get(view, now_s):
                return False
            self._again_s[view] = now_s + self._every_s
            return True


class DebugViews:
    """The views of one behavior. A view exists from its first ``picture`` or ``value`` on, at most ``MOST_VIEWS``.

    Args:
        clock: The mission's.
    """

    def __init__(self, bus: Publisher, clock: Clock) -> None:
        self._bus, self._clock = bus, clock
        self._book = LookBook(SHOWN_EVERY_S * clock.rate)
        self._kinds: dict[str, ViewKind] = {}
        self._values: dict[str, Shown] = {}

    def picture(self, view: str, make: Callable[[], NDArray[Any]]) -> None:
        """Publish a picture, if a console watches the view and the view's last picture is old enough.

        Args:
            view: A legal name, the same for each picture of this view.
            make: Returns the picture; called at once or never. Grey levels 0 to 255 of shape (height, width), red,
                green and blue of shape (height, width, 3), or True and False of shape (height, width). Other numbers
                are rounded down and clipped to 0 to 255.

        Raises:
            ValueError: The view shows values, there are too many views, or the picture has another shape or more than
                8 MB.
        """
        if self._kinds.get(view) is not ViewKind.PICTURE:
            self._add(view, ViewKind.PICTURE)
        if not self._book.is_empty and self._book.take(view, now_s := self._clock.now_s()):
            self._publish(view, picture_of(view, now_s, make()))

    def value(self, view: str, value: Shown) -> None:
        """Record a value for the list of views; while a console watches the view, also publish it.

        Args:
            view: A legal name with the value's unit, the same for each value of this view.
            value: A number, a flag or a line.

        Raises:
            ValueError: The view shows pictures, or there are too many views.
        """
        if self._kinds.get(view) is not ViewKind.VALUE:
            self._add(view, ViewKind.VALUE)
        self._values[view] = value
        if not self._book.is_empty:
            self._show(view, value)

    def forget(self, prefix: str) -> None:
        """Forget the views whose names begin so, because another class shows its own from now on."""
        for view in [name for name in tuple(self._kinds) if name.startswith(prefix)]:
            del self._kinds[view]
            self._values.pop(view, None)

    def listed(self) -> Views:
        """Return the views shown so far, with their newest values."""
        entries = ((view, kind, self._values.get(view, "")) for view, kind in sorted(self._kinds.items()))
        return Views([ViewEntry(view, kind, sendable(value)) for view, kind, value in entries])

    def look(self, asked: LookAt) -> LookedAt:
        """Publish this view for the requested time; of a value, the newest one at once.

        Raises:
            UnknownView: The behavior has not shown such a view so far.
        """
        kind = self._kinds.get(asked.view)
        if kind is None:
            known = ", ".join(sorted(self._kinds)) or "none yet"
            meant = did_you_mean(asked.view, self._kinds)
            raise UnknownView(f"there is no view {asked.view!r}{meant}; there is: {known}", view=asked.view)
        until_s = self._book.look(asked.view, self._clock.now_s() + asked.for_s * self._clock.rate)
        if kind is ViewKind.VALUE:
            self._show(asked.view, self._values.get(asked.view, ""))
        return LookedAt(asked.view, kind, until_s)

    def _add(self, view: str, kind: ViewKind) -> None:
        known = self._kinds.get(legal(view), kind)
        if known is not kind:
            raise ValueError(f"the view {view!r} shows a {known}, not a {kind}")
        if len(self._kinds) >= MOST_VIEWS:
            raise ValueError(f"{MOST_VIEWS} views are shown already, {view!r} is one too many")
        self._kinds[view] = kind

    def _show(self, view: str, value: Shown) -> None:
        now_s = self._clock.now_s()
        if self._book.take(view, now_s):
            self._publish(view, ViewValue(view, now_s, sendable(value)))

    def _publish(self, view: str, shown: ViewPicture | ViewValue) -> None:
        self._bus.publish(view_address(self._bus.source, view), Conversation.VIEWS, shown)


def sendable(value: Any) -> Shown:
    """Return the value in a form that fits a message: everything but flags and numbers in range becomes printable text.

    A value of another type is no bug here, because it would end its behavior or unit only when a person looks.

    Example:
        >>> sendable(3), sendable(True), sendable(float("nan")), sendable(None)
        (3.0, True, 'nan', 'None')
    """
    if isinstance(value, bool):
        return value
    number = math.nan
    if not isinstance(value, str):
        with contextlib.suppress(TypeError, ValueError, OverflowError):  # an array of several; more than any float
            number = float(value)
    if math.isfinite(number) and abs(number) <= MOST_MEASURE:
        return number
    return printable(str(value), LONGEST_LINE)[:LONGEST_LINE]


def picture_of(view: str, at_s: float, made: NDArray[Any]) -> ViewPicture:
    """Return the message with a copy of this picture; see ``DebugViews.picture``.

    Raises:
        ValueError: The picture has another shape, or is too large for a message.
    """
    is_color = made.ndim == 3
    if made.ndim not in (2, 3) or (is_color and made.shape[2] != 3):
        raise ValueError(f"the picture {view!r} has shape {made.shape}, not (height, width) or (height, width, 3)")
    if made.nbytes // made.itemsize > MOST_PIXEL_BYTES or max(made.shape) > MOST_PX:
        raise ValueError(f"the picture {view!r} has shape {made.shape}: at most {MOST_PX} pixels wide and 8 MB")
    if made.dtype.kind == "b":
        made = made.astype("uint8") * 255
    elif made.dtype != "uint8":
        levels = made.clip(0, 255)
        levels[levels != levels] = 0  # noqa: PLR0124  only NaN differs from itself
        made = levels.astype("uint8")
    height, width = made.shape[:2]
    return ViewPicture(view, at_s, width, height, is_color, memoryview(made.tobytes()))
