"""A camera delivers new pictures at most at the requested rate; one that fails in any way is a hardware fault."""

from __future__ import annotations

import asyncio
import queue
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from network_camera import network_camera
from small_videos import HEIGHT_PX, WIDTH_PX, number_of, video

from backbone.bus.clock import MissionClock
from backbone.component.messages import WrongParameter
from resource_pool.drivers import opencv_pictures, picture_pace, video_device
from resource_pool.drivers.interface import DriverSite, FixedOption, HardwareFault, Picture
from resource_pool.drivers.video_device import VideoDevice

WITHIN_S = 10.0


class Bench:
    """A video device, and its RC's side, which is played by hand."""

    def __init__(self, rate_hz: float = 30.0, links: tuple[str, ...] = ("video1",), **options: object) -> None:
        self.clock = MissionClock.started_now()
        self.told, self.remarks, self.bugs = list[str](), list[str](), list[BaseException]()
        self.pictures: asyncio.Queue[Picture] = asyncio.Queue()
        self.failed = asyncio.Event()
        self._links = {"video_frequency": [*links]}
        self.driver = VideoDevice(self.site(rate_hz, **options))

    def site(self, rate_hz: float, **options: object) -> DriverSite:
        bus: Any = None
        parameters = SimpleNamespace(frame_rate_hz=rate_hz, options=options, links=self._links)
        told, fail, remark = self.told.append, self._fail, self.remarks.append
        return DriverSite("grabber", bus, self.clock, parameters, told, fail, remark=remark)

    def _fail(self, bug: BaseException) -> None:
        self.bugs.append(bug)
        self.failed.set()

    async def open(self, capture: FakeCapture) -> None:
        """Open it, and return when its thread waits for the first picture."""
        await self.driver.open()
        await eventually(lambda: capture.has_taken(0), "it takes pictures")

    def tune(self) -> float:
        """Tune it; return the mission time before."""
        now_s = self.clock.now_s()
        self.driver.tune("video1", self.pictures.put_nowait)
        return now_s

    async def next(self) -> Picture:
        return await asyncio.wait_for(self.pictures.get(), WITHIN_S)

    async def fault(self) -> HardwareFault:
        await asyncio.wait_for(self.failed.wait(), WITHIN_S)
        [bug] = self.bugs
        assert isinstance(bug, HardwareFault)
        assert bug.remedy
        return bug


class FakeCapture:
    """In place of the open device: the test shows pictures, unplugs it, or lets it hang."""

    def __init__(self) -> None:
        self.shown: queue.Queue[int | None] = queue.Queue()
        self.threads, self.closed, self.decoded = set[str](), threading.Event(), 0
        self._grabs = 0
        self._level: int | None = 0

    def show(self, *levels: int) -> None:
        for level in levels:
            self.shown.put(level)

    def unplug(self) -> None:
        self.shown.put(None)

    def has_taken(self, pictures: int) -> bool:
        """Return whether the thread has done with so many pictures and waits for the next one."""
        return self._grabs > pictures

    def grab(self) -> bool:
        self._grabs += 1
        self.threads.add(threading.current_thread().name)
        self._level = self.shown.get()
        return self._level is not None

    def picture(self, captured_s: float) -> Picture | None:
        self.decoded += 1
        level = self._level or 0
        return None if level < 0 else Picture(captured_s, memoryview(bytes([level]) * 16), 4, 4)

    def size_px(self) -> tuple[int, int]:
        return 4, 4

    def close(self) -> None:
        self.closed.set()


@pytest.fixture
def capture(monkeypatch: pytest.MonkeyPatch) -> FakeCapture:
    fake = FakeCapture()
    monkeypatch.setattr(opencv_pictures, "open_camera", lambda *_asked: fake)
    return fake


async def eventually(holds: Callable[[], bool], what: str) -> None:
    begun_s = time.monotonic()
    while not holds():
        assert time.monotonic() < begun_s + WITHIN_S, what
        await asyncio.sleep(0.005)


async def test_a_camera_of_the_network_delivers_grey_pictures_of_now() -> None:
    with network_camera() as camera:
        bench = Bench(device=camera.address)
        await bench.driver.open()
        tuned_s = bench.tune()
        pictures = [await bench.next() for _ in range(8)]
        await bench.driver.close()
    times_s = [picture.captured_s for picture in pictures]
    assert times_s == sorted(times_s)
    assert tuned_s <= times_s[0]
    assert times_s[-1] <= bench.clock.now_s()
    assert {(one.width_px, one.height_px, len(one.pixels)) for one in pictures} == {
        (WIDTH_PX, HEIGHT_PX, WIDTH_PX * HEIGHT_PX)
    }
    assert {(one.transmitters, one.robot) for one in pictures} == {(-1, "")}
    numbers = [number_of(one.pixels) for one in pictures]
    assert len(set(numbers)) > 3, numbers
    assert not bench.bugs


async def test_a_camera_that_is_unplugged_is_a_hardware_fault() -> None:
    with network_camera() as camera:
        bench = Bench(device=camera.address)
        await bench.driver.open()
        bench.tune()
        await bench.next()
        camera.unplugged.set()
        assert (await bench.fault()).detail == f"{camera.address} delivers no more pictures"
        await bench.driver.close()


async def test_it_may_be_closed_and_opened_again_and_closed_twice() -> None:
    with network_camera() as camera:
        bench = Bench(device=camera.address)
        await bench.driver.close()
        for _again in range(2):
            await bench.driver.open()
            bench.tune()
            await bench.next()
            await bench.driver.close()
            await bench.driver.close()
        assert not bench.bugs


@pytest.mark.parametrize(
    ("device", "fault"),
    [
        ("missing", "there is no video device "),
        ("video.avi", " is a file, no video device"),
        ("folder", " cannot be opened: it is missing, in use, or no camera"),
        ("http://ann:secret@127.0.0.1:9/video.mjpg", r"^http://127\.0\.0\.1:9/video\.mjpg cannot be opened: "),
        (99, "video device 99 cannot be opened: it is missing, in use, or no camera"),
    ],
)
async def test_a_device_that_cannot_be_opened_is_a_hardware_fault(
    tmp_path: Path, device: str | int, fault: str
) -> None:
    video(tmp_path / "video.avi", 1)
    (tmp_path / "folder").mkdir()
    bench = Bench(device=str(tmp_path / device) if isinstance(device, str) and "://" not in device else device)
    with pytest.raises(HardwareFault, match=fault) as refused:
        await asyncio.wait_for(bench.driver.open(), WITHIN_S)
    assert refused.value.remedy
    await bench.driver.close()
    assert not bench.bugs


async def test_only_pictures_that_came_after_the_tuning_are_delivered_and_none_after_the_stop(
    capture: FakeCapture,
) -> None:
    bench = Bench()
    await bench.open(capture)
    capture.show(1, 2)
    await eventually(lambda: capture.has_taken(2), "it takes pictures while none are requested")
    assert capture.decoded == 0
    bench.tune()
    capture.show(3)  # it was awaited before the tuning, so its time is not known to be after it
    capture.show(4)
    assert (await bench.next()).pixels[0] == 4
    bench.driver.stop()
    capture.show(5, 6)
    await eventually(lambda: capture.has_taken(6), "it takes pictures after the stop")
    assert bench.pictures.empty()
    await close(bench, capture)
    assert not bench.bugs


async def close(bench: Bench, capture: FakeCapture) -> None:
    closing = asyncio.create_task(bench.driver.close())
    await asyncio.sleep(0)
    capture.show(0)  # the picture for which the thread waits
    await closing
    assert capture.closed.is_set()
    assert capture.threads == {"read grabber"}


def show_in_turn(capture: FakeCapture, number: int) -> None:
    """Show picture ``number``, counted from 0, and wait until it is taken; the event loop stands still meanwhile."""
    time.sleep(0.02)
    capture.show(number)
    begun_s = time.monotonic()
    while not capture.has_taken(number + 1):
        assert time.monotonic() < begun_s + WITHIN_S
        time.sleep(0.001)


async def test_a_late_event_loop_gets_the_newest_picture_alone(capture: FakeCapture) -> None:
    bench = Bench(rate_hz=1000.0)
    await bench.open(capture)
    bench.tune()
    capture.show(0, 1)
    assert (await bench.next()).pixels[0] == 1
    for level in range(2, 6):
        show_in_turn(capture, level)
    assert (await bench.next()).pixels[0] == 5
    assert bench.pictures.empty()
    await close(bench, capture)


async def test_a_picture_that_waits_for_the_event_loop_at_the_stop_is_not_delivered(capture: FakeCapture) -> None:
    bench = Bench(rate_hz=1000.0)
    await bench.open(capture)
    bench.tune()
    show_in_turn(capture, 0)
    show_in_turn(capture, 1)
    bench.driver.stop()
    await asyncio.sleep(0.02)
    assert bench.pictures.empty()
    await close(bench, capture)


async def test_a_damaged_picture_is_left_out(capture: FakeCapture) -> None:
    bench, bugs = Bench(rate_hz=1000.0), list[object]()
    asyncio.get_running_loop().set_exception_handler(lambda _loop, bug: bugs.append(bug))
    await bench.open(capture)
    bench.tune()
    for level in (0, -1, 7):
        capture.show(level)
        await asyncio.sleep(0.02)
    assert (await bench.next()).pixels[0] == 7
    await close(bench, capture)
    assert not bugs


async def test_a_device_that_is_silent_is_a_hardware_fault_and_holds_up_nothing(
    capture: FakeCapture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video_device, "SILENT_S", 0.1)
    monkeypatch.setattr(video_device, "CLOSES_WITHIN_S", 0.1)
    bench = Bench()
    await bench.open(capture)
    bench.tune()
    assert (await bench.fault()).detail == "video device 0 delivered no picture for 0.1 s"
    await asyncio.wait_for(bench.driver.close(), WITHIN_S)
    capture.unplug()  # the call returns at last
    await asyncio.to_thread(capture.closed.wait, WITHIN_S)
    await asyncio.sleep(0.01)
    assert len(bench.bugs) == 1


async def test_an_opening_that_is_cut_off_closes_the_device(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, may_go_on, fake = threading.Event(), threading.Event(), FakeCapture()

    def opens(*_asked: object) -> FakeCapture:
        begun.set()
        may_go_on.wait(WITHIN_S)
        return fake

    monkeypatch.setattr(opencv_pictures, "open_camera", opens)
    bench = Bench()
    opening = asyncio.create_task(bench.driver.open())
    await asyncio.to_thread(begun.wait, WITHIN_S)
    opening.cancel()
    await asyncio.wait({opening})
    may_go_on.set()
    assert await asyncio.to_thread(fake.closed.wait, WITHIN_S)
    assert not fake.threads
    assert not bench.bugs


async def test_at_most_the_requested_pictures_are_delivered() -> None:
    with network_camera(rate_hz=50.0) as camera:
        bench = Bench(rate_hz=10.0, device=camera.address)
        await bench.driver.open()
        bench.tune()
        times_s = [(await bench.next()).captured_s for _ in range(6)]
        await bench.driver.close()
    assert times_s[-1] - times_s[0] > 0.45


async def test_the_rate_may_change_while_it_runs_and_the_device_may_not(capture: FakeCapture) -> None:
    bench = Bench(rate_hz=0.01)
    await bench.open(capture)
    bench.tune()
    capture.show(0, 1, 2, 3)
    await eventually(lambda: capture.has_taken(4), "it takes all pictures")
    assert [(await bench.next()).pixels[0], bench.pictures.qsize()] == [1, 0]
    with pytest.raises(FixedOption):
        bench.driver.adjust(bench.site(1000.0, device=1))
    bench.driver.adjust(bench.site(1000.0))
    capture.show(4, 5)
    assert (await bench.next()).pixels[0] == 5
    await close(bench, capture)


async def test_a_device_that_is_slower_than_requested_is_told(
    capture: FakeCapture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(video_device, "WINDOW_S", 0.05)
    bench = Bench(rate_hz=30.0)
    await bench.open(capture)
    assert bench.driver.allowed_hz() == 30.0
    while not bench.remarks:
        await asyncio.sleep(0.1)
        capture.show(1)
    assert bench.driver.allowed_hz() < 15.0
    assert bench.remarks[0].endswith(" of 30 pictures a second: the device delivers no more")
    while bench.remarks[-1]:
        capture.show(1)
        await asyncio.sleep(0.001)
    await close(bench, capture)


async def test_on_a_full_processor_it_delivers_fewer_pictures_and_says_so(
    capture: FakeCapture, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(picture_pace, "WINDOW_S", 0.2)
    bench = Bench(rate_hz=30.0)
    await bench.open(capture)
    bench.tune()
    number, begun_s = 0, time.monotonic()
    while not any("control goes first on a full processor" in remark for remark in bench.remarks):
        assert time.monotonic() < begun_s + WITHIN_S
        show_in_turn(capture, number)
        time.sleep(2 * picture_pace.LATE_S)  # noqa: ASYNC251  the event loop is late
        await asyncio.sleep(0)
        number += 1
    assert bench.driver.allowed_hz() < 30.0
    await close(bench, capture)


async def test_a_wished_size_that_the_device_lacks_is_told(capture: FakeCapture) -> None:
    bench = Bench(width_px=320)
    await bench.open(capture)
    assert bench.told == ["video device 0 delivers 4 x 4 pixels, not 320 x 4"]
    await close(bench, capture)


def test_a_device_without_a_tuner_is_linked_to_one_frequency() -> None:
    with pytest.raises(WrongParameter, match="has no tuner, and is linked to video1, video2"):
        asyncio.run(_made(links=("video1", "video2")))
    with pytest.raises(WrongParameter, match="width_px"):
        asyncio.run(_made(width_px=-1))


async def _made(**given: Any) -> Bench:
    return Bench(**given)
