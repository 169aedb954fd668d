"""Messages on the bus for pages that look at them: overheard once for all pages, and not at all while none looks.

Rules of this file:

* While a page has the list open, every conversation is overheard, and counted by the begins of its messages alone.
* A view overhears one conversation of one component. Of its messages the newest is translated, at most
  ``SHOWN_EVERY_S`` apart, and further apart if that takes long.
* Subscriptions change at most once in ``SHOWN_EVERY_S``, however fast pages open and close views.
* What is shown goes by the pictures' way to a page: after all control, the newest only, and only when the page has
  drawn what came before.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections.abc import Callable, Coroutine, Iterable
from typing import NamedTuple, Protocol

import msgspec

from backbone.bus.interface import Bus, Clock, Overhearing
from backbone.command_line.message_lines import short_key
from backbone.command_line.watching import mission_classes
from backbone.keys import ROOT, Conversation
from backbone.printable_text import printable
from backbone.recording.hearing import to_overhear, unfolded
from backbone.recording.known_messages import message_classes
from backbone.recording.reader import heard_now
from backbone.recording.translation import Translator, heading_of
from backbone.wire import Message
from ui_console.model.key_shown import MessageShown, key_list
from ui_console.model.key_table import KeyTable
from ui_console.model.key_view import KeyView
from ui_console.model.message_views import installed_views
from ui_console.web.key_sight import LIST_STREAM, KeySight, where_heard
from ui_console.web.pictures import jpeg, packet, pixels_in

log = logging.getLogger(__name__)

# All seconds are those of the machine.
SHOWN_EVERY_S = 0.1  # chosen: a person follows no more
LISTED_EVERY_S = 1.0  # chosen: rates are read, not followed
MOST_WAITING_BYTES = 4 * 1024 * 1024  # chosen: the pictures of a second of four robots
REST = 20.0  # chosen: a view takes at most a twentieth of the server's time, which operators' commands need
ASKED_EVERY_S = 10.0  # chosen: a page that asks for messages that nobody knows costs the mission one question

PLAYED = tuple(one for one in Conversation if one not in (Conversation.ASK, Conversation.TOLD, Conversation.ALIVE))


class KeyWatcher(Protocol):
    """A page that looks at messages on the bus."""

    key_sight: KeySight

    def saw_view(self, stream: str, number: int, at_s: float, packed: bytes) -> None:
        """Show the newest of a stream."""


class _Said(NamedTuple):
    shown: MessageShown
    image: bytes  # JPEG; empty: none


class Viewed:
    """The messages of one key, sender and schema that pages look at.

    Args:
        name: Key, sender and schema.
    """

    def __init__(self, name: tuple[str, str, str]) -> None:
        self.name = name
        self.hearing: Overhearing | None = None
        self.served: set[tuple[KeyWatcher, int]] = set()
        """Pages, with the number of their view, that have the last message."""
        self.last: _Said | None = None
        self._view = KeyView(name[2], installed_views())
        self._newest = b""
        self._next_s = 0.0

    def came(self, key: str, raw: bytes) -> None:
        """Keep what is looked at."""
        for said_at, envelope in unfolded(key, raw):
            head = heading_of(envelope)
            if (short_key(said_at), head.source, head.schema) == self.name:
                self._newest = envelope

    def look(self, translator: Translator | None, mission_s: float) -> None:
        """Show the newest message that came, unless that is too early."""
        now_s = asyncio.get_running_loop().time()
        if translator is None or not self._newest or now_s < self._next_s:
            return
        raw, self._newest = self._newest, b""
        before = self._view.messages
        said = heard_now(self.name[0], translator.translate(raw, mission_s), mission_s)
        self._view.take(said.body, said.stamp_s, said.sequence)
        if self._view.messages > before:
            image, trouble = self._image()
            self.last = _Said(
                MessageShown(
                    self._view.messages,
                    said.stamp_s,
                    said.sequence,
                    printable(said.cause),
                    len(raw),
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
            return jpeg(pixels_in(picture)), self._view.trouble
        except ValueError as error:
            return b"", f"the picture cannot be shown: {error}"

    def close(self) -> None:
        """Hear nothing more."""
        if self.hearing is not None:
            self.hearing.close()


class KeyWatch:
    """Looks at messages for its clients.

    Args:
        bus: Of the server.
        clock: The mission's.
        clients: Returns the pages that are there.
        start_task: Runs a coroutine until the server ends; its bug is the server's.
        is_played: True: a player says what was recorded, without copies of anything.
    """

    def __init__(
        self,
        bus: Bus,
        clock: Clock,
        clients: Callable[[], Iterable[KeyWatcher]],
        start_task: Callable[[Coroutine[object, None, None], str], asyncio.Task[None]],
        *,
        is_played: bool = False,
    ) -> None:
        self._bus, self._clock, self._clients, self._start_task = bus, clock, clients, start_task
        self._is_played = is_played
        self._task: asyncio.Task[None] | None = None
        self._table: KeyTable | None = None
        self._counting: list[Overhearing] = []
        self._known: list[tuple[str, str, str]] = []  # rows of the last list, so that the next one has them at once
        self._viewed: dict[tuple[str, str, str], Viewed] = {}
        self._lists: dict[KeyWatcher, KeySight] = {}
        self._listed_s = 0.0
        self._numbers = itertools.count(1)
        self._schemas = frozenset[str]()
        self._translator: Translator | None = None
        self._asked_s = -ASKED_EVERY_S

    @property
    def is_counting(self) -> bool:
        """Whether all conversations are overheard."""
        return bool(self._counting)

    @property
    def looked_at(self) -> frozenset[tuple[str, str, str]]:
        """Key, sender and schema of each view."""
        return frozenset(self._viewed)

    def changed(self) -> None:
        """Begin to look if that is wanted: a page came, went, or looks at something else."""
        if (self._task is None or self._task.done()) and any(self._wanting()):
            self._task = self._start_task(self._look(), "look at keys")

    # ------------------------------------------------------------------ within
    def _wanting(self) -> list[KeyWatcher]:
        return [one for one in self._clients() if one.key_sight.streams]

    async def _look(self) -> None:
        """Look until no page does."""
        try:
            while self._wanting():
                await self._know_classes()
                wanting = self._wanting()
                self._settle(wanting)
                self._show(wanting)
                await self._clock.sleep_s(SHOWN_EVERY_S * self._clock.rate)
        finally:
            self._settle([])

    def _settle(self, wanting: list[KeyWatcher]) -> None:
        """Overhear what these look at, and nothing else."""
        is_listed = any(one.key_sight.is_listed for one in wanting)
        if is_listed and not self._counting:
            mission = self._bus.mission
            known = [(f"{ROOT}/{mission}/{key}", source, schema) for key, source, schema in self._known]
            self._table = KeyTable(self._clock.now_s(), known)
            conversations = PLAYED if self._is_played else to_overhear(())
            self._counting = [self._bus.overhear(one, self._count, MOST_WAITING_BYTES) for one in conversations]
        elif not is_listed:
            for each in self._counting:
                each.close()
            if self._table is not None:
                self._known = [row.id for row in self._table.rows(self._clock.now_s())]
            self._counting, self._table, self._lists = [], None, {}
        views = {view for one in wanting if (view := one.key_sight.view) is not None}
        for gone in self._viewed.keys() - views:
            self._viewed.pop(gone).close()
        for new in views - self._viewed.keys():
            viewed = self._viewed[new] = Viewed(new)
            conversation, of = where_heard(new[0], new[1], is_played=self._is_played)
            viewed.hearing = self._bus.overhear(conversation, viewed.came, MOST_WAITING_BYTES, of)

    def _count(self, key: str, raw: bytes) -> None:
        if self._table is None:
            return
        at_s = self._clock.now_s()
        for said_at, envelope in unfolded(key, raw):
            head = heading_of(envelope)
            said = (head.stamp_s, head.sequence) if self._is_played else None
            self._table.add(said_at, head.source, head.schema, len(envelope), at_s, said)

    def _show(self, wanting: list[KeyWatcher]) -> None:
        self._show_lists([one for one in wanting if one.key_sight.is_listed])
        for viewed in self._viewed.values():
            viewed.look(self._translator, self._clock.now_s())
        for one in wanting:
            if (view := one.key_sight.view) is not None:
                self._show_message(one, self._viewed[view])

    def _show_lists(self, wanting: list[KeyWatcher]) -> None:
        """Send the list to all when it is time, and at once to pages that want another one."""
        now_s = asyncio.get_running_loop().time()
        is_due = now_s >= self._listed_s + LISTED_EVERY_S
        news = [one for one in wanting if is_due or self._lists.get(one) != one.key_sight]
        if is_due:
            self._listed_s = now_s
        if self._table is None or not news:
            return
        self._lists = {one: one.key_sight for one in wanting}
        rows, number = self._table.rows(self._clock.now_s(), self._clock.rate), next(self._numbers)
        dropped = sum(one.dropped for one in self._counting)
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

    # ------------------------------------------------------------------ names of fields
    async def _know_classes(self) -> None:
        """Know the messages in view by the names of their fields: at first those of the installed packages."""
        if self._translator is None:
            self._know(await asyncio.to_thread(message_classes))
        unknown = {one.key_sight.schema for one in self._wanting()} - self._schemas - {""}
        now_s = asyncio.get_running_loop().time()
        if unknown and now_s >= self._asked_s + ASKED_EVERY_S:
            self._asked_s = now_s
            self._know(await mission_classes(self._bus, log.info))

    def _know(self, classes: dict[str, type[Message]]) -> None:
        self._schemas, self._translator = frozenset(classes), Translator(classes)
