"""A real camera or its footage in a mission whose robot and radio are simulated, as the guide shows it."""

from __future__ import annotations

import asyncio
import textwrap
from pathlib import Path
from typing import Any

import pytest
from network_camera import network_camera
from running_mission import RunningMission, mission_up
from small_videos import HEIGHT_PX, WIDTH_PX, number_of, video

from backbone.bus.interface import Bus
from backbone.keys import Conversation
from backbone.wire import Envelope
from resource_pool.messages import Frame

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

DOCS = Path(__file__).parents[2] / "docs"
WEBCAM, GUIDE = DOCS / "examples" / "webcam.xml", DOCS / "how-to" / "use-real-devices.md"
DEVICE = '<parameter name="device" value="0"/>'
WITHIN_S = 30.0


def resource_in(text: str) -> str:
    """Return the first framegrabber in the text, without indentation."""
    begin = text.index('<resource type="framegrabber"')
    begin -= len(text[:begin]) - len(text[:begin].rstrip(" "))
    return textwrap.dedent(text[begin : text.index("</resource>", begin) + len("</resource>")])


def frames_of(bus: Bus) -> asyncio.Queue[Frame]:
    frames: asyncio.Queue[Frame] = asyncio.Queue()

    def heard(envelope: Envelope[Any]) -> None:
        frames.put_nowait(envelope.body)

    bus.subscribe("resource_pool/*", Conversation.FRAMES, Frame, heard)
    return frames


async def seen(mission: RunningMission, frames: asyncio.Queue[Frame], pictures: int) -> list[tuple[float, int]]:
    """Return when the next frames were captured, and which pictures they show."""
    try:
        got = [await asyncio.wait_for(frames.get(), WITHIN_S) for _ in range(pictures)]
    except TimeoutError:
        raise AssertionError(f"no pictures\n{mission.story()}") from None
    assert {(one.robot, one.width_px, one.height_px) for one in got} == {("scout1", WIDTH_PX, HEIGHT_PX)}
    return [(one.captured_s, number_of(memoryview(one.pixels))) for one in got]


def kinds(shown: list[tuple[float, int]]) -> set[int]:
    return {number for _captured_s, number in shown}


async def test_a_mission_shows_a_camera_and_shows_it_again_when_it_is_plugged_in_again() -> None:
    with network_camera() as camera:
        address = f'<parameter name="device" value="{camera.address}"/>'
        with mission_up(mission_xml=WEBCAM, change={DEVICE: address}) as mission:
            async with mission.bus() as bus:
                frames = frames_of(bus)
                assert len(kinds(await seen(mission, frames, 10))) > 3
                camera.unplugged.set()
                await asyncio.to_thread(mission.wait_for_line, "video.mjpg delivers no more pictures", WITHIN_S)
                while not frames.empty():
                    frames.get_nowait()
                camera.unplugged.clear()
                assert len(kinds(await seen(mission, frames, 10))) > 3


@pytest.mark.thorough
async def test_a_mission_plays_footage_as_the_guide_shows_it(tmp_path: Path) -> None:
    """Each picture of the file is that of its time, again and again."""
    footage = video(tmp_path / "corridor.avi", 6, rate_hz=10.0)
    recorded = resource_in(GUIDE.read_text().partition("## Footage")[2]).replace("corridor.mp4", str(footage))
    assert str(footage) in recorded
    grabber = textwrap.indent(resource_in(WEBCAM.read_text()), "    ")
    with mission_up(mission_xml=WEBCAM, change={grabber: recorded}) as mission:
        async with mission.bus() as bus:
            shown = await seen(mission, frames_of(bus), 14)
    began_s, first = shown[0]
    assert [number for _, number in shown] == [(first + round((at_s - began_s) * 10)) % 6 for at_s, _ in shown]
    assert kinds(shown) == {*range(6)}


def test_the_guide_shows_the_webcam_of_the_example() -> None:
    assert resource_in(GUIDE.read_text()) == resource_in(WEBCAM.read_text())


@pytest.mark.thorough
async def test_a_mission_that_is_up_exchanges_its_camera_as_the_guide_shows_it(tmp_path: Path) -> None:
    footage = video(tmp_path / "corridor.avi", 6, rate_hz=10.0)
    words = GUIDE.read_text().partition("scout-backbone swap ")[2].partition("\n")[0].split()
    assert words[:2] == ["grabber", "recorded"]
    words = [word.replace("corridor.mp4", str(footage)) for word in words]
    with network_camera() as camera:
        address = f'<parameter name="device" value="{camera.address}"/>'
        with mission_up(mission_xml=WEBCAM, change={DEVICE: address}) as mission:
            async with mission.bus() as bus:
                frames = frames_of(bus)
                await seen(mission, frames, 3)
                swapped = ("scout-backbone", "swap", *words, "--mission", mission.name)
                done = await asyncio.to_thread(mission.command, *swapped)
                assert done.returncode == 0, f"{done.stdout}\n{done.stderr}\n{mission.story()}"
                camera.unplugged.set()
                while not frames.empty():
                    frames.get_nowait()
                assert kinds(await seen(mission, frames, 14)) == {*range(6)}
