"""A writer of a board that runs out of descriptors, or is closed by another thread, neither spins nor breaks."""

from __future__ import annotations

import asyncio
import errno
import fcntl
import os
import socket
import threading
import time
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest
from taking import WITHIN_S, Count, taken

from backbone.blackboard import sealed_memory
from backbone.blackboard import writer as writers
from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.sealed_memory import Waits
from backbone.blackboard.values import MOST_IN_PACKET
from backbone.blackboard.writer import BlackboardWriter
from backbone.operating_system import local_sockets


@pytest.mark.parametrize("how", ["loop", "thread", "put"])
async def test_without_descriptors_a_newcomer_waits_and_its_writer_does_not_spin(
    folder: Path, monkeypatch: pytest.MonkeyPatch, how: str
) -> None:
    accept, refusals = local_sockets.accept, list[int]()

    def refuse(_listening: socket.socket) -> socket.socket:
        refusals.append(1)
        raise OSError(errno.EMFILE, "no descriptors")

    monkeypatch.setattr(writers, "ACCEPT_AGAIN_S", 0.3)
    monkeypatch.setattr(local_sockets, "accept", refuse)
    writer = BlackboardWriter(folder, "room")
    thread = writer.serve_in_thread() if how == "thread" else None
    if how == "loop":
        writer.serve_in_loop()
    writer.put(b"first")
    began_s, reader = time.monotonic(), BlackboardReader(folder, "room")
    for _ in range(3):
        if how == "put":
            writer.put(b"first")
        await asyncio.sleep(0.05)
    assert 1 <= len(refusals) <= 1 + (time.monotonic() - began_s) / writers.ACCEPT_AGAIN_S
    monkeypatch.setattr(local_sockets, "accept", accept)
    if how == "put":
        await asyncio.sleep(0.3)
        writer.put(b"first")
    assert bytes((await asyncio.wait_for(reader.next(), WITHIN_S)).data) == b"first"
    reader.close()
    writer.close()
    if thread is not None:
        await asyncio.to_thread(thread.join, WITHIN_S)


async def test_a_newcomer_is_admitted_although_the_timer_of_the_loop_is_early(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As those of uvloop, which count whole milliseconds: here the machine's clock does not go on at all."""
    accept, refusals, now_s = local_sockets.accept, list[int](), time.monotonic()

    def refuse_once(listening: socket.socket) -> socket.socket:
        if not refusals:
            refusals.append(1)
            raise OSError(errno.EMFILE, "no descriptors")
        return accept(listening)

    monkeypatch.setattr(writers, "ACCEPT_AGAIN_S", 0.05)
    monkeypatch.setattr(writers, "time", SimpleNamespace(monotonic=lambda: now_s))
    monkeypatch.setattr(local_sockets, "accept", refuse_once)
    writer = BlackboardWriter(folder, "room")
    writer.serve_in_loop()
    writer.put(b"first")
    for reader in (BlackboardReader(folder, "room"), BlackboardReader(folder, "room")):
        assert bytes((await asyncio.wait_for(reader.next(), WITHIN_S)).data) == b"first"
        reader.close()
    assert refusals
    writer.close()


def test_a_writer_that_is_closed_while_its_thread_looks_ends_that_thread(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    wait, bugs = sealed_memory.wait_readable, list[object]()
    writer = BlackboardWriter(folder, "room")

    def close_then_wait(one: socket.socket | Waits, within_s: float) -> bool:
        writer.close()
        return wait(one, within_s)

    monkeypatch.setattr(sealed_memory, "wait_readable", close_then_wait)
    monkeypatch.setattr(threading, "excepthook", bugs.append)
    thread = writer.serve_in_thread()
    thread.join(WITHIN_S)
    assert (thread.is_alive(), bugs) == (False, [])


@pytest.mark.parametrize("fails", ["Waits", "listen", "fcntl.flock"])
def test_a_writer_that_could_not_be_opened_leaves_its_place_and_no_descriptor(
    folder: Path, descriptors: Count, monkeypatch: pytest.MonkeyPatch, fails: str
) -> None:
    def refuse(*_given: object) -> None:
        raise OSError(errno.EMFILE, "no descriptors")

    folder.mkdir(mode=0o700)
    before = descriptors()
    with monkeypatch.context() as patched:
        patched.setattr(f"backbone.blackboard.sealed_memory.{fails}", refuse)
        with pytest.raises(OSError, match="no descriptors"):
            BlackboardWriter(folder, "room")
    assert descriptors() == before
    BlackboardWriter(folder, "room").close()


def test_a_value_is_sealed_while_the_system_still_uses_its_pages(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As when the system moves or scans them: here a pipe refers to one."""
    write, (waiting, entry) = os.pwrite, os.pipe()

    def write_and_use(descriptor: int, value: bytes, at: int) -> int:
        written = write(descriptor, value, at)
        assert os.splice(descriptor, entry, 4096, offset_src=0) == 4096
        return written

    monkeypatch.setattr(os, "pwrite", write_and_use)
    writer, value = BlackboardWriter(folder, "room"), bytes(2 * MOST_IN_PACKET)
    try:
        assert writer.put(value) == 1
        with closing(BlackboardReader(folder, "room")) as reader:
            writer.serve()
            assert bytes(taken(reader).data) == value
    finally:
        writer.close()
        os.close(waiting)
        os.close(entry)


def test_a_value_is_sealed_by_an_older_system(monkeypatch: pytest.MonkeyPatch) -> None:
    """As of 2018, which knows no seal against future writers only."""
    ask = fcntl.fcntl

    def refuse(descriptor: int, command: int, seals: int = 0) -> int:
        if command == fcntl.F_ADD_SEALS and seals & 0x10:
            raise OSError(errno.EINVAL, "unknown seal")
        return ask(descriptor, command, seals)

    monkeypatch.setattr(fcntl, "fcntl", refuse)
    assert bytes(sealed_memory.mapped(sealed_memory.sealed(b"value"), 5)) == b"value"
