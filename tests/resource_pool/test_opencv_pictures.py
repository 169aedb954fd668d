"""Pictures through OpenCV: the size of a camera, and the grey levels of pictures of every kind."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import cv2
import numpy as np
import pytest

from resource_pool.drivers import opencv_pictures
from resource_pool.drivers.interface import HardwareFault


@pytest.mark.parametrize(
    ("wished", "sized"), [((0, 0), []), ((320, 0), [320, 480]), ((0, 240), [640, 240]), ((320, 240), [320, 240])]
)
def test_a_camera_gets_a_whole_size_even_if_half_of_it_is_wished(
    monkeypatch: pytest.MonkeyPatch, wished: tuple[int, int], sized: list[int]
) -> None:
    """OpenCV passes a size to V4L2 only when it has both sides."""
    has = {cv2.CAP_PROP_FRAME_WIDTH: 640, cv2.CAP_PROP_FRAME_HEIGHT: 480}
    got: list[int] = []
    opened = SimpleNamespace(isOpened=lambda: True, get=has.get, set=lambda _of, value: got.append(value))
    monkeypatch.setattr(cv2, "VideoCapture", lambda *_asked: opened)
    opencv_pictures.open_camera(0, "camera", *wished)
    assert got == sized


@pytest.mark.parametrize(
    ("taken", "grey"),
    [
        (np.full((2, 3), 9, np.uint8), 9),
        (np.full((2, 3, 1), 9, np.uint8), 9),
        (np.full((2, 3, 3), (255, 0, 0), np.uint8), 29),
        (np.full((2, 3, 4), (0, 0, 255, 7), np.uint8), 76),
    ],
)
def test_pictures_of_every_kind_become_grey_levels(taken: Any, grey: int) -> None:
    """Blue first, with the weights of ITU-R BT.601, as OpenCV documents for COLOR_BGR2GRAY."""
    opened: Any = SimpleNamespace(retrieve=lambda: (True, taken), grab=lambda: True)
    picture = opencv_pictures.Capture(opened, "camera").picture(1.5)
    assert picture is not None
    assert (picture.captured_s, picture.width_px, picture.height_px) == (1.5, 3, 2)
    assert bytes(picture.pixels) == bytes([grey]) * 6


def test_pictures_of_another_depth_are_a_hardware_fault() -> None:
    opened: Any = SimpleNamespace(retrieve=lambda: (True, np.zeros((2, 3), np.uint16)))
    with pytest.raises(HardwareFault, match="uint16"):
        opencv_pictures.Capture(opened, "depth").picture(0.0)
