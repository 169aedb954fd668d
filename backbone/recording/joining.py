"""Joins the files of several recorders of one mission into one recording.

Rules of this file:

* Each message occurs once, although several recorders received it: sender, number and stamp are equal in all copies.
* Messages are in the order of mission time. If causes show that the clock of a host was off, ``log_time`` is
  corrected by that offset, so that no message precedes its cause; ``publish_time`` and ``stamp_s`` stay as sent.
* Files are read twice, chunk by chunk: once for the clocks, once to be written.
"""

from __future__ import annotations

import heapq
import itertools
import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import datetime
from operator import itemgetter
from typing import IO

from mcap.records import Channel, Message, Schema

from backbone.errors import Refusal
from backbone.recording.clock_offsets import ClockObserver, ClockOffsets
from backbone.recording.reader import NotOfMessages, Recorded, Recording
from backbone.recording.writer import MOST_CHANNELS, NS, begun_writer

SAME_BEGIN_S = 2.0  # chosen: no mission ends and begins again so soon; only for recordings without the fact ``start``

Placed = tuple[int, Schema | None, Channel, Message, Recorded]
"""Corrected ``log_time`` of a message, and its records."""


class OtherMission(Refusal):
    """The recordings are of different missions, or of different starts of one."""

    code = "recording.other_mission"
    remedy = "Join only recordings of one mission that were made between one 'up' and its 'down'."


class TooManyKeys(Refusal):
    """The recordings have more keys, senders and schemas together than one file can hold."""

    code = "recording.keys"
    remedy = "Join fewer recordings, or record fewer keys."


@dataclass(frozen=True, slots=True)
class Joined:
    """The result of a join.

    Attributes:
        messages: Number of messages in the new recording.
        left_out: Number of omitted copies, which other files contain too.
        clocks: The clocks that causes bound; ``log_time`` is corrected by them.
    """

    messages: int
    left_out: int
    clocks: ClockOffsets


def join(recordings: Sequence[Recording], to: IO[bytes]) -> Joined:
    """Write all messages of these recordings (at least one recording) to a new one.

    Raises:
        OtherMission: The recordings are not of one start of one mission.
        NoRecording: A recording is damaged; the new file is not a recording.
        TooManyKeys: One file cannot hold all keys.
    """
    facts = _common_facts([recording.contents().about for recording in recordings])
    clocks = _clocks(recordings)
    if clocks.wrong:
        facts["clock_offsets_s"] = json.dumps({host: offset.taken_s for host, offset in clocks.wrong.items()})
    writer = _JoinedWriter(to, facts, next(filter(None, (one.mission_xml() for one in recordings)), ""))
    heard = 0
    for placed in _each_once(heapq.merge(*_by_clock(recordings, clocks), key=itemgetter(0))):
        heard += 1
        if placed is not None:
            writer.write(placed)
    writer.finish()
    return Joined(writer.written, heard - writer.written, clocks)


def _clocks(recordings: Sequence[Recording]) -> ClockOffsets:
    observer = ClockObserver()
    for message in heapq.merge(*(one.messages() for one in recordings), key=lambda one: one.at_s):
        observer.take(message)
    return observer.offsets()


def _common_facts(facts: Sequence[dict[str, str]]) -> dict[str, str]:
    """Return the facts about the mission; if a fact differs between recorders, all its values.

    Raises:
        OtherMission: The recordings are not of one start of one mission.
        NotOfMessages: The begin of one is no time of day.
    """
    missions = sorted({one.get("mission", "") for one in facts})
    if len(missions) > 1:
        raise OtherMission(f"the recordings are of the missions {', '.join(map(repr, missions))}")
    begins = sorted(_time_of_day(one["begun"]) for one in facts if "begun" in one)
    is_apart = bool(begins) and (begins[-1] - begins[0]).total_seconds() > SAME_BEGIN_S
    starts = {one.get("start", "") for one in facts}
    if len(starts - {""}) > 1 or (is_apart and "" in starts):
        different = ", ".join(dict.fromkeys(map(str, begins)))
        raise OtherMission(f"the recordings are of different starts of mission {missions[0]}: {different}")
    names = dict.fromkeys(name for one in facts for name in one)
    common = {name: ", ".join(dict.fromkeys(one[name] for one in facts if name in one)) for name in names}
    if begins:
        common["begun"] = begins[0].isoformat(timespec="milliseconds")
    return common


def _time_of_day(text: str) -> datetime:
    with suppress(ValueError):
        found = datetime.fromisoformat(text)
        if found.tzinfo is not None:
            return found
    raise NotOfMessages(f"a recording has begun at {text!r}, which is no time of day with a time zone")


def _by_clock(recordings: Sequence[Recording], clocks: ClockOffsets) -> Iterator[Iterator[Placed]]:
    """Yield, for each recording and each different offset, the messages of that offset in corrected order."""
    offsets = {offset.taken_s for offset in clocks.offsets.values()} | {0.0}
    for recording, offset_s in itertools.product(recordings, sorted(offsets)):
        yield _of_clock(recording, clocks, offset_s)


def _of_clock(recording: Recording, clocks: ClockOffsets, offset_s: float) -> Iterator[Placed]:
    for schema, channel, message, recorded in recording.records():
        is_stamped = recorded.schema and abs(recorded.stamp_s - recorded.at_s) < 1 / NS
        if (clocks.of(recorded.source) if is_stamped else 0.0) == offset_s:
            yield max(0, message.log_time - round(offset_s * NS)), schema, channel, message, recorded


def _each_once(messages: Iterable[Placed]) -> Iterator[Placed | None]:
    """Yield each message, and None for each further copy; all copies have the same time.

    Presence is not a message: each recorder writes its own observation. Only changes of presence are yielded.
    """
    alive: dict[str, bool] = {}
    for _at, together in itertools.groupby(messages, itemgetter(0)):
        seen = set[object]()
        for placed in together:
            _ns, _schema, _channel, message, said = placed
            match said.schema, said.body:
                case "Presence/1", {"alive": bool(is_alive)}:  # of any other form it is foreign
                    is_new = alive.get(said.key) is not is_alive
                    alive[said.key] = is_alive
                case _:
                    is_named = bool(said.source)
                    name = (said.key, said.source, said.sequence, said.schema) if is_named else (said.key, message.data)
                    is_new = name not in seen
                    seen.add(name)
            yield placed if is_new else None


class _JoinedWriter:
    """Writes records of several files into one, with numbers of its own for schemas and channels."""

    def __init__(self, to: IO[bytes], facts: dict[str, str], mission_xml: str) -> None:
        self._writer = begun_writer(to, facts, mission_xml)
        self._schemas: dict[tuple[str, str, bytes], int] = {}
        self._channels: dict[tuple[str, str, int, tuple[tuple[str, str], ...]], int] = {}
        self.written = 0

    def write(self, placed: Placed) -> None:
        log_time, schema, channel, message, _said = placed
        number = self._channel(channel, self._schema(schema) if schema is not None else 0)
        self._writer.add_message(number, log_time, message.data, message.publish_time, message.sequence)
        self.written += 1

    def finish(self) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]

    def _schema(self, schema: Schema) -> int:
        same = schema.name, schema.encoding, schema.data
        known = self._schemas.get(same)
        if known is None:
            known = self._schemas[same] = self._writer.register_schema(*same)
        return known

    def _channel(self, channel: Channel, schema: int) -> int:
        same = channel.topic, channel.message_encoding, schema, tuple(sorted(channel.metadata.items()))
        known = self._channels.get(same)
        if known is None:
            if len(self._channels) >= MOST_CHANNELS:
                raise TooManyKeys(f"the recordings have more than {MOST_CHANNELS} keys, senders and schemas")
            made = self._writer.register_channel(channel.topic, channel.message_encoding, schema, channel.metadata)
            known = self._channels[same] = made
        return known
