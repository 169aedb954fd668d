"""Recovering: writes the readable messages of a damaged recording, or of a killed recorder, to a whole recording.

Rules of this file: a damaged chunk costs its own messages alone, and is counted. The facts about the mission and the
mission file cost themselves alone, too, if their own lengths are whole. Chunks are found by the index. Without one, of
a file that is cut, or damaged between two records, the messages before that place are kept, and the command prints the
length of the rest.
"""

from __future__ import annotations

import io
import os
import struct
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, NamedTuple, cast

from mcap.data_stream import RecordBuilder
from mcap.exceptions import EndOfFile
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, DataEnd, Footer, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import MAGIC_SIZE, StreamReader, breakup_chunk
from mcap.summary import Summary

from backbone.recording.chunks import MOST_RECORD_BYTES
from backbone.recording.file_index import IndexedReader, names_all
from backbone.recording.reader import DAMAGED, NOTHING_OF_ONE, NoRecording, NotOfMessages, open_file, wrong_begin
from backbone.recording.writer import PROFILE, begun_writer

_OTHER_PROFILES = {"", "ros1", "ros2", "px4"}  # none, and the well-known ones of the MCAP specification
_BEGIN = struct.Struct("<BQ")  # MCAP specification: the kind and the length of a record
_FACTS = (Opcode.METADATA, Opcode.ATTACHMENT)
_CHUNK_BYTES = 49  # MCAP specification, op 0x06: all but the compression's name and the records


class Recovered(NamedTuple):
    """The messages that were written, and the parts of the file that were not.

    Attributes:
        messages: Number of messages in the new recording.
        damaged: Number of parts that cannot be read: chunks, of some 250 kB, the facts, or the mission file.
        unread_bytes: Length of the end of the file, after the last place at which it can be read; 0: read to its end.
    """

    messages: int
    damaged: int
    unread_bytes: int


class _WholeRecording:
    """A recording that is being written from records of another one."""

    def __init__(self, to: IO[bytes]) -> None:
        self._writer = begun_writer(to)
        self._schemas: dict[int, int] = {0: 0}
        self._channels: dict[int, int] = {}
        self.messages = 0

    def take(self, record: McapRecord) -> None:
        """Write the record; one that is written already, or of no use, is not."""
        match record:
            case Header(profile=profile) if profile in _OTHER_PROFILES:  # any other may be damaged
                raise NotOfMessages(f"the file is of profile {profile!r}, a recording of {PROFILE!r}")
            case Schema() if record.id not in self._schemas:
                self._schemas[record.id] = self._writer.register_schema(record.name, record.encoding, record.data)
            case Channel() if record.id not in self._channels:
                about = (record.topic, record.message_encoding, self._schemas[record.schema_id], record.metadata)
                self._channels[record.id] = self._writer.register_channel(*about)
            case Message():
                at = (record.log_time, record.data, record.publish_time, record.sequence)
                self._writer.add_message(self._channels[record.channel_id], *at)
                self.messages += 1
            case Metadata():
                self._writer.add_metadata(record.name, record.metadata)
            case Attachment():
                about_file = (record.name, record.media_type, record.data)
                self._writer.add_attachment(record.create_time, record.log_time, *about_file)

    def finish(self) -> None:
        """Write the index."""
        self._writer.finish()  # type: ignore[no-untyped-call]


def recover(damaged: IO[bytes], to: IO[bytes]) -> Recovered:
    """Write a whole recording with all messages that can be read; return how many.

    Raises:
        NoRecording: Not even the begin is there; ``NotOfMessages``: it is another program's file.
    """
    whole, lost, has_begun, has_all = _WholeRecording(to), 0, False, False
    index = _index(damaged)
    if index is not None and _is_of_a_bus(damaged):
        lost = _take_by_index(whole, damaged, index)
        whole.finish()
        return Recovered(whole.messages, lost, 0)
    if why := wrong_begin(damaged):
        raise NoRecording(f"no recording: {why}", remedy=NOTHING_OF_ONE)
    read_to = damaged.seek(0)
    try:
        for record in _each_record(damaged):
            has_begun, has_all = True, has_all or isinstance(record, DataEnd)
            if record is None:
                lost += 1
            elif isinstance(record, Chunk):
                lost += not _took_chunk(whole, record)
            else:
                whole.take(record)
            read_to = read_to + _size(record) if isinstance(record, Chunk) else damaged.tell()
        read_to = damaged.tell()  # also after the footer and the magic
    except DAMAGED as error:
        if not has_begun:
            raise NoRecording("no recording: its first record is cut or damaged", remedy=NOTHING_OF_ONE) from error
        read_to = damaged.seek(0, os.SEEK_END) if has_all else read_to  # the index follows; it is written again
    whole.finish()
    size = damaged.seek(0, os.SEEK_END)  # only now: its recorder may still write it
    return Recovered(whole.messages, lost, size - read_to)


def _take_by_index(whole: _WholeRecording, damaged: IO[bytes], index: Summary) -> int:
    """Take all that the index names; return how many parts could not be read, or not in full."""
    for name in (*index.schemas.values(), *index.channels.values()):  # those of a damaged chunk too
        with suppress(LookupError):
            whole.take(name)
    lost = 0
    places = [(one.offset, one.length) for one in index.metadata_indexes]
    places += [(one.offset, one.length) for one in index.attachment_indexes]
    for place, length in places:
        damaged.seek(place)
        found = _facts(damaged.read(min(length, MOST_RECORD_BYTES)))
        if found is not None:
            whole.take(found)
        lost += found is None
    for place in sorted(one.chunk_start_offset for one in index.chunk_indexes):
        damaged.seek(place)
        try:
            chunk = next(_records(damaged, skip_magic=True), None)
        except DAMAGED:
            chunk = None
        lost += not (isinstance(chunk, Chunk) and _took_chunk(whole, chunk))
    return lost


def _each_record(file: IO[bytes]) -> Iterator[McapRecord | None]:
    """Yield the records; None: facts that cannot be read, in which the library would lose its place."""
    first = next(_records(file, skip_magic=False))
    yield first
    while True:
        at = file.tell()
        kind, length = _BEGIN.unpack(file.read(_BEGIN.size))
        file.seek(at)
        if kind in _FACTS and length < MOST_RECORD_BYTES:
            data = file.read(_BEGIN.size + length)
            if len(data) < _BEGIN.size + length:
                raise EndOfFile
            yield _facts(data)
            continue
        record = next(_records(file, skip_magic=True))
        if isinstance(record, Footer):
            file.read(MAGIC_SIZE)
            return
        yield record


def _facts(data: bytes) -> Metadata | Attachment | None:
    """Return the facts in a record; None: written again they would be other bytes, so these are damaged."""
    try:
        record = next(_records(io.BytesIO(data), skip_magic=True), None)
    except DAMAGED:
        return None
    if not isinstance(record, Metadata | Attachment):
        return None
    again = RecordBuilder()
    record.write(again)
    return record if again.end() == data else None  # type: ignore[no-untyped-call]


def _records(file: IO[bytes], *, skip_magic: bool) -> Iterator[McapRecord]:
    options = {"skip_magic": skip_magic, "emit_chunks": True, "validate_crcs": True}
    return StreamReader(cast("Any", file), **options, record_size_limit=MOST_RECORD_BYTES).records


def _is_of_a_bus(file: IO[bytes]) -> bool:
    file.seek(0)
    try:
        header = next(_records(file, skip_magic=False), None)
    except DAMAGED:
        header = None
    file.seek(0)
    return isinstance(header, Header) and header.profile == PROFILE


def _size(chunk: Chunk) -> int:
    """Return the bytes of a chunk in its file; with a wrong length, the library skips all that follows it."""
    return _CHUNK_BYTES + len(chunk.compression) + len(chunk.data)


def recover_file(path: Path, to: Path) -> Recovered:
    """Write the readable messages of a recording to a new file; the file exists only if this succeeds.

    Raises:
        NoRecording: It is none.
        FileExistsError: The new file exists.
        OSError: One of them cannot be opened, or there is no room for the new one.
    """
    with open_file(path) as damaged, to.open("xb") as made:
        try:
            return recover(damaged, made)
        except BaseException as error:
            to.unlink()
            if isinstance(error, NoRecording):
                raise type(error)(f"{path}: {error.detail}", remedy=error.remedy) from error
            raise


def _took_chunk(whole: _WholeRecording, chunk: Chunk) -> bool:
    """Take the records of a chunk; return whether all of them could be read."""
    try:
        records = breakup_chunk(chunk, validate_crc=True)
    except DAMAGED:
        return False
    took = True
    for record in records:
        try:
            whole.take(record)
        except LookupError:  # its channel stood in a damaged chunk, and there is no index
            took = False
    return took


def _index(file: IO[bytes]) -> Summary | None:
    """Return the index; None: it is damaged, incomplete or not there."""
    try:
        found = IndexedReader(file).get_summary()
        return found if names_all(found) else None
    except (*DAMAGED, OSError):
        return None
    finally:
        file.seek(0)
