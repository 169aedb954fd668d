"""Pictures through OpenCV: of a camera of this host or of the network, and of a video file.

No other file of the resource pool imports OpenCV. A driver imports this file when it opens, so no other RC's process
has OpenCV in its memory. Each object is for one thread at a time.
"""

from __future__ import annotations

import math
import os
from pathlib import Path

import cv2
import numpy as np

from resource_pool.drivers.interface import HardwareFault, Picture

NETWORK_OPENS_WITHIN_MS = 10_000  # chosen: a camera that must be awakened; its RC waits for a minute
NETWORK_READS_WITHIN_MS = 5_000  # chosen: as ``video_device.SILENT_S``
PLAYED_HZ = 15.0  # chosen: the rate of a video file that does not state one; the default of a framegrabber
MOST_PLAYED_HZ = 1_000.0  # chosen: a higher rate of a file is none, for example a time base in its place


class Capture:
    """Pictures of an open camera or file, one after the other."""

    def __init__(self, capture: cv2.VideoCapture, name: str) -> None:
        self._capture, self._name = capture, name

    def grab(self) -> bool:
        """Take the next picture; return False if there is none."""
        return self._capture.grab()

    def picture(self, captured_s: float) -> Picture | None:
        """Return the taken picture in grey levels; None: it is damaged.

        Raises:
            HardwareFault: The pictures are no pictures of eight bits.
        """
        is_whole, taken = self._capture.retrieve()
        if not is_whole:
            return None
        if taken.dtype != np.uint8:
            raise HardwareFault(f"{self._name} has pictures of {taken.dtype}, not of grey levels or colors of 8 bits")
        channels = taken.shape[2] if taken.ndim == 3 else 1
        if channels > 1:
            taken = cv2.cvtColor(taken, cv2.COLOR_BGR2GRAY if channels == 3 else cv2.COLOR_BGRA2GRAY)
        height_px, width_px = taken.shape[:2]
        return Picture(captured_s, np.ascontiguousarray(taken).reshape(-1).data, width_px, height_px)

    def size_px(self) -> tuple[int, int]:
        """Return columns and rows."""
        return round(self.number(cv2.CAP_PROP_FRAME_WIDTH)), round(self.number(cv2.CAP_PROP_FRAME_HEIGHT))

    def number(self, of: int) -> float:
        """Return a property of OpenCV's ``CAP_PROP_…``; 0: unknown."""
        return float(self._capture.get(of))

    def close(self) -> None:
        """Give the camera or file back."""
        self._capture.release()


def open_camera(device: str | int, name: str, width_px: int, height_px: int) -> Capture:
    """Return the open camera.

    Args:
        device: Its path or number on this host, or its address in the network.
        name: Its name for people.
        width_px: Wished columns; 0: as it likes.
        height_px: Wished rows; 0: as it likes.

    Raises:
        HardwareFault: It is missing, in use, or no camera.
    """
    remedy = "Plug it in, and end the program that uses it: fuser /dev/video* names it."
    if isinstance(device, int):
        capture = cv2.VideoCapture(device)
    elif "://" in device:
        remedy = "Open the address with another program on this host, for example a browser or ffplay."
        limits = [cv2.CAP_PROP_OPEN_TIMEOUT_MSEC, NETWORK_OPENS_WITHIN_MS]
        limits += [cv2.CAP_PROP_READ_TIMEOUT_MSEC, NETWORK_READS_WITHIN_MS]
        capture = cv2.VideoCapture(device, cv2.CAP_FFMPEG, limits)
    else:
        _check_path(Path(device))
        capture = cv2.VideoCapture(device, cv2.CAP_V4L2)
    if not capture.isOpened():
        raise HardwareFault(f"{name} cannot be opened: it is missing, in use, or no camera", remedy=remedy)
    opened = Capture(capture, name)
    if width_px or height_px:
        has_px = opened.size_px()
        capture.set(cv2.CAP_PROP_FRAME_WIDTH, width_px or has_px[0])
        capture.set(cv2.CAP_PROP_FRAME_HEIGHT, height_px or has_px[1])  # V4L2 sets a size once it has both
    return opened


def _check_path(device: Path) -> None:
    if not device.exists():
        raise HardwareFault(
            f"there is no video device {device}", remedy="Plug it in; v4l2-ctl --list-devices lists all."
        )
    if device.is_file():
        raise HardwareFault(f"{device} is a file, no video device", remedy='A file is played by driver="recorded".')
    if not os.access(device, os.R_OK | os.W_OK):
        raise HardwareFault(
            f"this user may not open {device}", remedy="Add the user to the group of the device: video."
        )


class VideoFilm:
    """The pictures of a video file; see ``recorded.Film``.

    Raises:
        HardwareFault: OpenCV cannot play the file.
    """

    def __init__(self, path: str) -> None:
        self._path = path
        self._capture = self._opened()
        stated_hz = self._capture.number(cv2.CAP_PROP_FPS)
        self.hz = stated_hz if 0.0 < stated_hz <= MOST_PLAYED_HZ else PLAYED_HZ
        self._first_s = self._last_s = -math.inf

    def advance(self) -> float | None:
        """Take the next picture; see ``recorded.Film``. A file without times is played at its rate."""
        if not self._capture.grab():
            return None
        at_s = self._capture.number(cv2.CAP_PROP_POS_MSEC) / 1000.0
        if self._first_s == -math.inf:
            self._first_s = at_s
        elif not at_s > self._last_s:
            at_s = self._last_s + 1.0 / self.hz
        self._last_s = at_s
        return at_s - self._first_s

    def picture(self, captured_s: float) -> Picture | None:
        """Return the taken picture."""
        return self._capture.picture(captured_s)

    def rewind(self) -> None:
        """Begin again."""
        self._capture.close()
        self._capture = self._opened()
        self._first_s = self._last_s = -math.inf

    def close(self) -> None:
        """Close the file."""
        self._capture.close()

    def _opened(self) -> Capture:
        capture = cv2.VideoCapture(self._path)
        if not capture.isOpened():
            raise HardwareFault(f"OpenCV cannot play {self._path}", remedy="Convert it, for example to MP4 by ffmpeg.")
        return Capture(capture, self._path)
