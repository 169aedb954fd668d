"""A recording's pictures become a video with all of them, or none is left."""

from __future__ import annotations

import json
from pathlib import Path

import cv2
import numpy as np
import pytest
from full_disk import disk_full_at
from mcap.writer import Writer
from small_recordings import Said, recorded

from backbone.command_line.exporting import CsvTables, export
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from backbone.recording.writer import PROFILE
from mission_control.vision.recorded_video import NoVideo
from resource_pool.messages import Frame

PICTURES = 40
VIDEO_BYTES, TABLE_BYTES = 300_000, 30_000  # the video is larger than the first, the table smaller than the second
ARC = "watch-capture"


@pytest.fixture
def night(tmp_path: Path) -> Path:
    drawn = np.random.default_rng(1)
    frames = [
        Frame("grabber", ARC, 3, "scout1", number, number / 15, 80, 60, drawn.bytes(80 * 60))
        for number in range(PICTURES)
    ]
    path = tmp_path / "night.mcap"
    at = f"resource_pool/{ARC}"
    said = [Said(1.0 + each.captured_s, at, Conversation.FRAMES, each, "resource_pool/grabber") for each in frames]
    path.write_bytes(recorded(said).getvalue())
    return path


async def test_a_video_has_all_pictures(night: Path, tmp_path: Path) -> None:
    assert await export(night, tmp_path / "out", (), CsvTables, with_videos=True) is ExitCode.DONE
    [path] = (tmp_path / "out").glob("*.mp4")
    assert cv2.VideoCapture(str(path)).get(cv2.CAP_PROP_FRAME_COUNT) == PICTURES
    assert path.stat().st_size > VIDEO_BYTES
    assert all(table.stat().st_size < TABLE_BYTES for table in (tmp_path / "out").glob("*.csv"))


async def test_a_modules_own_message_with_the_name_of_pictures_ends_no_export(tmp_path: Path) -> None:
    with (tmp_path / "own.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start(profile=PROFILE)
        about = {"key": "scout/night/mission_control/eyes/box/outputs", "source": "mission_control/eyes"}
        number = writer.register_channel("/box", "json", 0, about | {"schema": "Frame/1"})
        said = {"sequence": 1, "stamp_s": 1.0, "heard_s": 1.0, "cause": "", "body": {"x_m": 2.0}}
        writer.add_message(number, 1, json.dumps(said).encode(), 1)
        writer.finish()
    assert await export(tmp_path / "own.mcap", tmp_path / "out", (), CsvTables, with_videos=True) is ExitCode.DONE
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["mission_control_eyes_box_outputs_Frame.csv"]


async def test_a_video_for_which_the_disc_has_no_room_is_refused(night: Path, tmp_path: Path) -> None:
    with disk_full_at(VIDEO_BYTES), pytest.raises(NoVideo, match="lacks pictures"):
        await export(night, tmp_path / "out", (), CsvTables, with_videos=True)
    assert not (tmp_path / "out").exists()
