"""A radio on a serial line: packets arrive whole and in order, none after its call, and a missing line is a fault."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from radio_contract import assert_keeps_nothing
from serial_line import SerialLine, serial_line

from backbone.bus.clock import MissionClock, VirtualClock, run_virtual
from backbone.component.messages import WrongParameter
from resource_pool.drivers.interface import DriverSite, HardwareFault
from resource_pool.drivers.serial_frames import SerialFrame, SerialKind, line_bytes
from resource_pool.drivers.serial_radio import REPLY_EVERY_S, SerialRadio

WITHIN_S = 5.0


class Desk:
    """A radio, and its RC's side."""

    def __init__(self, clock: Any, **options: object) -> None:
        bus: Any = None
        self.clock, self.bugs, self.failed = clock, list[BaseException](), asyncio.Event()
        site = DriverSite("radio", bus, clock, SimpleNamespace(options=options), print, self._fail)
        self.radio = SerialRadio(site)

    def _fail(self, bug: BaseException) -> None:
        self.bugs.append(bug)
        self.failed.set()

    async def send(self, payload: bytes, network_id: int = 1) -> float | None:
        return await self.radio.transmit(network_id, payload, arc="a", robot_epoch=1)


@pytest.fixture
def line() -> Iterator[SerialLine]:
    with serial_line() as line:
        yield line


async def test_packets_arrive_whole_and_in_order(line: SerialLine) -> None:
    desk = Desk(MissionClock.started_now(), port=line.port)
    await desk.radio.open()
    payloads = [bytes([number]) * number for number in range(1, 40)] + [bytes(range(256))]
    for number, payload in enumerate(payloads):
        await desk.send(payload, number)
    expected = [SerialFrame(SerialKind.COMMAND, number, payload) for number, payload in enumerate(payloads)]
    assert line.listen() == expected
    assert line.bytes_heard == b"".join(map(line_bytes, expected)), "and nothing else was on the line"
    await desk.radio.close()
    assert not desk.bugs


@pytest.mark.parametrize(("baud", "extra_s"), [(9600, 0.0), (115200, 0.01)])
def test_a_packet_takes_the_time_of_its_bytes(line: SerialLine, baud: int, extra_s: float) -> None:
    async def scene() -> None:
        desk = Desk(VirtualClock(), port=line.port, baud=baud, extra_s=extra_s)
        await desk.radio.open()
        begun_s, air_s = desk.clock.now_s(), await desk.send(b"D12345678")
        line_s = 10 * 16 / baud
        assert air_s == pytest.approx(line_s + extra_s)
        assert line_s <= desk.clock.now_s() - begun_s <= line_s + 0.003
        await desk.radio.close()

    run_virtual(scene())


def test_it_keeps_the_contract_of_radios(line: SerialLine) -> None:
    async def scene() -> None:
        desk = Desk(VirtualClock(), port=line.port)
        await desk.radio.open()
        await assert_keeps_nothing(desk.radio, line.payloads)
        await desk.radio.close()

    run_virtual(scene())


def test_a_call_that_is_cut_off_takes_back_what_has_not_left(line: SerialLine) -> None:
    """A full line: the rest of the frame does not follow, nor what the system still has; the next packet arrives."""

    async def scene() -> None:
        desk = Desk(VirtualClock(), port=line.port, baud=1000000)
        await desk.radio.open()
        sent = 0
        while True:  # the far end reads nothing until the line is full
            call = asyncio.ensure_future(desk.send(b"x" * 4000))
            await asyncio.sleep(0.2)
            if not call.done():
                break
            assert await call is not None
            sent += 1
        call.cancel()
        await asyncio.wait({call})
        assert call.cancelled()
        before = len(line.listen())
        assert before < sent
        await asyncio.sleep(1.0)
        assert len(line.listen()) == before
        await desk.send(b"after")
        assert line.payloads()[before:] == [b"after"]
        await desk.radio.close()

    run_virtual(scene())


def test_a_call_that_is_cut_off_ends_when_the_adapter_has_sent_what_it_had(line: SerialLine) -> None:
    async def scene() -> None:
        desk = Desk(VirtualClock(), port=line.port, baud=9600)
        await desk.radio.open()
        call = asyncio.ensure_future(desk.send(b"D12345678"))
        await asyncio.sleep(0.001)
        call.cancel()
        await asyncio.wait({call})
        assert call.cancelled()
        assert 10 * 16 / 9600 <= desk.clock.now_s() <= 10 * 16 / 9600 + 0.003
        await desk.radio.close()

    run_virtual(scene())


def test_a_line_that_takes_no_bytes_is_a_hardware_fault(line: SerialLine) -> None:
    async def scene() -> None:
        desk = Desk(VirtualClock(), port=line.port, baud=1000000)
        await desk.radio.open()

        async def fill() -> None:
            for _ in range(100):
                await desk.send(b"x" * 4000)

        with pytest.raises(HardwareFault, match=r"took no more bytes for 0\.5 s"):
            await fill()
        await desk.radio.close()

    run_virtual(scene())


async def test_a_line_that_is_unplugged_is_a_hardware_fault_at_once_and_of_each_packet(line: SerialLine) -> None:
    desk = Desk(MissionClock.started_now(), port=line.port)
    await desk.radio.open()
    await desk.send(b"H")
    line.unplug()
    await asyncio.wait_for(desk.failed.wait(), WITHIN_S)
    [bug] = desk.bugs
    assert isinstance(bug, HardwareFault)
    assert bug.detail.startswith(f"serial port {line.port} is gone")
    with pytest.raises(HardwareFault, match="is gone"):
        await desk.send(b"H")
    await desk.radio.close()
    with pytest.raises(HardwareFault, match="is not open"):
        await desk.send(b"H")
    assert len(desk.bugs) == 1


async def test_a_port_is_for_one_radio_and_can_be_opened_again(line: SerialLine) -> None:
    first, second = Desk(MissionClock.started_now(), port=line.port), Desk(MissionClock.started_now(), port=line.port)
    await first.radio.open()
    with pytest.raises(HardwareFault, match="is in use") as refused:
        await second.radio.open()
    assert "fuser" in refused.value.remedy
    await first.radio.close()
    await first.radio.close()
    for times in (1, 2):
        await second.radio.open()
        await second.send(b"H")
        assert line.payloads() == [b"H"] * times
        await second.radio.close()


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda path: None, "cannot be opened: No such file or directory"),
        (lambda path: path.mkdir(), "cannot be opened: Is a directory"),
        (lambda path: path.write_bytes(b""), "is no serial port: "),
    ],
)
async def test_what_is_no_serial_port_is_a_hardware_fault(
    tmp_path: Path, make: Callable[[Path], object], fault: str
) -> None:
    make(tmp_path / "port")
    open_before = len(os.listdir("/proc/self/fd"))
    desk = Desk(MissionClock.started_now(), port=str(tmp_path / "port"))
    with pytest.raises(HardwareFault, match=fault) as refused:
        await desk.radio.open()
    assert refused.value.remedy
    assert len(os.listdir("/proc/self/fd")) == open_before
    await desk.radio.close()


async def test_a_robot_is_asked_for_replies_with_packets_that_are_sent_anyway(line: SerialLine) -> None:
    desk, heard = Desk(MissionClock.started_now(), port=line.port), asyncio.Queue[bytes]()
    await desk.radio.open()
    desk.radio.hear(7, heard.put_nowait)
    asked_s, plain_s = await desk.send(b"H", 7), await desk.send(b"H", 8)
    assert [(one.kind, one.network_id) for one in line.listen()] == [(SerialKind.ASKING, 7), (SerialKind.COMMAND, 8)]
    assert asked_s is not None
    assert plain_s is not None
    assert asked_s == pytest.approx(plain_s + 10 * 11 / 115200), "and a reply of eleven bytes"
    for frame in (
        SerialFrame(SerialKind.REPLY, 9, b"of another robot"),
        SerialFrame(SerialKind.COMMAND, 7, b"no reply"),
        SerialFrame(SerialKind.REPLY, 7, b"R123"),
    ):
        line.say(line_bytes(frame))
    assert await asyncio.wait_for(heard.get(), WITHIN_S) == b"R123"
    for _packet in range(2):
        assert heard.empty()
        await desk.clock.sleep_s(REPLY_EVERY_S)
        await desk.send(b"H", 7)
    assert heard.get_nowait() == b"", "the reply to the second question is lost"
    await desk.radio.close()


@pytest.mark.parametrize("options", [{}, {"port": "/p", "baud": 1234}, {"port": "/p", "extra_s": -1}, {"prt": "/p"}])
def test_wrong_options_are_refused(options: dict[str, object]) -> None:
    with pytest.raises(WrongParameter):
        Desk(VirtualClock(), **options)
