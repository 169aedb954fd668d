"""A file is played as a camera: each picture at its time, on a virtual clock the same each time."""

from __future__ import annotations

import asyncio
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import numpy as np
import pytest
from small_recordings import Said, recorded
from small_videos import HEIGHT_PX, WIDTH_PX, number_of, video

from backbone.bus.clock import MissionClock, VirtualClock, run_virtual
from backbone.component.messages import WrongParameter
from backbone.keys import Conversation
from resource_pool.drivers.interface import DriverSite, FixedOption, HardwareFault, Picture
from resource_pool.drivers.opencv_pictures import VideoFilm
from resource_pool.drivers.recorded import RecordedCamera
from resource_pool.messages import Frame


class Stage:
    """A recorded camera and its RC's side, which is played by hand."""

    def __init__(self, clock: Any, rate_hz: float = 30.0, **options: object) -> None:
        self.clock, self.remarks, self.bugs = clock, list[str](), list[BaseException]()
        self.seen: list[tuple[float, int]] = []
        self.pictures: list[Picture] = []
        self.failed = asyncio.Event()
        self.driver = RecordedCamera(self.site(rate_hz, **options))

    def site(self, rate_hz: float, **options: object) -> DriverSite:
        bus: Any = None
        parameters = SimpleNamespace(frame_rate_hz=rate_hz, options=options)
        told = [self.remarks.append, self._fail]
        return DriverSite("grabber", bus, self.clock, parameters, print, told[1], remark=told[0])

    def deliver(self, picture: Picture) -> None:
        self.pictures.append(picture)
        self.seen.append((round(picture.captured_s, 6), number_of(picture.pixels)))

    async def arrived(self, pictures: int) -> None:
        """Return when so many pictures were delivered."""
        async with asyncio.timeout(10.0):
            while len(self.seen) < pictures:
                await self.clock.sleep_s(0.01)

    def _fail(self, bug: BaseException) -> None:
        self.bugs.append(bug)
        self.failed.set()


def played(*, tuned_s: float = 0.0, until_s: float = 2.0, rate_hz: float = 30.0, **options: object) -> Stage:
    """Return what was seen of a file in virtual time."""

    async def play() -> Stage:
        stage = Stage(VirtualClock(), rate_hz, **options)
        await stage.driver.open()
        await stage.clock.sleep_until_s(tuned_s)
        stage.driver.tune("video1", stage.deliver)
        await stage.clock.sleep_until_s(until_s)
        await stage.driver.close()
        assert not stage.bugs
        return stage

    return run_virtual(play())


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> str:
    """Six pictures, ten a second."""
    return str(video(tmp_path_factory.mktemp("footage") / "footage.avi"))


def test_each_picture_of_a_video_comes_at_its_time_and_the_end_is_told(footage: str) -> None:
    stage = played(file=footage)
    assert stage.seen == [(0.0, 0), (0.1, 1), (0.2, 2), (0.3, 3), (0.4, 4), (0.5, 5)]
    assert played(file=footage).seen == stage.seen
    assert stage.remarks == [
        f"10 of 30 pictures a second: {footage} has no more",
        f"{footage} has ended, and is not repeated",
    ]
    first = stage.pictures[0]
    assert (first.width_px, first.height_px, len(first.pixels)) == (WIDTH_PX, HEIGHT_PX, WIDTH_PX * HEIGHT_PX)
    assert (first.transmitters, first.robot) == (-1, "")


def test_a_repeated_video_begins_again_one_picture_after_its_last_one(footage: str) -> None:
    stage = played(file=footage, loop=True, tuned_s=0.35, until_s=1.35)
    assert stage.seen[:5] == [(0.4, 4), (0.5, 5), (0.6, 0), (0.7, 1), (0.8, 2)]
    assert len(stage.seen) == 10


def test_no_picture_is_older_than_the_tuning_and_none_comes_after_the_stop(footage: str) -> None:
    async def play() -> list[tuple[float, int]]:
        stage = Stage(VirtualClock(), file=footage)
        await stage.driver.open()
        await stage.clock.sleep_until_s(0.15)
        stage.driver.tune("video1", stage.deliver)
        await stage.clock.sleep_until_s(0.35)
        stage.driver.stop()
        await stage.clock.sleep_until_s(0.45)
        stage.driver.tune("video2", stage.deliver)
        await stage.clock.sleep_until_s(2.0)
        await stage.driver.close()
        return stage.seen

    assert run_virtual(play()) == [(0.2, 2), (0.3, 3), (0.5, 5)]


def test_fewer_pictures_are_delivered_if_fewer_are_requested(footage: str) -> None:
    stage = played(file=footage, rate_hz=5.0)
    assert stage.seen == [(0.0, 0), (0.2, 2), (0.4, 4)]
    assert stage.remarks[0] == ""


def test_a_driver_that_is_opened_again_plays_from_the_begin(footage: str) -> None:
    async def play() -> list[tuple[float, int]]:
        stage = Stage(VirtualClock(), file=footage)
        for _again in range(2):
            await stage.driver.open()
            stage.driver.tune("video1", stage.deliver)
            await stage.clock.sleep_s(0.25)
            await stage.driver.close()
            await stage.driver.close()
        return stage.seen

    assert run_virtual(play()) == [(0.0, 0), (0.1, 1), (0.2, 2), (0.25, 0), (0.35, 1), (0.45, 2)]


def stand_still(clock: MissionClock, until_s: float) -> None:
    """Let no other callback of the event loop run until this time."""
    while clock.now_s() < until_s:
        time.sleep(0.001)


async def test_an_event_loop_that_was_late_gets_only_pictures_of_now(footage: str) -> None:
    stage = Stage(MissionClock.started_now(), file=footage, loop=True)
    await stage.driver.open()
    began_s = stage.clock.now_s()
    stage.driver.tune("video1", stage.deliver)
    stand_still(stage.clock, began_s + 0.55)
    await stage.arrived(3)
    await stage.driver.close()
    assert stage.seen[0][0] > began_s + 0.35, f"{stage.seen} since {began_s}"


async def test_a_late_event_loop_gets_no_picture_from_before_the_tuning(footage: str) -> None:
    stage = Stage(MissionClock.started_now(), file=footage, loop=True)
    await stage.driver.open()
    began_s = stage.clock.now_s()
    stand_still(stage.clock, began_s + 0.25)
    stage.driver.tune("video1", stage.deliver)
    tuned_s = stage.clock.now_s()
    await stage.arrived(2)
    await stage.driver.close()
    assert stage.seen[0][0] >= round(tuned_s, 6) - 1e-6


class LateFilmClock(VirtualClock):
    """A clock of a machine on which each sleeper wakes 20 ms late."""

    async def sleep_until_s(self, at_s: float) -> None:
        await super().sleep_until_s(at_s + 0.02)


def test_on_a_full_processor_fewer_pictures_are_delivered_and_it_is_shown(footage: str) -> None:
    async def play() -> Stage:
        stage = Stage(LateFilmClock(), 10.0, file=footage, loop=True)
        await stage.driver.open()
        stage.driver.tune("video1", stage.deliver)
        await stage.clock.sleep_until_s(20.0)
        await stage.driver.close()
        return stage

    stage = run_virtual(play())
    assert "6.67 of 10 pictures a second: control goes first on a full processor" in stage.remarks
    assert stage.driver.allowed_hz() < 3.0
    assert len(stage.seen) < 100


async def test_a_picture_that_is_being_decoded_at_the_stop_is_not_delivered(
    footage: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, may_go_on, decode = threading.Event(), threading.Event(), VideoFilm.picture

    def slowly(film: VideoFilm, captured_s: float) -> Picture | None:
        begun.set()
        may_go_on.wait(5.0)
        return decode(film, captured_s)

    monkeypatch.setattr(VideoFilm, "picture", slowly)
    stage = Stage(MissionClock.started_now(), file=footage)
    await stage.driver.open()
    stage.driver.tune("video1", stage.deliver)
    await asyncio.to_thread(begun.wait, 5.0)
    stage.driver.stop()
    may_go_on.set()
    await stage.clock.sleep_s(0.3)
    assert stage.seen == []
    await stage.driver.close()


def test_a_damaged_picture_is_left_out(footage: str, monkeypatch: pytest.MonkeyPatch) -> None:
    decode = VideoFilm.picture
    monkeypatch.setattr(VideoFilm, "picture", lambda film, at_s: None if 0.15 < at_s < 0.25 else decode(film, at_s))
    assert [number for _at_s, number in played(file=footage).seen] == [0, 1, 3, 4, 5]


def frames(pictures: int, key: str = "watch-capture") -> Iterator[Said]:
    for number in range(pictures):
        at_s = 100.0 + 0.1 * number + (0.5 if number > 2 else 0.0)
        pixels = np.full(WIDTH_PX * HEIGHT_PX, 40 * number, np.uint8).tobytes()
        frame = Frame("grabber", key, 3, "scout1", number, at_s, WIDTH_PX, HEIGHT_PX, pixels)
        yield Said(at_s + 0.03, f"resource_pool/{key}", Conversation.FRAMES, frame, f"resource_pool/{key}")


def test_a_camera_of_a_recording_is_played_at_the_times_of_its_captures(tmp_path: Path) -> None:
    """Also across a pause, in which another ARC held the framegrabber."""
    night = tmp_path / "night.mcap"
    night.write_bytes(recorded(frames(5)).getvalue())
    stage = played(file=str(night))
    assert stage.seen == [(0.0, 0), (0.1, 1), (0.2, 2), (0.8, 3), (0.9, 4)]
    assert stage.remarks[-1] == f"{night} has ended, and is not repeated"
    assert played(file=str(night), loop=True, until_s=2.5).seen[:5] == stage.seen


def test_a_picture_that_is_not_newer_than_the_last_one_is_left_out(tmp_path: Path) -> None:
    night, [first, second, third] = tmp_path / "night.mcap", frames(3)
    late = third._replace(body=msgspec.structs.replace(third.body, captured_s=second.body.captured_s - 0.05))
    night.write_bytes(recorded([first, second, late, *list(frames(5))[3:]]).getvalue())
    assert [number for _at_s, number in played(file=str(night)).seen] == [0, 1, 3, 4]


def test_of_several_cameras_one_must_be_named(tmp_path: Path) -> None:
    night = tmp_path / "night.mcap"
    said = sorted([*frames(3), *frames(4, "drive-capture")], key=lambda one: one.at_s)
    night.write_bytes(recorded(said).getvalue())
    with pytest.raises(HardwareFault, match="several cameras") as refused:
        played(file=str(night))
    keys = "resource_pool/drive-capture/frames, resource_pool/watch-capture/frames"
    assert refused.value.remedy == f"Name one in option 'key'; there is: {keys}."
    assert len(played(file=str(night), key="resource_pool/drive-capture/frames").seen) == 4
    assert len(played(file=str(night), key="*/watch-capture/*").seen) == 3
    with pytest.raises(HardwareFault, match="no pictures of key nowhere"):
        played(file=str(night), key="nowhere")


@pytest.mark.parametrize(
    ("name", "content", "fault"),
    [
        ("missing.mp4", None, "there is no file /"),
        ("text.mp4", b"no video", "OpenCV cannot play /"),
        ("text.mcap", b"no recording", "no recording: it begins as another kind of file"),
        ("empty.mcap", b"", "no recording: the file is empty"),
    ],
)
def test_a_file_that_cannot_be_played_is_a_hardware_fault(
    tmp_path: Path, name: str, content: bytes | None, fault: str
) -> None:
    if content is not None:
        (tmp_path / name).write_bytes(content)
    with pytest.raises(HardwareFault, match=fault) as refused:
        played(file=str(tmp_path / name))
    assert refused.value.remedy


def test_a_file_that_ends_while_it_is_repeated_is_reported(tmp_path: Path) -> None:
    path = video(tmp_path / "short.avi", 3)

    async def play() -> list[BaseException]:
        stage = Stage(VirtualClock(), file=str(path), loop=True)
        await stage.driver.open()
        path.write_bytes(b"")
        await asyncio.wait_for(stage.failed.wait(), 5.0)
        await stage.driver.close()
        return stage.bugs

    [bug] = run_virtual(play())
    assert isinstance(bug, HardwareFault)
    assert "cannot play" in bug.detail


def test_the_rate_may_change_while_it_plays_and_the_file_may_not(footage: str) -> None:
    async def play() -> list[tuple[float, int]]:
        stage = Stage(VirtualClock(), 0.1, file=footage)
        await stage.driver.open()
        stage.driver.tune("video1", stage.deliver)
        await stage.clock.sleep_until_s(0.05)
        with pytest.raises(FixedOption):
            stage.driver.adjust(stage.site(5.0, file="another.avi"))
        stage.driver.adjust(stage.site(5.0, file=footage))
        assert stage.driver.allowed_hz() == 5.0
        await stage.clock.sleep_until_s(1.0)
        end = stage.remarks[-1]
        stage.driver.adjust(stage.site(30.0, file=footage))
        assert stage.remarks[-1] == end, "the end is not forgotten"
        await stage.driver.close()
        return stage.seen

    assert run_virtual(play()) == [(0.0, 0), (0.1, 1), (0.3, 3), (0.5, 5)]


def test_a_driver_without_a_file_is_refused() -> None:
    with pytest.raises(WrongParameter, match="file"):
        Stage(VirtualClock())
