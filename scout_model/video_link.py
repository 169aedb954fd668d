"""The analog video link: what a receiver tuned to a frequency gets.

IROS 2001, section 2: only one robot can transmit on a frequency at a time; signals of several
interfere with each other and become useless.  Without a transmitter there is snow.
"""

from __future__ import annotations

import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from scout_model.dimensions import PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX

Level = TypeVar("Level", np.uint8, np.int16)

NOISE_LEVELS = 5.0  # chosen: standard deviation in grey levels, 34 dB below white, a good analog link
_BANK_MARGIN_PX = 128  # chosen: 16 384 different windows into the noise, drawn once instead of every frame
_GARBAGE_SHIFT_PX = 60  # chosen: rows tear by up to a fifth of the picture's width


@dataclass(frozen=True, slots=True)
class Reception:
    """One frame as it leaves the receiver.

    Attributes:
        picture: Grey levels 0 to 255, shape (240, 320), row 0 on top.
        transmitters: How many robots sent on the frequency; the picture means something only if it is 1.
    """

    picture: NDArray[np.uint8]
    transmitters: int


class Receiver:
    """A video receiver tuned to one frequency; the same seed, frequency and frame give the same noise.

    Args:
        seed: Of the world.
        frequency: Name of the frequency.
    """

    def __init__(self, seed: int, frequency: str) -> None:
        self._key = (abs(seed), zlib.crc32(frequency.encode()))
        rng = np.random.default_rng(self._key)
        shape = (PICTURE_HEIGHT_PX + _BANK_MARGIN_PX, PICTURE_WIDTH_PX + _BANK_MARGIN_PX)
        # A video amplifier has less bandwidth than the picture has columns: noise is smeared along its rows.
        smeared = np.asarray(cv2.GaussianBlur(rng.standard_normal(shape, np.float32), (5, 1), 0), np.float32)
        grain = smeared / smeared.std()
        self._noise: NDArray[np.int16] = np.rint(NOISE_LEVELS * grain).astype(np.int16)
        self._snow: NDArray[np.uint8] = np.clip(128 + 70 * grain, 0, 255).astype(np.uint8)

    def receive(self, pictures: Sequence[NDArray[np.uint8]], frame: int) -> Reception:
        """Return what comes out of the receiver.

        Args:
            pictures: One from each robot that transmits on the frequency; shape (240, 320).
            frame: Number of the frame, 0 or more.
        """
        rng = np.random.default_rng((*self._key, frame))
        match len(pictures):
            case 0:
                picture = _window(self._snow, rng).copy()
            case 1:
                picture = _add(pictures[0], _window(self._noise, rng))
            case _:
                picture = _add(_interfere(pictures, rng), _window(self._snow, rng).astype(np.int16) // 2 - 64)
        return Reception(picture, len(pictures))


def _window(bank: NDArray[Level], rng: np.random.Generator) -> NDArray[Level]:
    top, left = rng.integers(0, _BANK_MARGIN_PX, 2)
    return bank[top : top + PICTURE_HEIGHT_PX, left : left + PICTURE_WIDTH_PX]


def _add(picture: NDArray[np.uint8], noise: NDArray[np.int16]) -> NDArray[np.uint8]:
    return np.asarray(cv2.add(picture, noise, dtype=cv2.CV_8U), np.uint8)


def _interfere(pictures: Sequence[NDArray[np.uint8]], rng: np.random.Generator) -> NDArray[np.uint8]:
    """Return a picture whose rows come from any of the transmitters, each torn sideways."""
    sources = rng.integers(0, len(pictures), PICTURE_HEIGHT_PX)
    shifts_px = rng.integers(0, _GARBAGE_SHIFT_PX + 1, PICTURE_HEIGHT_PX)
    # Row by row from pictures that begin again at their right edge: five times faster than one index for all pixels.
    endless = [np.concatenate([picture, picture[:, :_GARBAGE_SHIFT_PX]], axis=1) for picture in pictures]
    mixed = np.empty((PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX), np.uint8)
    for row, (source, shift_px) in enumerate(zip(sources.tolist(), shifts_px.tolist(), strict=True)):
        mixed[row] = endless[source][row, shift_px : shift_px + PICTURE_WIDTH_PX]
    return mixed
