"""A behavior watches a video file in a mission in virtual time: it sees what moves there, the same each time."""

from __future__ import annotations

from pathlib import Path

import cv2
import msgspec
import numpy as np
import pytest

from backbone.bus.clock import run_virtual
from backbone.keys import Conversation
from backbone.mission.reader import read_mission
from mission_control.laboratory.simulation.whole_mission import mission_in_one_process
from mission_control.messages import MotionSeen

WEBCAM = Path(__file__).parents[3] / "docs" / "examples" / "webcam.xml"
CAMERA = 'driver="video_device">', '<parameter name="device" value="0"/>'
RATE_HZ, MOVES_FROM_S, WIDTH_PX, HEIGHT_PX = 15.0, 6.0, 160, 120

pytestmark = pytest.mark.processes


@pytest.fixture(scope="module")
def footage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A grey wall for six seconds, then a white box moves past it."""
    path = tmp_path_factory.mktemp("footage") / "box.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"MJPG"), RATE_HZ, (WIDTH_PX, HEIGHT_PX))
    for number in range(150):
        picture = np.full((HEIGHT_PX, WIDTH_PX, 3), 90, np.uint8)
        if (moved_s := number / RATE_HZ - MOVES_FROM_S) > 0:
            left_px = round(40 * moved_s)
            picture[40:90, left_px : left_px + 25] = 230
        writer.write(picture)
    writer.release()
    return path


def watched(footage: Path, folder: Path) -> list[MotionSeen]:
    text = WEBCAM.read_text().replace(CAMERA[0], 'driver="recorded">')
    (folder / "m.xml").write_text(text.replace(CAMERA[1], f'<parameter name="file" value="{footage}"/>'))
    seen: list[MotionSeen] = []

    async def main() -> None:
        async with mission_in_one_process(read_mission(folder / "m.xml")) as running:
            at = "mission_control/watch"
            running.bus.subscribe(at, Conversation.EVENTS, MotionSeen, lambda one: seen.append(one.body))
            await running.clock.sleep_s(12.0)

    run_virtual(main())
    return seen


def test_a_behavior_sees_what_moves_in_a_video_the_same_each_time(footage: Path, tmp_path: Path) -> None:
    seen = watched(footage, tmp_path)
    assert seen
    assert {one.robot for one in seen} == {"scout1"}
    assert seen[0].at_s > MOVES_FROM_S
    assert msgspec.msgpack.encode(watched(footage, tmp_path)) == msgspec.msgpack.encode(seen)
