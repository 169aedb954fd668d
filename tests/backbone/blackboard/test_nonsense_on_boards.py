"""What a hostile reader or writer, or memory that could change, does to a board: nothing."""

from __future__ import annotations

import fcntl
import os
import socket
from pathlib import Path

import pytest
from taking import Count, taken

from backbone.blackboard import sealed_memory
from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.sealed_memory import NotSealed
from backbone.blackboard.values import HEADER, NoBlackboard, NotAValue
from backbone.blackboard.writer import BlackboardWriter


def test_nonsense_of_a_reader_ends_that_reader_alone(folder: Path, descriptors: Count) -> None:
    writer, before = BlackboardWriter(folder, "room"), descriptors()
    good = BlackboardReader(folder, "room")
    for sent, files in ((b"\0" * 100, 0), (b"\0", 1), (b"\0", 2), (b"\0", 9)):
        with open("/dev/null", "rb") as null, sealed_memory.connect(folder, "room.board") as bad:
            sealed_memory.send(bad, [sent], [null.fileno()] * files)
            writer.put(b"sense")
            assert bad.recv(1) == b""
    assert bytes(taken(good).data) == b"sense"
    good.close()
    writer.put(b"to nobody")
    assert descriptors() == before
    writer.close()


@pytest.mark.parametrize("seal", [0, 2, 7, 8, 16])  # none; F_SEAL_SHRINK alone; all but writing; writing alone
def test_memory_that_could_change_is_refused(folder: Path, descriptors: Count, seal: int) -> None:
    memory = os.memfd_create("bad", os.MFD_ALLOW_SEALING)
    os.write(memory, bytes(100))
    fcntl.fcntl(memory, fcntl.F_ADD_SEALS, seal)
    before = descriptors()
    with pytest.raises(NotSealed):
        sealed_memory.mapped(memory, 100)
    assert descriptors() == before - 1


@pytest.mark.parametrize("length", [99, 101])
def test_memory_of_another_length_is_refused(length: int) -> None:
    with pytest.raises(NotSealed):
        sealed_memory.mapped(sealed_memory.sealed(bytes(100)), length)


def test_a_file_is_no_sealed_memory() -> None:
    with open(__file__, "rb") as file, pytest.raises(NotSealed):
        sealed_memory.mapped(os.dup(file.fileno()), 100)


def test_nonsense_of_a_writer_is_refused(folder: Path, descriptors: Count) -> None:
    folder.mkdir(mode=0o700)
    before = descriptors()
    with sealed_memory.listen(folder, "room.board") as listening:
        reader = BlackboardReader(folder, "room")
        connection, _ = listening.accept()
        _hello, ends = sealed_memory.receive(connection, 1)
        way = socket.socket(fileno=ends[0])
        with open("/dev/null", "rb") as null:
            for sent, files, refusal in (
                (b"short", 1, NotAValue),
                (HEADER.pack(1, 10), 0, NotAValue),
                (HEADER.pack(1, 10), 2, NotAValue),
                (HEADER.pack(1, 10), 1, NotSealed),
            ):
                sealed_memory.send(way, [sent], [null.fileno()] * files)
                with pytest.raises(refusal):
                    reader.newest()
        for one in (connection, way, reader):
            one.close()
        os.close(ends[1])
    assert descriptors() == before


def test_where_memory_cannot_be_sealed_there_is_no_blackboard(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sealed_memory, "IS_POSSIBLE", False)
    with pytest.raises(NoBlackboard):
        BlackboardWriter(folder, "room")
    with pytest.raises(NoBlackboard):
        BlackboardReader(folder, "room")
