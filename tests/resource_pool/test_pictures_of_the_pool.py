"""Pictures arrive under the ARC with the epoch of its grant, and none after it."""

from __future__ import annotations

import asyncio
import dataclasses
import math
from typing import Any

import msgspec
import numpy as np
import pytest
from pool_on_local_network import Pool, a_pool
from pool_orders import EVERYTHING, at, connect, disconnect

from backbone.bus.clock import run_virtual
from backbone.component.messages import AskStatistics, Statistics, StoryEvent
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.ranges import MOST_PX
from backbone.wire import Envelope, MalformedMessage, Message, Reader, write
from mission_control.messages import GreyPicture
from resource_pool.commands import Tune
from resource_pool.drivers.interface import HardwareFault, Picture
from resource_pool.messages import Applied, Frame


def test_pictures_arrive_under_the_arc_with_the_epoch_of_the_grant(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, EVERYTHING) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "capture", "scout1")
            seen: list[Frame] = []
            await arc.wait_granted()
            frames = arc.frames(seen.append)
            driver = pool.grabber_driver
            assert driver.frequency == "video"
            for _ in range(3):
                driver.deliver(driver.picture())
                await pool.clock.sleep_s(0.05)
            assert [frame.number for frame in seen] == [1, 2, 3]
            assert {frame.epoch for frame in seen} == {arc.granted.epochs["grabber"]}
            frames.close()

    run_virtual(main())


def test_no_picture_arrives_after_the_disconnection_even_if_the_driver_goes_on(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            heard: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            await connect(pool, "grabber", "one", 1)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            late = driver.deliver
            late(driver.picture())
            await pool.clock.sleep_s(0.01)
            await disconnect(pool, "grabber", "one", 1)
            late(driver.picture())
            await connect(pool, "grabber", "one", 2)
            late(driver.picture())
            await pool.clock.sleep_s(0.01)
            assert [frame.epoch for frame in heard] == [1]
            assert driver.stops >= 1

    run_virtual(main())


WRONG = {
    "color": (np.zeros((4, 6, 3), np.uint8).reshape(-1).data, "72 pixels for 6 x 4"),
    "numbers of eight bytes": (np.zeros((4, 6)).data, "192 pixels for 6 x 4"),
    "every second row": (np.zeros((8, 6), np.uint8)[::2].data, "not contiguous"),
    "a list": ([0] * 24, "bytes-like object"),
}
EMPTY = {"nothing": (0, 0), "a row": (6, 1), "a row too long for any message": (8193, 2)}


async def delivered(pool: Pool, pixels: Any, width_px: Any = 6, height_px: Any = 4, **more: Any) -> list[Frame]:
    """Return what arrives of one picture of this size that a driver delivers from its thread."""
    heard: list[Frame] = []
    pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
    await connect(pool, "grabber", "one", 1)
    await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
    deliver = pool.grabber_driver.deliver
    given = {"captured_s": pool.clock.now_s(), "pixels": pixels, "width_px": width_px, "height_px": height_px}
    picture = Picture(**(given | more))
    asyncio.get_running_loop().call_soon_threadsafe(deliver, picture)
    await pool.clock.sleep_s(0.1)
    return heard


@pytest.mark.parametrize("kind", WRONG)
def test_a_driver_that_delivers_other_pixels_than_it_says_ends_the_rc(local_mission: Any, kind: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            pixels, told = WRONG[kind]
            assert await delivered(pool, pixels) == []
            assert pool.running["grabber"].statistics()["frames_delivered"] == 0
            assert not pool.is_alive("grabber")
            bug = await pool.outcome("grabber")
            assert isinstance(bug, HardwareFault)
            assert told in str(bug)

    run_virtual(main())


@pytest.mark.parametrize("kind", EMPTY)
def test_a_driver_that_delivers_a_picture_of_no_size_ends_the_rc_and_no_behavior(local_mission: Any, kind: str) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            width_px, height_px = EMPTY[kind]
            assert await delivered(pool, bytes(width_px * height_px), width_px, height_px) == []
            bug = await pool.outcome("grabber")
            assert isinstance(bug, HardwareFault)
            assert f"{width_px} x {height_px} pixels" in str(bug)

    run_virtual(main())


@pytest.mark.parametrize(
    "wrong",
    [
        {"width_px": 6.0},
        {"height_px": None},
        {"captured_s": None},
        {"captured_s": "1"},
        {"transmitters": None},
        {"robot": 5},
        {"robot": "x" * 256},
        {"kind": 5},
        {"kind": "x" * 256},
    ],
    ids=lambda wrong: f"{wrong}"[:20],
)
def test_a_value_of_another_type_than_declared_ends_the_rc_and_is_not_lost_in_a_callback(
    local_mission: Any, wrong: dict[str, Any]
) -> None:
    """OpenCV returns a video's width as a float; each listener dropped such a picture, and all was well."""

    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            assert await delivered(pool, bytes(24), **wrong) == []
            bug = await pool.outcome("grabber")
            assert isinstance(bug, HardwareFault)
            assert "delivers a wrong picture" in str(bug)

    run_virtual(main())


def test_a_picture_that_is_none_ends_the_rc(local_mission: Any) -> None:
    """OpenCV returns None for a picture that it did not get."""

    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            await delivered(pool, bytes(24))
            deliver: Any = pool.grabber_driver.deliver
            asyncio.get_running_loop().call_soon_threadsafe(deliver, None)
            bug = await pool.outcome("grabber")
            assert "delivers a wrong picture" in str(bug)

    run_virtual(main())


def test_kinds_without_number_are_counted_together(local_mission: Any) -> None:
    """Otherwise the statistics of a driver with a name for each picture become too long for a message."""

    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            await delivered(pool, bytes(24), kind="torn")
            driver = pool.grabber_driver
            assert driver.deliver is not None
            for number in range(500):
                await pool.clock.sleep_s(1e-3)
                driver.deliver(dataclasses.replace(driver.picture(), kind=f"noise of {number}"))
            told = await pool.ear.ask(at("grabber"), AskStatistics(), Statistics, within_s=1)
            assert len(told.values) < 256
            assert told.values["frames_torn"] == 1
            assert sum(count for name, count in told.values.items() if name.startswith("frames_noise")) < 500
            assert told.values["frames_other"] > 400

    run_virtual(main())


def test_numbers_of_numpy_become_those_of_a_message(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            now_s = np.float32(pool.clock.now_s() + 0.5)
            [frame] = await delivered(pool, bytes(24), width_px=np.int64(6), captured_s=now_s)
            assert (type(frame.width_px), type(frame.captured_s)) == (int, float)

    run_virtual(main())


@pytest.mark.parametrize("pixels", [bytes(range(24)), np.arange(24, dtype=np.uint8).reshape(4, 6)])
def test_pixels_may_come_as_bytes_or_in_rows(local_mission: Any, pixels: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            [frame] = await delivered(pool, pixels)
            assert bytes(frame.pixels) == bytes(range(24))

    run_virtual(main())


def test_garbled_and_silent_pictures_are_counted_and_not_delivered(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            heard: list[Frame] = []
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            await connect(pool, "grabber", "one", 1)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            for transmitters in (0, 2, 1, 3, -1, 0):
                driver.deliver(driver.picture(transmitters))
                await pool.clock.sleep_s(0.01)
            statistics = pool.running["grabber"].statistics()
            assert len(heard) == 2
            assert (statistics["frames_delivered"], statistics["frames_garbled"], statistics["frames_silent"]) == (
                2,
                2,
                2,
            )

    run_virtual(main())


@pytest.mark.parametrize(("off_s", "is_told"), [(-0.5, False), (-60.0, True), (60.0, True), (math.nan, True)])
def test_a_picture_of_another_time_is_not_delivered_and_hides_no_later_one(
    local_mission: Any, off_s: float, is_told: bool
) -> None:
    """Pictures that wait in a driver when another frequency is tuned, and a driver with a clock of its own."""

    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            heard, told = list[Frame](), list[StoryEvent]()
            pool.ear.subscribe("resource_pool/*", Conversation.FRAMES, Frame, lambda e: heard.append(e.body))
            pool.ear.subscribe(at("grabber"), Conversation.LOG, StoryEvent, lambda e: told.append(e.body))
            await pool.clock.sleep_s(100.0 - pool.clock.now_s())
            await connect(pool, "grabber", "one", 1)
            await pool.voice("one").ask(at("grabber"), Tune("video").under("one", 1), Applied, within_s=1)
            driver = pool.grabber_driver
            for _ in range(2):
                picture = driver.picture()
                driver.deliver(dataclasses.replace(picture, captured_s=picture.captured_s + off_s))
                driver.deliver(picture)
                await pool.clock.sleep_s(0.1)
            assert [(frame.number, frame.captured_s) for frame in heard] == [(1, 100.0), (2, 100.1)]
            assert pool.running["grabber"].statistics()["frames_mistimed"] == 2
            assert sum("of mission time" in event.what for event in told) == is_told

    run_virtual(main())


def test_a_frequency_the_framegrabber_does_not_receive_is_refused(local_mission: Any) -> None:
    async def main() -> None:
        async with a_pool(local_mission, ["grabber"], manager=False) as pool:
            await connect(pool, "grabber", "one", 1)
            with pytest.raises(Refusal) as refused:
                await pool.voice("one").ask(at("grabber"), Tune("elsewhere").under("one", 1), Applied, within_s=1)
            assert refused.value.code == "framegrabber.frequency"
            assert pool.grabber_driver.deliver is None

    run_virtual(main())


@pytest.mark.parametrize("size_px", [(0, 0), (0, 8192), (8192, 0), (8193, 1), (1, 8193), (8192, 1), (1, 8192)], ids=str)
@pytest.mark.parametrize(
    "picture",
    [Frame("grabber", "eyes", 3, "scout1", 1, 0.5, 1, 1, b"\0"), GreyPicture("scout1", 0.5, 1, 1, b"\0")],
    ids=lambda picture: type(picture).__name__,
)
def test_a_picture_without_pixels_or_with_too_many_is_malformed(picture: Message, size_px: tuple[int, int]) -> None:
    width_px, height_px = size_px
    sized = msgspec.structs.replace(picture, width_px=width_px, height_px=height_px, pixels=bytes(width_px * height_px))
    raw, reader = write(Envelope(1, "resource_pool/grabber", 1, 0.5, "", sized)), Reader(type(picture))
    if all(1 <= side <= MOST_PX for side in size_px):
        assert reader.read(raw).body == sized
    else:
        with pytest.raises(MalformedMessage, match=r"[<>]= "):
            reader.read(raw)
