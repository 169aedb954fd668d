"""The chunks of an MCAP file, and the messages in them in the order of their times. Pure.

The library makes an object of each record of a chunk, and orders these objects by a method of Python. Here a record of
no wanted channel costs only the reading of its head.
"""

from __future__ import annotations

import heapq
import io
import struct
from collections.abc import Iterator, Sequence, Set
from typing import IO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Chunk, ChunkIndex, Message
from mcap.stream_reader import get_chunk_data_stream

from backbone.wire import MAX_LARGE_MESSAGE_BYTES

_BEGIN = struct.Struct("<BQ")  # MCAP specification: the kind and the length of a record
_MESSAGE = struct.Struct("<HIQQ")  # MCAP specification, op 0x05: channel, sequence, log_time, publish_time
_OF_MESSAGE = int(Opcode.MESSAGE)
MOST_RECORD_BYTES = 2 * MAX_LARGE_MESSAGE_BYTES  # chosen: a whole chunk fits; a damaged length asks for terabytes


def messages_in(
    file: IO[bytes], chunks: Sequence[ChunkIndex], channels: Set[int], begin_ns: int, end_ns: int, *, newest_first: bool
) -> Iterator[Message]:
    """Yield the messages of these channels from ``begin_ns`` to ``end_ns`` in the order of their times.

    Messages of the same time have the order of the file; ``newest_first`` is the opposite order. A chunk is read when
    its first message may be the next one.

    Raises:
        ValueError: The file is damaged.
    """
    sign = -1 if newest_first else 1
    wanted = sorted(
        (sign * (one.message_end_time if newest_first else one.message_start_time), sign * one.chunk_start_offset)
        for one in chunks
        if one.message_start_time <= end_ns
        and one.message_end_time >= begin_ns
        and not channels.isdisjoint(one.message_index_offsets)
    )
    ahead = list[tuple[int, int, int, Message]]()
    for first_ns, chunk in wanted:
        while ahead and ahead[0][0] < first_ns:
            yield heapq.heappop(ahead)[-1]
        for offset, message in _messages_of(chunk_records(file, sign * chunk), channels):
            if begin_ns <= message.log_time <= end_ns:
                heapq.heappush(ahead, (sign * message.log_time, chunk, sign * offset, message))
    while ahead:
        yield heapq.heappop(ahead)[-1]


def chunk_records(file: IO[bytes], at: int) -> bytes:
    """Return the records of the chunk at a place of the file.

    Raises:
        ValueError: The chunk is damaged.
    """
    found = Chunk.read(ReadDataStream(io.BytesIO(record_at(file, at, Opcode.CHUNK))))
    stream, length = get_chunk_data_stream(found, validate_crc=True)
    return stream.read(length)


def record_at(file: IO[bytes], at: int, kind: Opcode) -> bytes:
    """Return the content of the record of this kind at a place of the file.

    Raises:
        ValueError: Another record is there.
    """
    file.seek(at)
    found, length = _BEGIN.unpack(file.read(_BEGIN.size))
    if found != kind or length > MOST_RECORD_BYTES:
        raise ValueError("its index leads to another record")
    return file.read(length)


def message_at(records: bytes, at: int) -> Message | None:
    """Return the message at a place in the records of a chunk; None: there is another record."""
    kind, length = _BEGIN.unpack_from(records, at)
    return _message(records, at + _BEGIN.size, length) if kind == _OF_MESSAGE else None


def _messages_of(records: bytes, channels: Set[int]) -> Iterator[tuple[int, Message]]:
    """Yield the messages of these channels with their places among the records of a chunk."""
    at, end = 0, len(records)
    while at < end:
        kind, length = _BEGIN.unpack_from(records, at)
        begin = at + _BEGIN.size
        if kind == _OF_MESSAGE and records[begin] + (records[begin + 1] << 8) in channels:
            yield at, _message(records, begin, length)
        at = begin + length
    if at != end:
        raise ValueError("its last record is cut")


def _message(records: bytes, begin: int, length: int) -> Message:
    channel, sequence, log_ns, publish_ns = _MESSAGE.unpack_from(records, begin)
    return Message(channel, log_ns, records[begin + _MESSAGE.size : begin + length], publish_ns, sequence)
