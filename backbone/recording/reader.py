"""Reader of recordings; it needs neither the mission, nor its robots, nor the classes of the messages."""

from __future__ import annotations

import errno
import math
import os
import struct
import zlib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import IO, Any

import msgspec
from mcap.exceptions import McapError
from mcap.reader import SeekingReader
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import CRCValidationError
from mcap.summary import Summary
from zstandard import ZstdError

from backbone.errors import Refusal
from backbone.recording.hearing import is_meant
from backbone.recording.translation import Translated
from backbone.recording.writer import ABOUT, NS, PROFILE
from backbone.wire import MAX_LARGE_MESSAGE_BYTES

MOST_RECORD_BYTES = 2 * MAX_LARGE_MESSAGE_BYTES  # chosen: a whole chunk fits; a damaged length asks for terabytes
MOST_LEVELS = 850  # chosen: Python's limit of 1000 calls, less six times the calls that lead to its loop
NOTHING_OF_ONE = "Name a recording; this file has nothing of one."
DAMAGED = (McapError, CRCValidationError, ZstdError, ValueError, LookupError, OverflowError, MemoryError, struct.error)
_MAGIC = b"\x89MCAP0\r\n"  # MCAP specification: the begin of every file
_END = struct.Struct("<BQQQI8x")  # MCAP specification, op 0x02 and the magic: the end of every whole file


class NoRecording(Refusal):
    """The file is not a recording, or its end is missing."""

    code = "recording.unreadable"
    remedy = "End its recorder if it still runs. If it was killed: scout-backbone record recover FILE TO."


class NotOfMessages(NoRecording):
    """The file is complete, but not a recording of a bus; for example, it is a copy for other tools."""

    code = "recording.other"
    remedy = "Name the recording itself, which 'scout-backbone record' or 'up --record' wrote."


@dataclass(frozen=True, slots=True)
class Recorded:
    """A message in a recording.

    Attributes:
        key: Key expression on the bus; empty: not known.
        source: Address of the sender.
        schema: ``<Name>/<version>``; empty: the bytes were no message, or are nested too deeply to be decoded.
        at_s: Mission time of sending, by which the recording is ordered; if that is not credible, of arrival.
        stamp_s: Mission time of sending, as stated by the sender.
        heard_s: Mission time when the recorder got it.
        sequence: Its number among the sender's messages.
        cause: Id of the message that led to it.
        body: Its fields by name. If no installed package had its class: a list without names, or else the bytes.
    """

    key: str
    source: str
    schema: str
    at_s: float
    stamp_s: float
    heard_s: float
    sequence: int
    cause: str
    body: Any

    @property
    def id(self) -> str:
        """``<source>#<sequence>``, as causes name it."""
        return f"{self.source}#{self.sequence}"


@dataclass(slots=True)
class KeyCount:
    """Number of messages of one key, sender and schema in a recording."""

    key: str
    source: str
    schema: str
    messages: int


@dataclass(slots=True)
class Contents:
    """Summary of a recording.

    Attributes:
        about: Facts about the mission.
        begin_s: Mission time of its first message.
        end_s: Mission time of its last message.
        messages: Number of its messages.
        counts: Numbers by key, sender and schema, in the order of keys.
    """

    about: dict[str, str] = field(default_factory=dict)
    begin_s: float = 0.0
    end_s: float = 0.0
    messages: int = 0
    counts: list[KeyCount] = field(default_factory=list)


class Recording:
    """A recording in a file.

    Args:
        file: Must stay open while the recording is used; not closed here.

    Raises:
        NoRecording: The file is not a recording, or its recorder was killed; ``NotOfMessages``: it has other content.
    """

    def __init__(self, file: IO[bytes]) -> None:
        file.seek(0)
        if file.read(len(_MAGIC)) != _MAGIC:
            why = "it begins as another kind of file" if file.tell() else "the file is empty"
            raise NoRecording(f"no recording: {why}", remedy=NOTHING_OF_ONE)
        try:
            check_index(file)
            self._reader = SeekingReader(file, validate_crcs=True, record_size_limit=MOST_RECORD_BYTES)
            profile, summary = self._reader.get_header().profile, self._reader.get_summary()
        except (*DAMAGED, OSError) as error:
            raise NoRecording(f"no whole recording: {error}") from error
        if profile != PROFILE:
            raise NotOfMessages(f"the file is of profile {profile!r}, a recording of {PROFILE!r}")
        if summary is None or not names_all(summary):
            raise NoRecording("the recording has no complete index")
        self._summary: Summary = summary
        self._name = getattr(file, "name", "the recording")

    def contents(self) -> Contents:
        """Return the summary, from the index and the facts about the mission alone.

        Raises:
            NoRecording: The facts are damaged.
        """
        statistics = self._summary.statistics
        assert statistics is not None  # noqa: S101  checked when it was opened
        counted = statistics.channel_message_counts
        counts = [
            KeyCount(*_named(channel), counted.get(number, 0)) for number, channel in self._summary.channels.items()
        ]
        with _refusing_damage(self._name):
            about = next((one.metadata for one in self._reader.iter_metadata() if one.name == ABOUT), {})
        return Contents(
            dict(about),
            statistics.message_start_time / NS,
            statistics.message_end_time / NS,
            statistics.message_count,
            sorted(counts, key=lambda one: (one.key, one.source, one.schema)),
        )

    def mission_xml(self) -> str:
        """Return the mission file; empty: the recorder did not have it.

        Raises:
            NoRecording: The mission file is damaged.
        """
        with _refusing_damage(self._name):
            files = (one for one in self._reader.iter_attachments() if one.name == "mission.xml")
            found = next(files, None)
            return found.data.decode() if found is not None else ""

    def messages(
        self,
        patterns: tuple[str, ...] = (),
        since_s: float = 0.0,
        until_s: float | None = None,
        source: str = "",
        *,
        newest_first: bool = False,
    ) -> Iterator[Recorded]:
        """Yield the messages in the order of sending.

        Args:
            patterns: Only keys that match one of these; none: all. ``scout/<mission>/`` may be left out.
            since_s: Earliest mission time.
            until_s: Latest mission time; None: to the end.
            source: Only messages of this sender; empty: all senders.
            newest_first: True: the opposite order.
        """
        records = self.records(patterns, since_s, until_s, source, newest_first=newest_first)
        for _schema, _channel, _message, recorded in records:
            yield recorded

    def records(
        self,
        patterns: tuple[str, ...] = (),
        since_s: float = 0.0,
        until_s: float | None = None,
        source: str = "",
        *,
        newest_first: bool = False,
    ) -> Iterator[tuple[Schema | None, Channel, Message, Recorded]]:
        """Yield the messages, see ``messages``, with their records in the file."""
        if until_s is not None and until_s < since_s:
            return
        named = [(channel.topic, *_named(channel)[:2]) for channel in self._summary.channels.values()]
        topics = {
            topic
            for topic, key, sender in named
            if not key or ((not patterns or is_meant(key, patterns)) and source in ("", sender))
        }
        end_ns = None if until_s is None else round(until_s * NS)
        begin_ns = max(0, round(since_s * NS))
        found = self._reader.iter_messages(topics, starting_at=begin_ns, ending_at=end_ns, reverse=newest_first)
        with _refusing_damage(self._name):
            for schema, channel, message in found:
                recorded = _recorded(channel, message)
                if (not patterns or is_meant(recorded.key, patterns)) and source in ("", recorded.source):
                    yield schema, channel, message, recorded


@contextmanager
def _refusing_damage(name: object) -> Iterator[None]:
    try:
        yield
    except NotOfMessages as error:
        raise NotOfMessages(f"{name}: {error.detail}") from error
    except DAMAGED as error:
        raise NoRecording(f"{name} is damaged: {error}") from error


def open_file(path: Path) -> IO[bytes]:
    """Open the file of a recording for reading.

    Raises:
        OSError: It cannot be read; or it is a pipe or a device, which would be waited for, and has no end to begin at.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.ESPIPE, "it is no regular file", str(path))
    return path.open("rb")


def missing_numbers(messages: Iterable[Recorded]) -> dict[str, int]:
    """Return sender → number of messages missing between its first and its last, only for senders that miss any.

    Each sender numbers its messages, and a restarted sender begins again. Messages that are missing between the end of
    a sender and its restart are unknown. A number is missing if its message was lost, if its key was not recorded, or
    if it is a question without an answer. A question from before the begin, whose answer came later, does not count.

    Args:
        messages: In the order of sending.
    """
    lives: dict[str, list[_SenderLife]] = {}
    began_s = math.inf
    for message in messages:
        began_s = min(began_s, message.heard_s)
        if message.source:
            own = lives.setdefault(message.source, [])
            if not own or own[-1].is_over(message):
                own.append(_SenderLife())
            own[-1].take(message, began_s)
    missing = {source: sum(life.gaps(began_s) for life in own) for source, own in sorted(lives.items())}
    return {source: count for source, count in missing.items() if count}


@dataclass(slots=True)
class _SenderLife:
    """The message numbers of one life of a sender; it takes the same memory however many they are.

    Attributes:
        newest: Largest number.
        lowest: Smallest number that counts.
        highest: Largest number that counts.
        count: How many count.
        at_s: Mission time of the newest message.
        together: Numbers of that time; only these come in any order.
        early: Times and numbers of messages that were sent before the recorder heard any; they do not count yet.
    """

    newest: float = -math.inf
    lowest: float = math.inf
    highest: float = -math.inf
    count: int = 0
    at_s: float = -math.inf
    together: set[int] = field(default_factory=set)
    early: list[tuple[float, int]] = field(default_factory=list)

    def is_over(self, message: Recorded) -> bool:
        """Return whether this message begins the sender's next life."""
        return message.sequence <= self.newest and message.at_s > self.at_s

    def take(self, message: Recorded, began_s: float) -> None:
        """Note the number of a message."""
        if message.at_s != self.at_s:
            self.at_s, self.together = message.at_s, set()
        if message.sequence in self.together:
            return
        self.together.add(message.sequence)
        self.newest = max(self.newest, message.sequence)
        if message.at_s < began_s:
            self.early.append((message.at_s, message.sequence))
        else:
            self._count(message.sequence)

    def gaps(self, began_s: float) -> int:
        """Return how many numbers between the lowest and the highest are missing; messages before the begin are not."""
        for at_s, number in self.early:
            if at_s >= began_s:
                self._count(number)
        return int(self.highest - self.lowest) + 1 - self.count if self.count else 0

    def _count(self, number: int) -> None:
        self.lowest, self.highest = min(self.lowest, number), max(self.highest, number)
        self.count += 1


def check_index(file: IO[bytes]) -> None:
    """Return if the index is as it was written; the library checks only the messages.

    Raises:
        ValueError: The index is damaged, or the file has no end.
    """
    end = file.seek(0, os.SEEK_END) - _END.size
    if end < 0:
        raise ValueError("it is too short")
    file.seek(end)
    footer = file.read(_END.size)
    _operation, _length, begin, _offsets, checksum = _END.unpack(footer)
    if not 0 < begin <= end:
        raise ValueError("it has no index")
    file.seek(begin)
    if zlib.crc32(file.read(end - begin) + footer[: _END.size - 12]) != checksum:
        raise ValueError("its index is damaged")
    file.seek(0)


def names_all(index: Summary) -> bool:
    """Return whether the index leads to all messages and facts of its file; other writers may leave parts of it out.

    Without it, the library reads messages unchecked and only forwards, and finds no facts.
    """
    numbers = index.statistics
    return numbers is not None and (
        (numbers.chunk_count > 0 or not numbers.message_count)
        and numbers.chunk_count == len(index.chunk_indexes)
        and numbers.metadata_count == len(index.metadata_indexes)
        and numbers.attachment_count == len(index.attachment_indexes)
        and numbers.schema_count == len(index.schemas)
        and numbers.channel_count == len(index.channels)
    )


def _named(channel: Channel) -> tuple[str, str, str]:
    about = channel.metadata
    return about.get("key", channel.topic), about.get("source", ""), about.get("schema", "")


def heard_now(key: str, message: Translated, at_s: float) -> Recorded:
    """Return a live message in the form of a recorded one."""
    if not message.schema:
        return Recorded(key, message.source, "", at_s, at_s, at_s, message.sequence, "", message.data)
    return Recorded(key, message.source, message.schema, at_s, **msgspec.json.decode(message.data))


def _decoded(data: bytes) -> Any:
    """Return the value of a JSON text; raise ``RecursionError`` if a call for each of its levels would be too much.

    From Python 3.12 on, the decoder has a limit of its own, which is higher than that of calls.
    """
    value = msgspec.json.decode(data)
    levels, inside = 0, [value] if data.count(b"[") + data.count(b"{") > MOST_LEVELS else []
    while inside := [one for one in inside if isinstance(one, dict | list)]:
        if (levels := levels + 1) > MOST_LEVELS:
            raise RecursionError(f"more than {MOST_LEVELS} values inside each other")
        inside = [*chain.from_iterable(one.values() if isinstance(one, dict) else one for one in inside)]
    return value


def _recorded(channel: Channel, message: Message) -> Recorded:
    key, source, schema = _named(channel)
    at_s = message.log_time / NS
    if channel.message_encoding != "json":
        return Recorded(key, source, schema, at_s, at_s, at_s, message.sequence, "", message.data)
    try:
        said = _decoded(message.data)
    except RecursionError:
        return Recorded(key, source, "", at_s, at_s, at_s, message.sequence, "", message.data)
    try:
        found = Recorded(**({"key": key, "source": source} | said), schema=schema, at_s=at_s)
    except TypeError as error:
        raise NotOfMessages(f"the message at {at_s:.3f} s in {channel.topic} is none of a bus: {error}") from error
    numbers, texts = (found.stamp_s, found.heard_s, found.sequence), (found.key, found.source, found.cause)
    if not (all(isinstance(one, int | float) for one in numbers) and all(isinstance(one, str) for one in texts)):
        why = "it has no numbers or no texts where a message has them"
        raise NotOfMessages(f"the message at {at_s:.3f} s in {channel.topic} is none of a bus: {why}")
    return found
