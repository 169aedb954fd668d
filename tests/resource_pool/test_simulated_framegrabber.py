"""The simulated receiver and camera: a received signal is drawn, a failed drawing is reported, an end is prompt."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import pytest

import scout_model.camera
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.keys import Conversation
from backbone.waiting import end_tasks
from backbone.wire import Envelope, MalformedMessage, Reader, write
from resource_pool.drivers.interface import DriverSite, Picture
from resource_pool.drivers.simulated_video import GrabberOptions, SimulatedFramegrabber
from resource_pool.drivers.world_messages import AskWorld, WorldModel, WorldState
from scout_model.description import RobotPlace, WorldDescription
from scout_model.world import World

WORLD = WorldDescription(
    6.0, 6.0, robots=[RobotPlace("scout1", 1, 2.0, 2.0, 0.0), RobotPlace("scout2", 2, 4.0, 4.0, 0.0)]
)


class LateClock(VirtualClock):
    """A virtual clock of a machine on which each sleeper wakes too late by this time."""

    late_s = 0.0

    async def sleep_until_s(self, at_s: float) -> None:
        await super().sleep_until_s(at_s + self.late_s)


class Studio:
    """A world that is played by hand, and a driver that looks at it."""

    def __init__(self, rate_hz: float = 30.0) -> None:
        self.network, self.clock = LocalNetwork(), LateClock()
        self.remarks: list[str] = []
        self.world = World(WORLD)
        self.bus: LocalBus = self.network.join("resource_pool/world", self.clock)
        self.bus.serve("resource_pool/world", AskWorld, self._answer)
        self.bugs: list[BaseException] = []
        self.failed = asyncio.Event()
        parameters = SimpleNamespace(world="world", camera="paint", frame_rate_hz=rate_hz, options={})
        self.ear = self.network.join("resource_pool/grabber", self.clock)
        site = DriverSite(
            "grabber", self.ear, self.clock, parameters, lambda what: None, self._fail, remark=self.remarks.append
        )
        self.driver = SimulatedFramegrabber(site)

    def _fail(self, bug: BaseException) -> None:
        self.bugs.append(bug)
        self.failed.set()

    async def _answer(self, asked: Envelope[Any]) -> WorldModel:
        return WorldModel(self.world.mjcf, {"scout1": 1, "scout2": 2})

    def show(self, frame: int, transmitting: dict[str, str], state: bytes | None = None) -> None:
        drawn = self.world.state().tobytes() if state is None else state
        self.bus.publish("resource_pool/world", Conversation.BODIES, WorldState(frame, frame / 30, drawn, transmitting))

    async def close(self) -> None:
        await self.driver.close()
        await self.ear.close()
        await self.bus.close()


def collector() -> tuple[asyncio.Queue[Picture], Callable[[Picture], None]]:
    pictures: asyncio.Queue[Picture] = asyncio.Queue()
    return pictures, pictures.put_nowait


async def test_a_picture_tells_who_was_heard_on_the_tuned_frequency() -> None:
    studio = Studio()
    await studio.driver.open()
    pictures, deliver = collector()
    studio.driver.tune("video", deliver)
    for frame, transmitting in enumerate(
        [{"scout1": "video"}, {}, {"scout1": "video", "scout2": "video"}, {"scout1": "other", "scout2": "video"}], 1
    ):
        studio.show(frame, transmitting)
        picture = await asyncio.wait_for(pictures.get(), 5)
        heard = sorted(robot for robot, frequency in transmitting.items() if frequency == "video")
        assert (picture.transmitters, picture.robot) == (len(heard), heard[0] if len(heard) == 1 else "")
        assert (picture.width_px, picture.height_px, len(picture.pixels)) == (320, 240, 320 * 240)
        assert picture.captured_s == frame / 30
    assert not studio.bugs
    await studio.close()


async def test_a_drawing_that_fails_fails_the_rc() -> None:
    studio = Studio()
    await studio.driver.open()
    pictures, deliver = collector()
    studio.driver.tune("video", deliver)
    studio.show(1, {"scout1": "video"}, state=b"\0" * 8)
    await asyncio.wait_for(studio.failed.wait(), 5)
    assert type(studio.bugs[0]).__name__ == "StateMismatch"
    assert pictures.empty()
    await studio.close()


def test_a_state_of_broken_numbers_is_refused_by_its_reader_and_fails_no_rc() -> None:
    raw = write(Envelope(1, "resource_pool/world", 1, 0.0, "", WorldState(1, 0.0, bytes(8), {})))
    with pytest.raises(MalformedMessage, match="7 bytes are no vector of float64"):
        Reader(WorldState).read(raw.replace(b"\xc4\x08" + bytes(8), b"\xc4\x07" + bytes(7)))


async def test_what_is_being_drawn_at_the_end_of_a_hold_is_not_delivered() -> None:
    studio = Studio()
    await studio.driver.open()
    pictures, deliver = collector()
    studio.driver.tune("video", deliver)
    studio.show(1, {"scout1": "video"})
    await asyncio.sleep(0)
    studio.driver.stop()
    await asyncio.wait_for(studio.close(), 2)
    assert pictures.empty()
    assert not studio.bugs


def test_on_a_virtual_clock_each_picture_comes_one_capture_delay_after_its_frame_and_pictures_repeat() -> None:
    async def watch() -> list[tuple[float, float, bytes]]:
        studio = Studio(rate_hz=15.0)
        await studio.driver.open()
        seen: list[tuple[float, float, bytes]] = []

        def deliver(picture: Picture) -> None:
            seen.append((picture.captured_s, studio.clock.now_s(), bytes(picture.pixels)))

        studio.driver.tune("video", deliver)
        for frame in range(1, 41):
            await studio.clock.sleep_until_s(frame / 30)
            studio.world.step_frame()
            studio.show(frame, {"scout1": "video"})
        await studio.clock.sleep_s(0.5)
        assert not studio.bugs
        await studio.close()
        return seen

    seen = run_virtual(watch())
    assert [round(captured_s * 30, 6) for captured_s, _, _ in seen] == list(range(1, 41, 2))
    assert all(at_s == pytest.approx(captured_s + GrabberOptions().capture_delay_s) for captured_s, at_s, _ in seen)
    assert run_virtual(watch()) == seen


def test_on_a_full_processor_it_draws_fewer_pictures_says_so_and_draws_all_again_when_there_is_time() -> None:
    async def watch() -> tuple[int, int, list[str]]:
        studio = Studio(rate_hz=15.0)
        await studio.driver.open()
        pictures, deliver = collector()
        studio.driver.tune("video", deliver)
        frame, counts = 0, []
        for late_s, seconds in ((0.0, 10), (0.02, 20), (0.0, 90)):
            studio.clock.late_s = late_s
            before = pictures.qsize()
            for _frame in range(30 * seconds):
                frame += 1
                await studio.clock.sleep_s(1 / 30)
                studio.show(frame, {"scout1": "video"})
            counts.append(pictures.qsize() - before)
        assert not studio.bugs
        assert studio.driver.allowed_hz() == 15.0
        await studio.close()
        return counts[0], counts[1], studio.remarks

    in_time, late, remarks = run_virtual(watch())
    assert in_time == pytest.approx(150, abs=2)
    assert late < 100
    assert remarks[0].startswith("10 of 15 pictures a second")
    assert "1 of 15 pictures a second: control goes first on a full processor" in remarks
    assert remarks[-1] == ""


async def test_it_can_be_closed_before_it_was_opened_and_twice() -> None:
    studio = Studio()
    await studio.driver.close()
    await studio.close()


async def test_closed_while_it_opens_it_closes_its_renderer_and_holds_nobody_up(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun, may_go_on, log = threading.Event(), threading.Event(), list[str]()

    class SlowCamera:
        def __init__(self, *_given: object) -> None:
            begun.set()
            may_go_on.wait(5.0)
            log.append("made")

        def close(self) -> None:
            log.append("closed")

    monkeypatch.setattr(scout_model.camera, "Camera", SlowCamera)
    studio = Studio()
    opening = asyncio.create_task(studio.driver.open())
    await asyncio.to_thread(begun.wait, 5.0)
    await end_tasks(opening)
    closing = asyncio.create_task(studio.close())
    await asyncio.sleep(0.05)
    assert log == [], "the event loop goes on meanwhile"
    may_go_on.set()
    await closing
    assert log == ["made", "closed"]


class CountedCamera(scout_model.camera.Camera):
    """A camera that counts those that are open."""

    made = still_open = 0

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        CountedCamera.made += 1
        CountedCamera.still_open += 1

    def close(self) -> None:
        CountedCamera.still_open -= 1
        super().close()


@pytest.fixture
def counted(monkeypatch: pytest.MonkeyPatch) -> type[CountedCamera]:
    monkeypatch.setattr(scout_model.camera, "Camera", CountedCamera)
    monkeypatch.setattr(CountedCamera, "made", 0)
    monkeypatch.setattr(CountedCamera, "still_open", 0)
    return CountedCamera


async def test_neighbors_share_one_renderer_until_the_last_is_closed(counted: type[CountedCamera]) -> None:
    studios = [Studio() for _ in range(3)]
    await asyncio.gather(*(studio.driver.open() for studio in studios))
    assert (counted.made, counted.still_open) == (1, 1)
    await studios[0].close()
    await studios[1].close()
    assert counted.still_open == 1
    pictures, deliver = collector()
    studios[2].driver.tune("video", deliver)
    studios[2].show(1, {"scout1": "video"})
    assert (await asyncio.wait_for(pictures.get(), 5.0)).robot == "scout1"
    await studios[2].close()
    assert counted.still_open == 0


async def test_one_that_is_opened_again_draws_and_closes_its_renderer_again(counted: type[CountedCamera]) -> None:
    """As an exchange of the driver does that brings this one back."""
    studio = Studio()
    for times in (1, 2):
        await studio.driver.open()
        assert (counted.made, counted.still_open) == (times, 1)
        pictures, deliver = collector()
        studio.driver.tune("video", deliver)
        studio.show(times, {"scout1": "video"})
        assert (await asyncio.wait_for(pictures.get(), 5.0)).robot == "scout1"
        await studio.driver.close()
        assert counted.still_open == 0
    await studio.close()


async def test_neighbors_of_one_renderer_get_each_their_own_pictures(counted: type[CountedCamera]) -> None:
    studios, heard = [Studio() for _ in range(2)], [collector() for _ in range(2)]
    for studio, (_, deliver), frequency in zip(studios, heard, ("red", "blue"), strict=True):
        await studio.driver.open()
        studio.driver.tune(frequency, deliver)
    for studio in studios:
        studio.show(1, {"scout1": "red", "scout2": "blue"})
    got = [(await asyncio.wait_for(pictures.get(), 5.0)).robot for pictures, _ in heard]
    assert got == ["scout1", "scout2"]
    assert counted.made == 1
    for studio in studios:
        await studio.close()


async def test_a_renderer_that_does_not_open_fails_each_neighbor_and_the_next_try_may_succeed(
    counted: type[CountedCamera], monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(*_given: object) -> None:
        raise RuntimeError("no device")

    studios = [Studio() for _ in range(2)]
    with monkeypatch.context() as broken:
        broken.setattr(scout_model.camera, "Camera", breaks)
        failed = await asyncio.gather(*(studio.driver.open() for studio in studios), return_exceptions=True)
        assert [str(error) for error in failed] == ["no device"] * 2
    for studio in studios:
        await studio.close()
    again = Studio()
    await again.driver.open()
    assert counted.still_open == 1
    await again.close()
    assert counted.still_open == 0
