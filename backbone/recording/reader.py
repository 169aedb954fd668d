"""Reader of recordings; it needs neither the mission, nor its robots, nor the classes of the messages."""

from __future__ import annotations

import errno
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import IO, Any

import msgspec
from mcap.exceptions import McapError
from mcap.records import Channel, Message, Schema
from mcap.stream_reader import CRCValidationError
from zstandard import ZstdError

from backbone.errors import Refusal
from backbone.keys import is_key
from backbone.recording.chunks import messages_in
from backbone.recording.file_index import IndexedReader, MessagePlace, MessagePlaces, names_all
from backbone.recording.hearing import is_meant
from backbone.recording.translation import Translated
from backbone.recording.writer import ABOUT, NS, PROFILE

MOST_LEVELS = 850  # chosen: Python's limit of 1000 calls, less six times the calls that lead to its loop
NOTHING_OF_ONE = "Name a recording; this file has nothing of one."
DAMAGED = (McapError, CRCValidationError, ZstdError, ValueError, LookupError, OverflowError, MemoryError, struct.error)
_END_NS = 2**64  # MCAP specification: a time is a uint64
_MAGIC = b"\x89MCAP0\r\n"  # MCAP specification: the begin of every file


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
        self._name = name = getattr(file, "name", "the recording")
        if why := wrong_begin(file):
            raise NoRecording(f"{name}: no recording: {why}", remedy=NOTHING_OF_ONE)
        try:
            self._reader = IndexedReader(file)
            profile, summary = self._reader.get_header().profile, self._reader.get_summary()
        except (*DAMAGED, OSError) as error:
            raise NoRecording(f"{name}: no whole recording: {error}") from error
        if profile != PROFILE:
            raise NotOfMessages(f"{name}: the file is of profile {profile!r}, a recording of {PROFILE!r}")
        if not names_all(summary):
            raise NoRecording(f"{name}: the recording has no complete index")
        for key, _source, _schema in map(_named, summary.channels.values()):
            if key and not is_key(key):
                raise NotOfMessages(f"{name}: {key!r} is no key of a bus")
        self._file, self._summary, self._places = file, summary, MessagePlaces(file, summary)

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

    def channels(self) -> dict[int, tuple[str, str, str]]:
        """Return key, sender and schema of each channel; the key is empty if the messages themselves name it."""
        return {number: _named(channel) for number, channel in self._summary.channels.items()}

    def newest_first(self, channels: set[int], before_ns: int) -> Iterator[tuple[MessagePlace, int]]:
        """Yield the places of all messages before a time in these channels, with their channels; reads no message.

        Args:
            channels: The caller removes each channel whose earlier messages it does not need; without any, this ends.

        Raises:
            NoRecording: The recording is damaged.
        """
        with _refusing_damage(self._name):
            yield from self._places.newest_first(channels, before_ns)

    def at(self, channel: int, place: MessagePlace) -> Recorded:
        """Return the message of a channel at a place.

        Raises:
            NoRecording: The recording is damaged.
        """
        with _refusing_damage(self._name):
            return _recorded(self._summary.channels[channel], self._places.message(channel, place))

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

        def is_wanted(key: str, sender: str) -> bool:
            return (not patterns or is_meant(key, patterns)) and source in ("", sender)

        named = self.channels()
        wanted = {number for number, (key, sender, _schema) in named.items() if not key or is_wanted(key, sender)}
        begin_ns, end_ns = max(0, round(since_s * NS)), _END_NS if until_s is None else round(until_s * NS)
        index = self._summary
        found = messages_in(self._file, index.chunk_indexes, wanted, begin_ns, end_ns, newest_first=newest_first)
        with _refusing_damage(self._name):
            for message in found:
                channel = index.channels[message.channel_id]
                schema = index.schemas[channel.schema_id] if channel.schema_id else None
                recorded = _recorded(channel, message)
                if named[channel.id][0] or is_wanted(recorded.key, recorded.source):
                    yield schema, channel, message, recorded


@contextmanager
def _refusing_damage(name: object) -> Iterator[None]:
    try:
        yield
    except NotOfMessages as error:
        raise NotOfMessages(f"{name}: {error.detail}") from error
    except (*DAMAGED, OSError) as error:
        raise NoRecording(f"{name} is damaged: {error}") from error


def wrong_begin(file: IO[bytes]) -> str:
    """Return why the file cannot be a recording, by its first bytes; empty: it may be one."""
    file.seek(0)
    try:
        if file.read(len(_MAGIC)) == _MAGIC:
            return ""
    except OSError as error:  # of a broken disc
        return f"it cannot be read: {error.strerror or error}"
    return "it begins as another kind of file" if file.tell() else "the file is empty"


def open_file(path: Path) -> IO[bytes]:
    """Open the file of a recording for reading.

    Raises:
        OSError: It cannot be read; or it is a pipe or a device, which would be waited for, and has no end to begin at.
    """
    if path.exists() and not path.is_file() and not path.is_dir():
        raise OSError(errno.ESPIPE, "it is no regular file", str(path))
    return path.open("rb")


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
        why = "it is no object with stamp_s, heard_s, sequence, cause and body"
        raise NotOfMessages(f"the message at {at_s:.3f} s in {channel.topic} is none of a bus: {why}") from error
    numbers, texts = (found.stamp_s, found.heard_s, found.sequence), (found.key, found.source, found.cause)
    if not (all(isinstance(one, int | float) for one in numbers) and all(isinstance(one, str) for one in texts)):
        why = "it has no numbers or no texts where a message has them"
        raise NotOfMessages(f"the message at {at_s:.3f} s in {channel.topic} is none of a bus: {why}")
    return found
