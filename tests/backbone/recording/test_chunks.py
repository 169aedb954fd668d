"""The messages of a recording are read in the order in which the MCAP library reads them, in both directions."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st
from mcap.reader import make_reader
from mcap.summary import Summary
from mcap.writer import CompressionType, Writer

from backbone.recording.chunks import messages_in
from backbone.recording.file_index import IndexedReader

CHANNELS = 3
times = st.integers(0, 8)
messages = st.lists(st.tuples(times, st.integers(0, CHANNELS - 1), st.booleans()), max_size=30)


def written(said: list[tuple[int, int, bool]], compression: CompressionType = CompressionType.ZSTD) -> bytes:
    """Return the file of messages: time, channel, whether a chunk ends after it."""
    file = io.BytesIO()
    writer = Writer(file, compression=compression)
    writer.start()
    channels = [writer.register_channel(f"/{number}", "json", 0) for number in range(CHANNELS)]
    for number, (at_ns, channel, ends_chunk) in enumerate(said):
        writer.add_message(channels[channel], at_ns, f"message {number}".encode(), at_ns, number)
        if ends_chunk:
            writer.flush()  # type: ignore[no-untyped-call]
    writer.finish()  # type: ignore[no-untyped-call]
    return file.getvalue()


def index_of(file: bytes) -> Summary:
    return IndexedReader(io.BytesIO(file)).get_summary()


@given(
    said=messages,
    chosen=st.sets(st.integers(0, CHANNELS - 1)),
    bounds=st.tuples(times, times).map(sorted),
    back=st.booleans(),
)
def test_order_and_choice_are_those_of_the_library(
    said: list[tuple[int, int, bool]], chosen: set[int], bounds: list[int], *, back: bool
) -> None:
    file, [begin_ns, end_ns] = written(said), bounds
    topics = [f"/{number}" for number in chosen]
    expected = make_reader(io.BytesIO(file)).iter_messages(topics, starting_at=begin_ns, ending_at=end_ns, reverse=back)
    index = index_of(file)
    ids = {number for number, channel in index.channels.items() if channel.topic in topics}
    found = messages_in(io.BytesIO(file), index.chunk_indexes, ids, begin_ns, end_ns, newest_first=back)
    assert [*found] == [message for _schema, _channel, message in expected]


def test_a_chunk_whose_last_record_is_cut_is_damaged() -> None:
    """Without a checksum, the message would be read, too short."""
    file = written([(1, 0, False)], CompressionType.NONE)
    index, broken = index_of(file), bytearray(file)
    [chunk] = index.chunk_indexes
    broken[file.index(b"message 0") - 30] += 1  # the length of the message
    broken[chunk.chunk_start_offset + 33 : chunk.chunk_start_offset + 37] = bytes(4)  # no checksum
    with pytest.raises(ValueError, match="cut"):
        list(messages_in(io.BytesIO(broken), [chunk], set(index.channels), 0, 9, newest_first=False))
