"""Messages for watching pages: received once for all pages, and not at all while no page watches.

Rules of this file:

* A ``KeyEar`` receives the messages from a bus or a recording.
* A view shows its newest message at intervals of at least ``SHOWN_EVERY_S``; the intervals are longer if showing takes
  long.
* Subscriptions change at most once in ``SHOWN_EVERY_S``, however fast pages open and close views.
* Messages reach a page in the same way as pictures: after all control messages, only the newest one, and only when the
page has drawn the previous one.
"""

from __future__ import annotations

import asyncio
import itertools
from collections.abc import Callable, Coroutine, Iterable, Sequence, Set
from typing import NamedTuple, Protocol

import msgspec

from backbone.bus.interface import Clock
from backbone.printable_text import printable
from backbone.recording.reader import Recorded
from ui_console.model.key_shown import MessageShown, key_list
from ui_console.model.key_table import KeyRow
from ui_console.model.key_view import KeyView
from ui_console.model.message_views import installed_views
from ui_console.session.looking import pixels_of
from ui_console.web.key_sight import LIST_STREAM, KeySight
from ui_console.web.pictures import jpeg, packet

# All times are machine seconds.
SHOWN_EVERY_S = 0.1  # chosen: a person cannot follow more
LISTED_EVERY_S = 1.0  # chosen: a person reads rates more slowly
REST = 20.0  # chosen: a view takes at most a twentieth of the server's time, which operators' commands need

Newest = Callable[[], tuple[Recorded, int]]
"""Returns a message and its length in bytes; called only if the message is shown."""


class Listing(Protocol):
    """Counts the messages of all keys."""

    @property
    def dropped(self) -> int:
        """Number of messages that came too fast to be counted."""

    def rows(self) -> Sequence[KeyRow] | None:
        """Return all keys in order; None: not known yet."""

    def close(self) -> None:
        """Count no more."""


class KeyEar(Protocol):
    """Receives the messages that pages watch."""

    async def know(self, schemas: Set[str]) -> None:
        """Load the field names of these messages, if possible. When: before the messages are received."""

    def count(self) -> Listing:
        """Count the messages of all keys until closed."""

    def hear(self, name: tuple[str, str, str], came: Callable[[Newest], None]) -> Callable[[], object]:
        """Call ``came`` with each message of this key, sender and schema; return a function that ends that."""


class KeyWatcher(Protocol):
    """A page that watches messages on the bus."""

    key_sight: KeySight

    def saw_view(self, stream: str, number: int, at_s: float, packed: bytes) -> None:
        """Show the newest message of a stream."""


class _Said(NamedTuple):
    shown: MessageShown
    image: bytes  # JPEG; empty: none


class Viewed:
    """The messages of one key, sender and schema that pages watch.

    Args:
        name: Key, sender and schema.
    """

    def __init__(self, name: tuple[str, str, str]) -> None:
        self.name = name
        self.close: Callable[[], object] = lambda: None
        """Ends the subscription."""
        self.served: set[tuple[KeyWatcher, int]] = set()
        """Pages, with the number of their view, that have the last message."""
        self.last: _Said | None = None
        self._view = KeyView(name[2], installed_views())
        self._newest: Newest | None = None
        self._next_s = 0.0

    def came(self, newest: Newest) -> None:
        """Keep what is looked at."""
        self._newest = newest

    def look(self) -> None:
        """Show the newest message, unless that is too early."""
        now_s = asyncio.get_running_loop().time()
        if self._newest is None or now_s < self._next_s:
            return
        (said, size_bytes), self._newest = self._newest(), None
        before = self._view.messages
        self._view.take(said.body, said.stamp_s, said.sequence)
        if self._view.messages > before:
            image, trouble = self._image()
            self.last = _Said(
                MessageShown(
                    self._view.messages,
                    said.stamp_s,
                    said.sequence,
                    printable(said.cause),
                    size_bytes,
                    self._view.rows,
                    trouble,
                    bool(image),
                ),
                image,
            )
            self.served.clear()
        self._next_s = now_s + REST * (asyncio.get_running_loop().time() - now_s)

    def _image(self) -> tuple[bytes, str]:
        picture = self._view.picture
        if picture is None:
            return b"", self._view.trouble
        try:
            return jpeg(pixels_of(picture)), self._view.trouble
        except ValueError as error:
            return b"", f"the picture cannot be shown: {error}"


class KeyWatch:
    """Watches messages for its clients.

    Args:
        ear: Receives the messages.
        clock: The mission's.
        clients: Returns the connected pages.
        start_task: Runs a coroutine until the server ends; a bug in it ends the server.
    """

    def __init__(
        self,
        ear: KeyEar,
        clock: Clock,
        clients: Callable[[], Iterable[KeyWatcher]],
        start_task: Callable[[Coroutine[object, None, None], str], asyncio.Task[None]],
    ) -> None:
        self._ear, self._clock, self._clients, self._start_task = ear, clock, clients, start_task
        self._task: asyncio.Task[None] | None = None
        self._listing: Listing | None = None
        self._viewed: dict[tuple[str, str, str], Viewed] = {}
        self._lists: dict[KeyWatcher, KeySight] = {}
        self._listed_s = 0.0
        self._numbers = itertools.count(1)

    @property
    def is_counting(self) -> bool:
        """Whether the messages of all keys are counted."""
        return self._listing is not None

    @property
    def looked_at(self) -> frozenset[tuple[str, str, str]]:
        """Key, sender and schema of each view."""
        return frozenset(self._viewed)

    def changed(self) -> None:
        """Update the watching, because a page came, left, or watches another key."""
        if (self._task is None or self._task.done()) and any(self._wanting()):
            self._task = self._start_task(self._look(), "look at keys")

    def _wanting(self) -> list[KeyWatcher]:
        return [one for one in self._clients() if one.key_sight.streams]

    async def _look(self) -> None:
        """Watch until no page does."""
        try:
            while self._wanting():
                await self._ear.know({one.key_sight.schema for one in self._wanting()} - {""})
                wanting = self._wanting()
                self._settle(wanting)
                self._show(wanting)
                await self._clock.sleep_s(SHOWN_EVERY_S * self._clock.rate)
        finally:
            self._settle([])

    def _settle(self, wanting: list[KeyWatcher]) -> None:
        """Subscribe to exactly the messages of these views."""
        is_listed = any(one.key_sight.is_listed for one in wanting)
        if is_listed and self._listing is None:
            self._listing = self._ear.count()
        elif not is_listed and self._listing is not None:
            self._listing.close()
            self._listing, self._lists = None, {}
        views = {view for one in wanting if (view := one.key_sight.view) is not None}
        for gone in self._viewed.keys() - views:
            self._viewed.pop(gone).close()
        for new in views - self._viewed.keys():
            viewed = self._viewed[new] = Viewed(new)
            viewed.close = self._ear.hear(new, viewed.came)

    def _show(self, wanting: list[KeyWatcher]) -> None:
        self._show_lists([one for one in wanting if one.key_sight.is_listed])
        for viewed in self._viewed.values():
            viewed.look()
        for one in wanting:
            if (view := one.key_sight.view) is not None:
                self._show_message(one, self._viewed[view])

    def _show_lists(self, wanting: list[KeyWatcher]) -> None:
        """Send the list to all pages when it is due, and at once to pages that request another list."""
        now_s = asyncio.get_running_loop().time()
        is_due = now_s >= self._listed_s + LISTED_EVERY_S
        news = [one for one in wanting if is_due or self._lists.get(one) != one.key_sight]
        rows = self._listing.rows() if self._listing is not None and news else None
        if self._listing is None or rows is None:
            return
        if is_due:
            self._listed_s = now_s
        self._lists = {one: one.key_sight for one in wanting}
        number, dropped = next(self._numbers), self._listing.dropped
        for client in news:
            _is_listed, words, order, *_view = client.key_sight
            self._send(client, LIST_STREAM, number, msgspec.json.encode(key_list(rows, words, order, dropped)))

    def _show_message(self, client: KeyWatcher, viewed: Viewed) -> None:
        """Send the last message, if the page does not have it."""
        sight, last = client.key_sight, viewed.last
        if last is None or (client, sight.number) in viewed.served:
            return
        viewed.served.add((client, sight.number))
        number = last.shown.number
        self._send(client, sight.fields_stream, number, msgspec.json.encode(last.shown))
        if last.image:
            self._send(client, sight.picture_stream, number, last.image)

    def _send(self, client: KeyWatcher, stream: str, number: int, body: bytes) -> None:
        at_s = self._clock.now_s()
        client.saw_view(stream, number, at_s, packet(stream, number, at_s, body))
