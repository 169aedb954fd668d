"""A board whose readers get each value, in order."""

from __future__ import annotations

import logging
import tempfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from taking import SIZES, Count, taken

from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.values import MOST_IN_PACKET
from backbone.blackboard.writer import BlackboardWriter

MANY = 2000  # more small values than a socket admits


@given(st.lists(st.sampled_from(["put", "take", "come"]), max_size=40))
def test_each_reader_gets_each_value_from_its_coming_on_once_and_in_order(events: list[str]) -> None:
    with tempfile.TemporaryDirectory(prefix="s-") as name:
        writer = BlackboardWriter(Path(name), "order", each=True)
        readers: list[tuple[BlackboardReader, list[int]]] = []
        put = 0
        for event in events:
            match event:
                case "put":
                    put = writer.put(bytes(10) if put % 3 else bytes(MOST_IN_PACKET + 1))
                    for _reader, due in readers:
                        due.append(put)
                case "come" if len(readers) < 3:
                    readers.append((BlackboardReader(Path(name), "order"), []))
                    writer.serve()
                case "take":
                    for reader, due in readers:
                        value = reader.newest()
                        assert (value and value.number) == (due.pop(0) if due else None)
        for reader, due in readers:
            assert [taken(reader).number for _ in due] == due
            assert reader.newest() is None
            reader.close()
        writer.close()


@pytest.mark.parametrize("size", SIZES)
def test_values_of_any_size_come_whole(folder: Path, size: int) -> None:
    writer = BlackboardWriter(folder, "room", each=True)
    reader = BlackboardReader(folder, "room")
    for number in (1, 2):
        writer.put(bytes([number]) * size)
    assert [bytes(taken(reader).data) for _ in (1, 2)] == [bytes([number]) * size for number in (1, 2)]
    reader.close()
    writer.close()


def test_a_reader_that_does_not_read_loses_what_comes_last_and_delays_nobody(
    folder: Path, caplog: pytest.LogCaptureFixture, descriptors: Count
) -> None:
    before = descriptors()
    writer = BlackboardWriter(folder, "room", each=True)
    slow, quick = BlackboardReader(folder, "room"), BlackboardReader(folder, "room")
    with caplog.at_level(logging.WARNING):
        for number in range(1, MANY + 1):
            writer.put(b"a packet")
            assert taken(quick).number == number
    kept = []
    while (value := slow.newest()) is not None:
        kept.append(value.number)
    assert 0 < len(kept) < MANY
    assert kept == [*range(1, len(kept) + 1)]
    assert writer.lost == MANY - len(kept)
    assert caplog.text.count("a reader of room does not read") == 1
    writer.put(b"a packet")
    assert taken(slow).number == MANY + 1
    for one in (slow, quick, writer):
        one.close()
    assert descriptors() == before
