"""Sources of messages for pages: the bus of a running mission, or a recording.

Rules of this file:

* On a bus, the list overhears every conversation, and decodes only the headers of messages. A view overhears one
conversation of one component.
* A recording is read from its file, because a bus has no past messages, no past questions, and no keys that are silent
  now.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine, Sequence, Set
from functools import partial

from backbone.bus.interface import Bus, Clock
from backbone.command_line.message_lines import short_key
from backbone.command_line.watching import mission_classes
from backbone.errors import Refusal
from backbone.recording.hearing import unfolded
from backbone.recording.known_messages import message_classes
from backbone.recording.playback import Playback
from backbone.recording.reader import Recorded, Recording, heard_now
from backbone.recording.translation import Translator, heading_of
from backbone.wire import Message
from ui_console.model.key_table import KeyRow
from ui_console.session.key_looking import MOST_WAITING_BYTES, HeardKeys, ShowRows, keep_listing_recorded, said_at
from ui_console.web.key_sight import where_heard
from ui_console.web.key_watch import Newest

log = logging.getLogger(__name__)

ASKED_EVERY_S = 10.0  # chosen: a page that asks for unknown messages costs the mission one question; machine

StartTask = Callable[[Coroutine[object, None, None], str], asyncio.Task[None]]


class BusEar:
    """Receives messages from a bus; see ``KeyEar``.

    Args:
        bus: Bus of the server.
        clock: The mission's clock.
    """

    def __init__(self, bus: Bus, clock: Clock) -> None:
        self._bus, self._clock = bus, clock
        self._known: list[tuple[str, str, str]] = []  # rows of the last list, which the next list shows at once
        self._schemas = frozenset[str]()
        self._translator: Translator  # since ``know``
        self._asked_s = -ASKED_EVERY_S

    async def know(self, schemas: Set[str]) -> None:
        """Load the classes of these messages, first from the installed packages."""
        if not self._schemas:
            self._know(await asyncio.to_thread(message_classes))
        now_s = asyncio.get_running_loop().time()
        if schemas - self._schemas and now_s >= self._asked_s + ASKED_EVERY_S:
            self._asked_s = now_s
            self._know(await mission_classes(self._bus, log.info))

    def count(self) -> HeardKeys:
        """Count the messages from now on."""
        return HeardKeys(self._bus, self._clock, self._known)

    def hear(self, name: tuple[str, str, str], came: Callable[[Newest], None]) -> Callable[[], object]:
        """Overhear the conversation of a key."""

        def said(envelope: bytes) -> tuple[Recorded, int]:
            now_s = self._clock.now_s()
            return heard_now(name[0], self._translator.translate(envelope, now_s), now_s), len(envelope)

        def overheard(key: str, raw: bytes) -> None:
            for at, envelope in unfolded(key, raw):
                head = heading_of(envelope)
                if (short_key(at), head.source, head.schema) == name:
                    came(partial(said, envelope))

        conversation, of = where_heard(name[0], name[1])
        return self._bus.overhear(conversation, overheard, MOST_WAITING_BYTES, of).close

    def _know(self, classes: dict[str, type[Message]]) -> None:
        self._schemas, self._translator = frozenset(classes), Translator(classes)


class RecordingEar:
    """Reads a recording at the shown time; see ``KeyEar``.

    Args:
        reopened: Opens the recording once more.
        playback: Time of the playback.
        start_task: Runs a coroutine until the server ends.
    """

    def __init__(self, reopened: Callable[[], Recording], playback: Playback, start_task: StartTask) -> None:
        self._reopened, self._playback, self._start_task = reopened, playback, start_task

    async def know(self, schemas: Set[str]) -> None:
        """Do nothing, because a recording contains the names of fields."""

    def count(self) -> RecordedKeys:
        """Count the messages at the shown time."""
        return RecordedKeys(
            lambda show: self._read(lambda recording: keep_listing_recorded(recording, self._playback, show))
        )

    def hear(self, name: tuple[str, str, str], came: Callable[[Newest], None]) -> Callable[[], object]:
        """Read the last message before the shown time, and further messages as time passes."""

        async def follow(recording: Recording) -> None:
            async for said in said_at(recording, self._playback, KeyRow(*name)):
                came(partial(tuple[Recorded, int], said))

        return self._read(follow)

    def _read(self, read: Callable[[Recording], Coroutine[object, None, None]]) -> Callable[[], object]:
        async def reading() -> None:
            try:
                await read(await asyncio.to_thread(self._reopened))
            except Refusal as refusal:
                log.warning("keys of the recording are shown no more: %s", refusal)

        return self._start_task(reading(), "read the recording").cancel


class RecordedKeys:
    """Rows that are read; see ``Listing``.

    Args:
        begin: Begins to call its argument with the rows; returns a function that ends that.
    """

    dropped = 0

    def __init__(self, begin: Callable[[ShowRows], Callable[[], object]]) -> None:
        self._rows: Sequence[KeyRow] | None = None
        self._end = begin(self._show)

    def rows(self) -> Sequence[KeyRow] | None:
        """Return all keys of the recording; None: the recording is not open yet."""
        return self._rows

    def close(self) -> None:
        """Stop reading."""
        self._end()

    def _show(self, rows: Sequence[KeyRow]) -> None:
        self._rows = rows
