"""One writer and many readers of a board, in one process: tasks and threads."""

from __future__ import annotations

import asyncio
import gc
import os
import socket
import tempfile
import threading
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from taking import SIZES, WITHIN_S, Count, taken

from backbone.blackboard import sealed_memory
from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.sealed_memory import MOST_MAPPED, ForeignFolder
from backbone.blackboard.values import MOST_IN_PACKET, NoWriter, WriterStands
from backbone.blackboard.values import ValueTooLong as TooLong
from backbone.blackboard.writer import BlackboardWriter
from backbone.operating_system import local_sockets


@pytest.mark.parametrize("size", SIZES)
def test_all_readers_get_a_value_whole_and_cannot_change_it(folder: Path, size: int) -> None:
    writer, value = BlackboardWriter(folder, "room"), os.urandom(size)
    readers = [BlackboardReader(folder, "room") for _ in range(4)]
    assert writer.put(value) == 1
    for reader in readers:
        got = taken(reader)
        assert (got.number, bytes(got.data)) == (1, value)
        assert got.data.readonly
        assert not np.frombuffer(got.data, np.uint8).flags.writeable
        assert reader.newest() is None
        reader.close()
    writer.close()


@pytest.mark.parametrize("size", [10, MOST_IN_PACKET + 1])
def test_gaps_in_a_value_are_left_out_whatever_its_length(folder: Path, size: int) -> None:
    writer, every = BlackboardWriter(folder, "room"), np.arange(2 * size).astype(np.uint8)
    reader = BlackboardReader(folder, "room")
    writer.put(memoryview(every)[::2])
    assert bytes(taken(reader).data) == every[::2].tobytes()
    reader.close()
    writer.close()


@pytest.mark.parametrize("size", SIZES)
def test_a_reader_whose_socket_has_little_room_gets_every_value_too(
    folder: Path, size: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As where net.core.wmem_default is small."""
    writer, value, ample = BlackboardWriter(folder, "room"), os.urandom(size), BlackboardReader(folder, "room")
    make = sealed_memory.packet_pair

    def small_pair() -> tuple[socket.socket, socket.socket]:
        pair = make()
        for one in pair:
            one.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 1)  # the system takes its least
        return pair

    monkeypatch.setattr(sealed_memory, "packet_pair", small_pair)
    readers = [ample, BlackboardReader(folder, "room")]
    for number in (1, 2, 3):
        writer.put(value)
        if number != 2:
            assert [(got.number, bytes(got.data)) for got in map(taken, readers)] == [(number, value)] * 2
    for reader in readers:
        assert reader.newest() is None
        reader.close()
    writer.close()


@given(st.lists(st.booleans(), max_size=30))
def test_a_reader_takes_the_newest_value_and_no_number_twice(takes: list[bool]) -> None:
    """Puts and takes in any order: what is taken is what was put last, and only if it is new."""
    with tempfile.TemporaryDirectory(prefix="s-") as name:
        writer = BlackboardWriter(Path(name), "order")
        reader, put, seen = BlackboardReader(Path(name), "order"), 0, 0
        for is_take in takes:
            if is_take:
                value = reader.newest()
                assert (value.number if value else seen) == put
                seen = put
            else:
                put = writer.put(bytes(10) if put % 2 else bytes(MOST_IN_PACKET + 1))
        reader.close()
        writer.close()


def test_a_newcomer_gets_the_newest_value_at_once(folder: Path) -> None:
    writer = BlackboardWriter(folder, "room")
    serving = writer.serve_in_thread()
    for number in range(3):
        writer.put(bytes([number]) * 200_000)
    reader = BlackboardReader(folder, "room")
    value = reader.wait(WITHIN_S)
    assert value is not None
    assert (value.number, value.data[0]) == (3, 2)
    assert reader.wait(0.01) is None
    writer.close()
    serving.join(WITHIN_S)
    reader.close()


def test_without_readers_nothing_is_kept_if_so_asked(folder: Path) -> None:
    writer = BlackboardWriter(folder, "room", keeps=False)
    writer.put(b"old")
    reader = BlackboardReader(folder, "room")
    writer.serve()
    assert writer.has_readers
    assert reader.newest() is None
    writer.put(b"new")
    assert bytes(taken(reader).data) == b"new"
    reader.close()
    writer.serve()
    assert not writer.has_readers
    writer.close()


def test_a_newcomer_gets_no_old_value_beside_another_reader_either_if_so_asked(
    folder: Path, descriptors: Count
) -> None:
    writer = BlackboardWriter(folder, "room", keeps=False)
    first = BlackboardReader(folder, "room")
    writer.put(b"a" * 200_000)
    assert taken(first).number == 1
    before = descriptors()
    second = BlackboardReader(folder, "room")
    writer.serve()
    assert second.newest() is None
    writer.put(b"b" * 200_000)
    assert (taken(first).number, taken(second).number) == (2, 2)
    second.close()
    writer.serve()
    assert descriptors() == before
    writer.close()
    first.close()


def test_a_value_stays_as_long_as_it_is_looked_at(folder: Path, descriptors: Count) -> None:
    before = descriptors()
    writer = BlackboardWriter(folder, "room")
    reader = BlackboardReader(folder, "room")
    writer.put(b"a" * 200_000)
    first = np.frombuffer(taken(reader).data, np.uint8)
    for _ in range(10):
        writer.put(b"b" * 200_000)
    writer.close()
    reader.close()
    assert set(first.tolist()) == {ord("a")}
    del first
    assert descriptors() == before


def test_a_reader_that_takes_nothing_costs_one_value(folder: Path, descriptors: Count) -> None:
    writer = BlackboardWriter(folder, "room")
    slow, quick = BlackboardReader(folder, "room"), BlackboardReader(folder, "room")
    writer.put(bytes(200_000))
    taken(quick)
    some = descriptors()
    for number in range(2, 2000):
        writer.put(bytes(200_000))
        assert taken(quick).number == number
    assert descriptors() <= some + 1  # the value that ``quick`` looks at
    assert taken(slow).number == 1999
    for reader in (slow, quick):
        reader.close()
    writer.close()


def test_who_keeps_very_many_values_gets_copies_not_descriptors(folder: Path, descriptors: Count) -> None:
    writer, before = BlackboardWriter(folder, "room"), descriptors()
    reader, kept = BlackboardReader(folder, "room"), []
    for number in range(MOST_MAPPED + 50):
        writer.put(number.to_bytes(4) * 40_000)
        kept.append(taken(reader))
    assert descriptors() <= before + MOST_MAPPED + 10
    assert all(bytes(value.data[:4]) == (value.number - 1).to_bytes(4) for value in kept)
    assert all(value.data.readonly for value in kept)
    reader.close()
    writer.close()


def test_the_second_writer_is_refused_while_the_first_lives(folder: Path) -> None:
    first = BlackboardWriter(folder, "room")
    with pytest.raises(WriterStands, match="room"):
        BlackboardWriter(folder, "room")
    other = BlackboardWriter(folder, "hall")
    reader = BlackboardReader(folder, "room")
    first.put(b"from the first")
    assert bytes(taken(reader).data) == b"from the first"
    for writer in (first, other):
        writer.close()
    second = BlackboardWriter(folder, "room")
    with pytest.raises(NoWriter):
        reader.newest()
    second.close()
    reader.close()
    assert list(folder.iterdir()) == []


@pytest.mark.processes
def test_what_a_killed_writer_left_is_taken_over(folder: Path) -> None:
    if (child := os.fork()) == 0:
        BlackboardWriter(folder, "room").put(b"last")
        os._exit(0)
    os.waitpid(child, 0)
    assert {path.name for path in folder.iterdir()} == {"room.board", "room.lock"}
    with pytest.raises(NoWriter):
        BlackboardReader(folder, "room")
    writer = BlackboardWriter(folder, "room")
    reader = BlackboardReader(folder, "room")
    writer.put(b"new")
    assert bytes(taken(reader).data) == b"new"
    reader.close()
    writer.close()


def test_the_last_value_of_a_writer_that_ended_is_still_taken(folder: Path) -> None:
    writer = BlackboardWriter(folder, "room")
    reader = BlackboardReader(folder, "room")
    writer.put(b"x" * 200_000)
    writer.close()
    assert len(taken(reader).data) == 200_000
    with pytest.raises(NoWriter, match="room"):
        reader.wait(WITHIN_S)
    reader.close()


@pytest.mark.parametrize("size", [1000, MOST_IN_PACKET, 1_000_000])
def test_a_writer_that_dies_in_a_put_leaves_the_value_before_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, size: int
) -> None:
    writer, reader = BlackboardWriter(folder, "room"), BlackboardReader(folder, "room")
    writer.put(bytes([1]) * size)

    def die(*_: object) -> None:
        raise SystemExit

    monkeypatch.setattr(sealed_memory, "send", die)
    with pytest.raises(SystemExit):
        writer.put(bytes([2]) * size)
    assert bytes(taken(reader).data) == bytes([1]) * size
    monkeypatch.undo()
    reader.close()
    writer.close()


def test_a_reader_that_is_quicker_than_the_writer_still_gets_the_newest(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It takes the value before in the middle of a put."""
    writer, reader = BlackboardWriter(folder, "room"), BlackboardReader(folder, "room")
    writer.put(b"first")
    took = list[int]()

    def take(*given: Any) -> None:
        send(*given)
        if not took:
            took.append(taken(reader).number)

    send = sealed_memory.send
    monkeypatch.setattr(sealed_memory, "send", take)
    writer.put(b"second")
    assert took == [1]
    assert bytes(taken(reader).data) == b"second"
    assert reader.newest() is None
    reader.close()
    writer.close()


def test_a_value_that_is_too_long_is_refused_and_changes_nothing(folder: Path) -> None:
    writer = BlackboardWriter(folder, "room", most_bytes=1000)
    reader = BlackboardReader(folder, "room", most_bytes=500)
    with pytest.raises(TooLong, match="1001"):
        writer.put(bytes(1001))
    assert writer.number == 0
    assert reader.newest() is None
    writer.put(bytes(501))
    with pytest.raises(TooLong, match="501"):
        reader.newest()
    writer.put(bytes(500))
    assert taken(reader).number == 2
    reader.close()
    writer.close()


def test_a_folder_that_others_can_enter_is_refused(folder: Path) -> None:
    writer = BlackboardWriter(folder, "room")
    folder.chmod(0o750)
    with pytest.raises(ForeignFolder, match="750"):
        BlackboardReader(folder, "room")
    with pytest.raises(ForeignFolder):
        BlackboardWriter(folder, "hall")
    writer.close()


def test_a_process_of_another_user_is_not_admitted(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    writer = BlackboardWriter(folder, "room")
    reader = BlackboardReader(folder, "room")
    monkeypatch.setattr(local_sockets, "is_own", lambda _connected: False)
    writer.put(b"secret")
    with pytest.raises(NoWriter):
        reader.newest()
    with pytest.raises(ForeignFolder):
        BlackboardReader(folder, "room")
    reader.close()
    writer.close()


def test_a_path_may_be_longer_than_a_socket_allows(folder: Path) -> None:
    folder.mkdir()
    deep = folder / ("x" * 120)
    deep.mkdir(mode=0o700)
    writer = BlackboardWriter(deep, "room")
    reader = BlackboardReader(deep, "room")
    writer.put(b"here")
    assert bytes(taken(reader).data) == b"here"
    reader.close()
    writer.close()


async def test_tasks_wait_for_the_next_value(folder: Path) -> None:
    writer = BlackboardWriter(folder, "room")
    writer.serve_in_loop()

    async def read() -> list[int]:
        reader, numbers = BlackboardReader(folder, "room"), list[int]()
        try:
            while numbers[-1:] != [20]:
                numbers.append((await reader.next()).number)
        finally:
            reader.close()
        return numbers

    reading = [asyncio.create_task(read()) for _ in range(3)]
    for _ in range(20):
        writer.put(bytes(180_000))
        await asyncio.sleep(0.001)
    async with asyncio.timeout(WITHIN_S):
        for numbers in await asyncio.gather(*reading):
            assert numbers == sorted(set(numbers))
    writer.close()


def test_threads_that_write_and_read_at_once_see_whole_values_in_order(folder: Path) -> None:
    writer, torn, seen = BlackboardWriter(folder, "room"), list[int](), list[list[int]]()
    serving = writer.serve_in_thread()

    def read() -> None:
        reader, numbers = BlackboardReader(folder, "room"), list[int]()
        while numbers[-1:] != [600]:
            value = reader.wait(WITHIN_S)
            assert value is not None
            if len(set(value.data[::997].tolist())) != 1:
                torn.append(value.number)
            numbers.append(value.number)
        seen.append(numbers)
        reader.close()

    readers = [threading.Thread(target=read) for _ in range(3)]
    writers = [
        threading.Thread(target=lambda n=n: [writer.put(bytes([n]) * 140_000) for _ in range(200)]) for n in b"abc"
    ]
    for thread in [*readers, *writers]:
        thread.start()
    for thread in [*writers, *readers]:
        thread.join(WITHIN_S)
    assert not torn
    assert len(seen) == 3
    for numbers in seen:
        assert numbers == sorted(set(numbers))
    writer.close()
    serving.join(WITHIN_S)
    gc.collect()


def test_the_program_in_the_guide_runs(folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    guide = (Path(__file__).parents[3] / "docs" / "how-to" / "share-large-values.md").read_text()
    monkeypatch.chdir(folder.parent)
    exec(guide.partition("```python\n")[2].partition("```")[0], {})  # noqa: S102
    assert capsys.readouterr().out == "1 4000000\n"
