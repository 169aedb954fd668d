"""Watches keys: the message rates of all keys, and the messages of one; only while a person watches.

Live messages are overheard: no component waits for a console, or makes copies while no console watches. Recorded
messages are read from the file, so their past is available, too.
"""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping
from itertools import islice

from backbone.bus.interface import Bus, Clock
from backbone.command_line.watching import overhearing
from backbone.keys import ROOT, address_of
from backbone.recording.hearing import to_overhear, unfolded
from backbone.recording.playback import Playback
from backbone.recording.reader import Recorded, Recording, heard_now
from backbone.recording.translation import Translated, heading_of
from backbone.waiting import first_to_end
from backbone.wire import Message
from ui_console.model.key_table import PART_S, PARTS, KeyRow, KeyTable
from ui_console.model.key_view import KeyView
from ui_console.model.series import SPAN_S

LIST_EACH_S = 1.0  # chosen: as ``scout-backbone top``; seconds of the machine
MOST_BEFORE = 500  # chosen: read within a second; if none matches, older messages have another schema
MOST_WAITING_BYTES = 4 * 1024 * 1024  # chosen: the pictures of a second of four robots

Classes = Mapping[str, type[Message]]
ShowRows = Callable[[list[KeyRow]], None]


class HeardKeys:
    """Counts overheard messages by their headers, so it needs no message classes.

    Args:
        known: Rows that are listed at once; after ``close``, all rows so far.
    """

    def __init__(self, bus: Bus, clock: Clock, known: list[tuple[str, str, str]]) -> None:
        self._clock, self._known = clock, known
        self._table = KeyTable(
            clock.now_s(), [(f"{ROOT}/{bus.mission}/{key}", source, schema) for key, source, schema in known]
        )
        self._overheard = [bus.overhear(one, self._count, MOST_WAITING_BYTES) for one in to_overhear(())]

    @property
    def dropped(self) -> int:
        """Number of messages that arrived too fast to be counted."""
        return sum(one.dropped for one in self._overheard)

    def rows(self) -> list[KeyRow]:
        """Return all keys with their rates."""
        return self._table.rows(self._clock.now_s(), self._clock.rate)

    def close(self) -> None:
        """Stop overhearing."""
        for each in self._overheard:
            each.close()
        self._known[:] = [row.id for row in self.rows()]

    def _count(self, key: str, raw: bytes) -> None:
        at_s = self._clock.now_s()
        for at, envelope in unfolded(key, raw):
            head = heading_of(envelope)
            self._table.add(at, head.source, head.schema, len(envelope), at_s)


async def keep_listing(bus: Bus, clock: Clock, show: ShowRows) -> None:
    """Call ``show`` each second with all keys that have had messages so far, until cancelled."""
    keys = HeardKeys(bus, clock, [])
    try:
        await _keep_showing(clock, lambda: show(keys.rows()))
    finally:
        keys.close()


async def keep_hearing(bus: Bus, clock: Clock, classes: Classes, row: KeyRow, view: KeyView) -> None:
    """Show the arriving messages of one row of the list in ``view``, until cancelled."""

    def heard(key: str, message: Translated, at_s: float) -> None:
        if (message.source, message.schema) == (row.source, row.schema):
            body = heard_now(key, message, at_s).body
            view.take(body, message.stamp_s if message.source else at_s, message.sequence)

    of = address_of(f"scout/mission/{row.key}")
    async with overhearing(bus, clock, (row.key,), heard, classes, of):
        await asyncio.Event().wait()


async def keep_listing_recorded(recording: Recording, playback: Playback, show: ShowRows) -> None:
    """Call ``show`` each second with all keys of a recording, until cancelled; rates are per mission second.

    Raises:
        NoRecording: The recording is damaged from here on.
    """
    since_s = max(playback.begin_s, playback.now_s() - PARTS * PART_S)
    table = KeyTable(since_s, [(one.key, one.source, one.schema) for one in recording.contents().counts])

    async def follow() -> None:
        for _schema, _channel, record, one in recording.records(since_s=since_s):
            await playback.sleep_until_s(one.at_s)
            table.add(one.key, one.source, one.schema, len(record.data), one.at_s)
        await asyncio.Event().wait()

    showing = _keep_showing(playback, lambda: show(table.rows(playback.now_s())))
    await first_to_end(follow(), showing)


async def keep_reading(recording: Recording, playback: Playback, row: KeyRow, view: KeyView) -> None:
    """Show the messages of one row in ``view``: the last earlier one, those of the last minute, and later ones.

    Raises:
        NoRecording: The recording is damaged from here on.
    """
    async for said, _size_bytes in said_at(recording, playback, row, SPAN_S):
        view.take(said.body, said.at_s, said.sequence)
    await asyncio.Event().wait()


async def said_at(
    recording: Recording, playback: Playback, row: KeyRow, past_s: float = 0.0
) -> AsyncIterator[tuple[Recorded, int]]:
    """Yield the messages of one row, with their lengths, each not before its time.

    The first message is the last one before ``past_s`` seconds ago.

    Raises:
        NoRecording: The recording is damaged from here on.
    """
    since_s = max(playback.begin_s, playback.now_s() - past_s)
    before = recording.records((row.key,), until_s=since_s, source=row.source, newest_first=True)
    of_row = ((one, len(record.data)) for *_, record, one in islice(before, MOST_BEFORE) if one.schema == row.schema)
    if (last := await asyncio.to_thread(next, of_row, None)) is not None:
        yield last
    for *_, record, one in recording.records((row.key,), since_s, source=row.source):
        await playback.sleep_until_s(one.at_s)
        if one.schema == row.schema:
            yield one, len(record.data)


async def _keep_showing(clock: Clock, show: Callable[[], None]) -> None:
    while True:
        show()
        await clock.sleep_s(LIST_EACH_S * clock.rate)
