"""What a process sends reaches the recorder of its host whole and in order; nobody waits for that recorder."""

from __future__ import annotations

import asyncio
import os
import resource
import socket
import tempfile
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager, contextmanager
from itertools import pairwise
from pathlib import Path

import pytest

from backbone.bus import host_copies
from backbone.bus.host_copies import MISSION_SOCKET, MOST_WAITING_BYTES, HostCopies
from backbone.recording.host_ear import LOOK_EACH_S, EarTaken, HostEar

KEY = "scout/night/resource_pool/scout1/frames"
WITHIN_S = 10.0


@pytest.fixture
def folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory(prefix="s-") as name:
        yield Path(name)


class Heard(list[tuple[str, bytes]]):
    def take(self, key: str, raw: bytes) -> None:
        self.append((key, raw))


def fail(bug: BaseException) -> None:
    raise bug


@asynccontextmanager
async def listening(folder: Path, heard: Heard, *, is_of_mission: bool = True) -> AsyncIterator[HostEar]:
    ear = HostEar(folder, is_of_mission=is_of_mission)
    await ear.open(heard.take, fail)
    try:
        yield ear
    finally:
        await ear.close()


@contextmanager
def no_descriptor_left() -> Iterator[None]:
    limits = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (min(map(int, os.listdir("/proc/self/fd"))), limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, limits)


async def until(holds: Callable[[], bool], what: str) -> None:
    try:
        async with asyncio.timeout(WITHIN_S):
            while not holds():  # noqa: ASYNC110  the socket's other end sets no event
                await asyncio.sleep(0.01)
    except TimeoutError:
        pytest.fail(f"not within {WITHIN_S} s: {what}")


async def test_copies_arrive_whole_and_in_order_large_ones_too(folder: Path) -> None:
    heard = Heard()
    async with listening(folder, heard) as ear:
        copies = HostCopies(folder)
        sent = [(KEY, bytes([n]) * (n * 40_000)) for n in range(12)] + [(KEY, b"last")]
        for key, raw in sent:
            copies.send(key, raw)
        await until(lambda: len(heard) == len(sent), "all came")
        assert heard == sent
        assert (copies.dropped, ear.dropped) == (0, 0)
        copies.close()


async def test_while_a_recorder_hangs_copies_are_dropped_and_counted(folder: Path) -> None:
    heard = Heard()
    async with listening(folder, heard) as ear:
        copies = HostCopies(folder)
        picture, count = bytes(100_000), 200
        for _ in range(count):  # without a turn for the recorder
            copies.send(KEY, picture)
        assert 0 < copies.dropped < count
        assert (count - copies.dropped) * len(picture) < MOST_WAITING_BYTES + 1_000_000
        await until(lambda: len(heard) == count - copies.dropped, "what was not dropped came")
        copies.send(KEY, b"after")
        await until(lambda: ear.dropped == copies.dropped, "the recorder knows how many were dropped")
        assert heard[-1] == (KEY, b"after")
        copies.close()
        await until(lambda: copies.dropped == ear.dropped, "they are still counted")


@pytest.mark.parametrize("size", [100, 100_000])
@pytest.mark.parametrize("is_drained", [False, True])
async def test_what_a_process_had_not_sent_when_it_ended_is_counted(
    folder: Path, size: int, *, is_drained: bool
) -> None:
    heard = Heard()
    async with listening(folder, heard) as ear:
        copies, count = HostCopies(folder), 2 * MOST_WAITING_BYTES // size
        for _ in range(count):  # without a turn for the recorder
            copies.send(KEY, bytes(size))
        assert copies.dropped > 0
        if is_drained:
            await until(lambda: len(heard) == count - copies.dropped, "what was not dropped came")
        copies.close()
        await until(lambda: len(heard) + ear.dropped == count, "each copy came or is counted")
        assert all(key == KEY for key, _raw in heard)


async def test_a_recorder_that_begins_late_or_again_gets_what_is_sent_from_then_on(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(host_copies, "LOOK_EACH_S", 0.02)
    copies, heard = HostCopies(folder), Heard()
    assert not copies.find_recorder()
    copies.send(KEY, b"too early")
    for again in range(2):
        async with listening(folder, heard):
            await until(copies.find_recorder, "it found the recorder")
            copies.send(KEY, b"%d" % again)
            await until(lambda n=again: len(heard) == n + 1, "it came")  # type: ignore[misc]

        def is_lost() -> bool:
            copies.send(KEY, b"to nobody")
            return not copies.find_recorder()

        await until(is_lost, "it noticed that the recorder is gone")
    assert heard == [(KEY, b"0"), (KEY, b"1")]
    copies.close()


async def test_a_recorder_that_begins_right_after_another_has_ended_gets_the_first_message(folder: Path) -> None:
    first, second = Heard(), Heard()
    async with listening(folder, first):
        copies = HostCopies(folder)
        copies.send(KEY, b"1")
        await until(lambda: len(first) == 1, "the first recorder heard it")
    async with listening(folder, second):
        await asyncio.sleep(0.01)  # the system reports the end of the first at once
        assert copies.find_recorder()
        copies.send(KEY, b"2")
        await until(lambda: len(second) == 1, "the second recorder heard it")
    copies.close()


async def test_a_recorder_counts_no_copies_that_were_dropped_before_it_began(folder: Path) -> None:
    first, second = Heard(), Heard()
    async with listening(folder, first) as ear:
        copies = HostCopies(folder)
        for _ in range(100):  # without a turn for the recorder
            copies.send(KEY, bytes(100_000))
        await until(lambda: len(first) == 100 - copies.dropped, "what was not dropped came")
        copies.send(KEY, b"after")
        await until(lambda: ear.dropped > 0, "the first recorder knows that some were dropped")
    async with listening(folder, second) as ear:
        await asyncio.sleep(0.01)  # the system reports the end of the first at once
        assert copies.find_recorder()
        copies.send(KEY, b"2")
        await until(lambda: second == [(KEY, b"2")], "the second recorder heard it")
        assert ear.dropped == 0
    copies.close()


async def test_a_process_knows_whether_its_copies_reach_the_recorder_of_the_mission(folder: Path) -> None:
    async with listening(folder, Heard(), is_of_mission=False):
        of_host = HostCopies(folder)
        assert of_host.find_recorder()
        assert not of_host.reach_mission
        async with listening(folder, Heard()):
            of_mission = HostCopies(folder)
            assert of_mission.reach_mission
            of_mission.close()
            assert not of_mission.find_recorder()
            of_mission.close()
        of_host.close()


async def test_a_second_recorder_of_a_host_is_refused_and_the_first_goes_on(folder: Path) -> None:
    heard = Heard()
    async with listening(folder, heard):
        with pytest.raises(EarTaken):
            await HostEar(folder, is_of_mission=True).open(heard.take, fail)
        copies = HostCopies(folder)
        copies.send(KEY, b"sense")
        await until(lambda: heard == [(KEY, b"sense")], "it came")
        copies.close()


async def test_the_socket_of_a_killed_recorder_is_taken_over(folder: Path) -> None:
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(str(folder / MISSION_SOCKET))
    heard = Heard()
    async with listening(folder, heard):
        copies = HostCopies(folder)
        copies.send(KEY, b"sense")
        await until(lambda: bool(heard), "it came")
        copies.close()


async def test_that_no_file_can_be_opened_is_told_once_and_what_waited_is_heard_later(folder: Path) -> None:
    heard, told = Heard(), list[str]()
    async with listening(folder, heard) as ear:
        ear.on_lack = told.append
        copies, second = HostCopies(folder), HostCopies(folder)
        copies.send(KEY, b"first")
        second.send(KEY, b"second")
        with no_descriptor_left():
            await asyncio.sleep(4 * LOOK_EACH_S)
            assert not heard
        [line] = told
        assert "ulimit" in line
        await until(lambda: len(heard) == 2, "both came")
        copies.close()
        second.close()


async def test_a_sender_without_descriptors_goes_on_and_finds_the_recorder_later(folder: Path) -> None:
    heard = Heard()
    async with listening(folder, heard):
        with no_descriptor_left():
            copies = HostCopies(folder)
            copies.look_now()
            assert not copies.find_recorder()
        copies.look_now()
        assert copies.find_recorder()
        copies.send(KEY, b"sense")
        await until(lambda: bool(heard), "it came")
        copies.close()


async def test_nonsense_on_the_socket_ends_that_connection_alone(folder: Path) -> None:
    heard = Heard()
    async with listening(folder, heard):
        _reader, writer = await asyncio.open_unix_connection(folder / MISSION_SOCKET)
        writer.write(b"\xff" * 100)
        assert await _reader.read() == b""
        writer.close()
        copies = HostCopies(folder)
        copies.send(KEY, b"sense")
        await until(lambda: bool(heard), "sense came")
        copies.close()


async def test_a_recorder_is_woken_for_many_copies_together(folder: Path) -> None:
    loop, heard_s = asyncio.get_running_loop(), list[float]()
    ear = HostEar(folder, is_of_mission=True)
    await ear.open(lambda _key, _raw: heard_s.append(loop.time()), fail)
    copies, began_s, count = HostCopies(folder), loop.time(), 100
    for _ in range(count):
        copies.send(KEY, b"small")
        await asyncio.sleep(0.003)
    await until(lambda: len(heard_s) == count, "all came")
    wakings = 1 + sum(after - before > 0.0015 for before, after in pairwise(heard_s))
    assert wakings <= 2 + (loop.time() - began_s) / LOOK_EACH_S
    copies.close()
    await ear.close()
