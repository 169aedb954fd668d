"""The index at the end of an MCAP file: whether it is whole, and the messages that it leads to. Pure.

The index of an hour names some thousand chunks, each with dozens of channels. The library makes an object of each, a
dozen times the size of the file's own form. Here they stay packed, and are unpacked chunk by chunk.
"""

from __future__ import annotations

import io
import os
import struct
import sys
import zlib
from collections.abc import Container, Iterable, Iterator, Mapping
from functools import lru_cache, partial
from typing import IO, NamedTuple, cast

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.reader import SeekingReader
from mcap.records import AttachmentIndex, Channel, ChunkIndex, Message, MessageIndex, MetadataIndex, Schema, Statistics
from mcap.stream_reader import MAGIC_SIZE, StreamReader
from mcap.summary import Summary

from backbone.recording.chunks import MOST_RECORD_BYTES, chunk_records, message_at, record_at

_END = struct.Struct("<BQQQI8x")  # MCAP specification, op 0x02 and the magic: the end of every whole file
_BEGIN = struct.Struct("<BQ")  # MCAP specification: the kind and the length of a record
_OFFSET = struct.Struct("<HQ")  # MCAP specification, op 0x08: an entry of message_index_offsets
_CHUNK_HEAD = struct.Struct("<QQQQI")  # MCAP specification, op 0x08: the fields before these entries
_AFTER_OFFSETS = struct.Struct("<QI")  # message_index_length, length of the compression's name
_SIZES = struct.Struct("<QQ")  # compressed, uncompressed
KEPT_CHUNKS = 4  # chosen: messages that are read together stand in few chunks, of some 250 kB


class Offsets(Mapping[int, int]):
    """Channel of a chunk → place of its message index in the file, in the form of the file."""

    __slots__ = ("_packed",)

    def __init__(self, packed: bytes) -> None:
        self._packed = packed

    def __getitem__(self, channel: int) -> int:
        return dict(self.pairs())[channel]

    def __iter__(self) -> Iterator[int]:
        return (channel for channel, _offset in _OFFSET.iter_unpack(self._packed))

    def __len__(self) -> int:
        return len(self._packed) // _OFFSET.size

    def pairs(self) -> Iterator[tuple[int, int]]:
        """Yield channels and places."""
        return cast("Iterator[tuple[int, int]]", _OFFSET.iter_unpack(self._packed))


class IndexedReader(SeekingReader):
    """The library's reader, with an index that takes as much memory as in the file.

    Raises:
        ValueError: The index is damaged, or the file has no end.
    """

    def __init__(self, file: IO[bytes]) -> None:
        self._index = _summary_in(_checked_index(file))
        super().__init__(file, validate_crcs=True, record_size_limit=MOST_RECORD_BYTES)

    def get_summary(self) -> Summary:
        """Return the index."""
        return self._index


def _checked_index(file: IO[bytes]) -> bytes:
    """Return the bytes of the index; the library checks only the messages. A checksum of 0 means that there is none."""
    end = file.seek(0, os.SEEK_END) - _END.size
    if end < 0:
        raise ValueError("it is too short")
    file.seek(end)
    footer = file.read(_END.size)
    _operation, _length, begin, _offsets, checksum = _END.unpack(footer)
    if not 0 < begin <= end:
        raise ValueError("it has no index")
    file.seek(begin)
    found = file.read(end - begin)
    if checksum and zlib.crc32(found + footer[: _END.size - 12]) != checksum:
        raise ValueError("its index is damaged")
    file.seek(0)
    return found + footer


def _summary_in(index: bytes) -> Summary:
    """Return the index in these bytes, which end with the footer and the magic."""
    summary, others, at = Summary(), io.BytesIO(), 0
    while at < len(index) - MAGIC_SIZE:
        kind, length = _BEGIN.unpack_from(index, at)
        end = at + _BEGIN.size + length
        if kind == Opcode.CHUNK_INDEX:
            summary.chunk_indexes.append(_chunk_index(index[at + _BEGIN.size : end]))
        else:
            others.write(index[at:end])
        at = end
    if at != len(index) - MAGIC_SIZE:
        raise ValueError("its index is damaged")
    others.write(index[-MAGIC_SIZE:])
    others.seek(0)
    for record in StreamReader(others, skip_magic=True, record_size_limit=MOST_RECORD_BYTES).records:
        match record:
            case Statistics():
                summary.statistics = record
            case Schema():
                summary.schemas[record.id] = record
            case Channel():
                summary.channels[record.id] = record
            case AttachmentIndex():
                summary.attachment_indexes.append(record)
            case MetadataIndex():
                summary.metadata_indexes.append(record)
    return summary


def _chunk_index(record: bytes) -> ChunkIndex:
    begin_ns, end_ns, offset, length, packed = _CHUNK_HEAD.unpack_from(record)
    rest = _CHUNK_HEAD.size + packed
    index_length, name_length = _AFTER_OFFSETS.unpack_from(record, rest)
    name = rest + _AFTER_OFFSETS.size
    compressed, uncompressed = _SIZES.unpack_from(record, name + name_length)
    return ChunkIndex(
        message_start_time=begin_ns,
        message_end_time=end_ns,
        chunk_start_offset=offset,
        chunk_length=length,
        message_index_offsets=cast("dict[int, int]", Offsets(record[_CHUNK_HEAD.size : rest])),
        message_index_length=index_length,
        compression=sys.intern(record[name : name + name_length].decode()),
        compressed_size=compressed,
        uncompressed_size=uncompressed,
    )


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
        and all(len(one.message_index_offsets) or not one.message_end_time for one in index.chunk_indexes)
    )


class MessagePlace(NamedTuple):
    """Where a message is in a file; places are ordered as their messages are read.

    Attributes:
        at_ns: Its time.
        chunk: Place of its chunk in the file.
        offset: Its place among the records of the chunk.
    """

    at_ns: int
    chunk: int
    offset: int


class MessagePlaces:
    """Finds messages of a file by its index, without reading the messages before them.

    Args:
        file: Must stay open while this is used.
    """

    def __init__(self, file: IO[bytes], index: Summary) -> None:
        self._file = file
        self._chunks = sorted(index.chunk_indexes, key=lambda one: one.message_end_time, reverse=True)
        self._records = lru_cache(KEPT_CHUNKS)(partial(chunk_records, file))

    def newest_first(self, channels: set[int], before_ns: int) -> Iterator[tuple[MessagePlace, int]]:
        """Yield the places of all messages before a time in these channels, with their channels.

        Args:
            channels: The caller removes each channel whose earlier messages it does not need; without any, this ends.

        Raises:
            ValueError: The file is damaged.
        """
        ahead = list[tuple[MessagePlace, int]]()
        for chunk in self._chunks:
            while ahead and ahead[-1][0].at_ns > chunk.message_end_time:
                yield from _still(channels, [ahead.pop()])
            if not channels:
                return
            if chunk.message_start_time < before_ns:
                for channel, at in _offsets(chunk).pairs():
                    if channel in channels:
                        ahead += [(place, channel) for place in self._places(chunk, channel, at, before_ns)]
                ahead.sort()
        yield from _still(channels, reversed(ahead))

    def message(self, channel: int, place: MessagePlace) -> Message:
        """Return the message at a place.

        Raises:
            ValueError: The file is damaged.
        """
        found = message_at(self._records(place.chunk), place.offset)
        if found is None or (found.channel_id, found.log_time) != (channel, place.at_ns):
            raise ValueError("its index leads to another message")
        return found

    def _places(self, chunk: ChunkIndex, channel: int, at: int, before_ns: int) -> list[MessagePlace]:
        """Return the places of the messages of a channel in a chunk before a time."""
        found = record_at(self._file, at, Opcode.MESSAGE_INDEX)
        index = MessageIndex.read(ReadDataStream(io.BytesIO(found)))
        if index.channel_id != channel:
            raise ValueError("its index names another channel")
        return [MessagePlace(ns, chunk.chunk_start_offset, offset) for ns, offset in index.records if ns < before_ns]


def _still(channels: Container[int], found: Iterable[tuple[MessagePlace, int]]) -> Iterator[tuple[MessagePlace, int]]:
    return ((place, channel) for place, channel in found if channel in channels)


def _offsets(chunk: ChunkIndex) -> Offsets:
    return cast("Offsets", chunk.message_index_offsets)
