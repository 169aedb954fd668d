"""A blackboard between processes: whole values however fast they change, and nothing is left of killed processes."""

from __future__ import annotations

import asyncio
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import board_roles
import pytest
from board_roles import MISSION, NAME, SENDER, WITHIN_S, Map, is_whole
from bus_laws import Heard, fail_on_bug
from free_ports import free_endpoint

from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.values import NoWriter
from backbone.blackboard.writer import BlackboardWriter
from backbone.bus.clock import MissionClock
from backbone.bus.host_boards import boards_for
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation

pytestmark = [pytest.mark.processes, pytest.mark.timeout(600)]
Process = subprocess.Popen[str]


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="s-") as name:
        yield Path(name)


class Processes:
    """Processes in roles; kills those that are left."""

    def __init__(self, folder: Path) -> None:
        self._folder, self._all = folder, list[Process]()

    def begin(self, role: str, more: object) -> Process:
        command = [sys.executable, board_roles.__file__, role, str(self._folder), str(more)]
        made = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        self._all.append(made)
        return made

    def begun(self, role: str, more: object) -> Process:
        made = self.begin(role, more)
        assert said(made) == "ready"
        return made

    def end(self) -> None:
        for one in self._all:
            kill(one)


@pytest.fixture
def processes(folder: Path) -> Iterator[Processes]:
    made = Processes(folder)
    yield made
    made.end()


def said(by: Process) -> str:
    assert by.stdout is not None
    return by.stdout.readline().strip()


def kill(one: Process) -> None:
    one.send_signal(signal.SIGKILL)
    one.wait(WITHIN_S)
    assert one.stdout is not None
    one.stdout.close()


def has_named_memory(one: Process) -> bool:
    """Return whether a process has a file of the folder for shared memory, which would outlive it."""
    named = [Path(f"/proc/{one.pid}/maps").read_text()]
    for entry in Path(f"/proc/{one.pid}/fd").iterdir():
        with suppress(FileNotFoundError):  # closed meanwhile
            named.append(os.readlink(entry))
    return any("/dev/shm" in name for name in named)  # noqa: S108


@pytest.mark.parametrize(
    "reads",
    [
        1_500,
        pytest.param(6_000, marks=pytest.mark.thorough),
        pytest.param(1_000_000, marks=[pytest.mark.slow, pytest.mark.alone]),
    ],
)
def test_no_value_that_is_read_during_writes_is_torn(processes: Processes, reads: int) -> None:
    processes.begun("writer", 0)
    readers = [processes.begun("reader", reads // 3) for _ in range(3)]
    assert [said(reader) for reader in readers] == ["0", "0", "0"]


class Watcher:
    """The reader that is not killed: it must get a whole value again after each kill."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._reader = BlackboardReader(folder, NAME)

    def see_a_new_value(self) -> None:
        end_s = time.monotonic() + WITHIN_S
        while time.monotonic() < end_s:
            try:
                value = self._reader.wait(WITHIN_S)
            except NoWriter:
                self._reader.close()
                self._reader = BlackboardReader(self._folder, NAME)
                continue
            assert value is not None
            assert is_whole(value)
            return
        pytest.fail("no value")

    def close(self) -> None:
        self._reader.close()


@pytest.mark.parametrize(
    "kills", [4, pytest.param(40, marks=pytest.mark.thorough), pytest.param(200, marks=pytest.mark.slow)]
)
def test_whoever_is_killed_the_others_go_on_and_nothing_is_left(folder: Path, processes: Processes, kills: int) -> None:
    chance, endless = random.Random(1), 10**9
    writer, watcher = processes.begun("writer", 1), Watcher(folder)
    reader = processes.begun("reader", endless)
    for number in range(kills):
        time.sleep(chance.uniform(0.0, 0.02))  # of the machine: the kill falls anywhere into a write or a read
        if number % 2:
            kill(reader)
            reader = processes.begun("reader", endless)
        else:
            kill(writer)
            writer = processes.begun("writer", 1)
            assert said(reader) == "ended"
            kill(reader)
            reader = processes.begun("reader", endless)
        watcher.see_a_new_value()
        assert not has_named_memory(writer)
        assert not has_named_memory(reader)
        assert {path.name for path in folder.iterdir()} == {f"{NAME}.board", f"{NAME}.lock"}
    kill(writer)
    watcher.close()
    BlackboardWriter(folder, NAME).close()
    assert list(folder.iterdir()) == []


def test_a_writer_that_is_stopped_blocks_nobody(folder: Path, processes: Processes) -> None:
    """Neither does a stopped reader."""
    writer = processes.begun("writer", 1)
    watcher, reader = Watcher(folder), processes.begun("reader", 10**9)
    reader.send_signal(signal.SIGSTOP)
    for _ in range(200):
        watcher.see_a_new_value()
    writer.send_signal(signal.SIGSTOP)
    os.waitid(os.P_PID, writer.pid, os.WSTOPPED)  # a signal that is sent has not yet stopped a process that runs
    began_s = time.monotonic()
    late = BlackboardReader(folder, NAME)
    assert late.newest() is None
    assert time.monotonic() - began_s < WITHIN_S / 2
    writer.send_signal(signal.SIGCONT)
    value = late.wait(WITHIN_S)
    assert value is not None
    assert is_whole(value)
    late.close()
    watcher.close()


STRANGER = """
import os, socket, sys
os.setgroups([]); os.setgid(65534); os.setuid(65534)
asked = socket.socket(socket.AF_UNIX, socket.SOCK_SEQPACKET)
try:
    asked.connect(sys.argv[1])
except PermissionError:
    print("no entry")
    raise SystemExit
own, way = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
try:
    socket.send_fds(asked, [b"0"], [way.fileno(), own.fileno()])
except BrokenPipeError:
    pass
way.close()
print(own.recv(1000))
"""


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can become another account")
def test_another_account_gets_nothing_even_if_it_may_enter(folder: Path) -> None:
    place = folder / "board"
    writer = BlackboardWriter(place, NAME)
    writer.serve_in_thread()
    writer.put(b"secret")

    def what_a_stranger_gets() -> str:
        command = [sys.executable, "-c", STRANGER, str(place / f"{NAME}.board")]
        return subprocess.run(command, capture_output=True, text=True, check=True, timeout=WITHIN_S).stdout.strip()

    folder.chmod(0o755)
    assert what_a_stranger_gets() == "no entry"
    place.chmod(0o755)
    (place / f"{NAME}.board").chmod(0o777)
    assert what_a_stranger_gets() == "b''"
    writer.close()


@pytest.mark.parametrize("kills", [2, pytest.param(20, marks=pytest.mark.thorough)])
async def test_listeners_of_the_bus_outlive_senders_and_each_other(
    folder: Path, processes: Processes, kills: int
) -> None:
    endpoint = free_endpoint()
    clock = MissionClock(0.0)
    hub = ZenohBus.open(MISSION, "backbone/hub", clock, hub_config([endpoint]))
    bus = ZenohBus.open(MISSION, "backbone/watcher", clock, client_config(endpoint))
    bus.boards, bus.on_bug = boards_for(str(folder)), fail_on_bug
    heard = Heard()
    bus.subscribe(SENDER, Conversation.FRAMES, Map, heard, latest=True)
    sender = await asyncio.to_thread(processes.begun, "sender", endpoint)
    listener = await asyncio.to_thread(processes.begun, "listener", endpoint)
    for number in range(kills):
        await heard.until_count(len(heard.all) + 20)
        if number % 2:
            kill(listener)
            listener = await asyncio.to_thread(processes.begun, "listener", endpoint)
        else:
            kill(sender)
            lives = len(heard.all)
            sender = await asyncio.to_thread(processes.begun, "sender", endpoint)
            await heard.until_count(lives + 20)
    stamps = [envelope.stamp_s for envelope in heard.all]
    assert stamps == sorted(set(stamps))
    assert len(list((folder / "board").iterdir())) == 2
    await bus.close()
    await hub.close()
