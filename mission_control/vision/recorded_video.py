"""Videos of a recording: the pictures of each camera, with time and commander below each picture."""

from __future__ import annotations

import base64
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from backbone.errors import Refusal
from backbone.recording.hearing import is_meant
from backbone.recording.reader import Recorded, Recording
from backbone.recording.tables import TOLD_IN, Commanders, FileNames

RATE_HZ = 15.0  # NTSC framegrabber of the Scouts at half rate; a gap in time is a gap in the recording
LINE_PX = 24  # chosen: a line of text below the picture
TEXT_SCALE = 0.4  # chosen: forty letters fit a picture of 320 pixels
MIN_WIDTH_PX = 320
FRAMES = "Frame/"
PICTURE = {"pixels", "width_px", "height_px", "robot"}
"""Fields that a picture has; a module's own message may have its name."""


class NoVideo(Refusal):
    """The installed OpenCV cannot write a video to this path."""

    code = "recording.video"
    remedy = "Export without --video, or install an OpenCV that writes MP4."


def write_videos(recording: Recording, folder: Path, keys: tuple[str, ...]) -> list[Path]:
    """Write an MP4 file for each key with pictures; return them.

    Raises:
        NoVideo: A file could not be opened, or is not complete.
    """
    commanders = Commanders(recording.messages(TOLD_IN, newest_first=True))
    names, videos = FileNames(), dict[str, _Video]()
    try:
        for message in recording.messages():
            commanders.take(message)
            if not _is_picture(message) or (keys and not is_meant(message.key, keys)):
                continue
            name = names.of(message.key)
            if name not in videos:
                videos[name] = _Video(folder / f"{name}.mp4")
            by = commanders.of(message) or "nobody"
            videos[name].add(_picture(message), f"{message.at_s:9.3f} s  {message.body['robot']}  commanded by {by}")
    finally:
        for video in videos.values():
            video.close()
    for video in videos.values():
        video.check()
    return [video.path for video in videos.values()]


class _Video:
    """One MP4 file; a picture of another size than the first is scaled."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self._writer: Any = None
        self._added = 0
        self._size = (0, 0)

    def add(self, picture: NDArray[np.uint8], line: str) -> None:
        """Add a picture with a line below it."""
        if self._writer is None:
            height, width = picture.shape[:2]
            factor = max(1, -(-MIN_WIDTH_PX // width))
            self._size = (width * factor, height * factor)
            frame = (self._size[0], self._size[1] + LINE_PX)
            self._writer = cv2.VideoWriter(str(self.path), cv2.VideoWriter.fourcc(*"mp4v"), RATE_HZ, frame)
            if not self._writer.isOpened():
                raise NoVideo(f"{self.path} cannot be written")
        scaled = cv2.resize(picture, self._size, interpolation=cv2.INTER_NEAREST)
        below = np.zeros((LINE_PX, self._size[0], 3), np.uint8)
        cv2.putText(
            below, line, (4, LINE_PX - 8), cv2.FONT_HERSHEY_SIMPLEX, TEXT_SCALE, (255, 255, 255), 1, cv2.LINE_AA
        )
        self._writer.write(np.vstack([scaled, below]))
        self._added += 1

    def close(self) -> None:
        """Complete the file."""
        if self._writer is not None:
            self._writer.release()

    def check(self) -> None:
        """Return if the completed file has all pictures; OpenCV does not say that the disc was full.

        Raises:
            NoVideo: Pictures are missing.
        """
        written = cv2.VideoCapture(str(self.path))
        count = int(written.get(cv2.CAP_PROP_FRAME_COUNT))
        written.release()
        if count < self._added:
            raise NoVideo(f"{self.path.name} lacks pictures", remedy="Free disc space, and export again.")


def _is_picture(message: Recorded) -> bool:
    body = message.body
    return message.schema.startswith(FRAMES) and isinstance(body, dict) and body.keys() >= PICTURE


def _picture(message: Recorded) -> NDArray[np.uint8]:
    """Return the picture, uint8, (height, width, 3)."""
    body = message.body
    pixels = np.frombuffer(base64.b64decode(body["pixels"]), np.uint8).reshape(body["height_px"], body["width_px"])
    return np.repeat(pixels[:, :, None], 3, axis=2)
