"""The analog video link: the frames that a tuned receiver and its framegrabber deliver.

IROS 2001, section 2: only one robot can transmit on a frequency at a time; several signals interfere with each other
and become useless. Without a transmitter there is snow. RAM 2002, "Visual Servoing" and "Distributed Surveillance
Task": motors tear lines, multipath makes ghosts, weak signals leave partial images.

Rule: a received frame depends only on the receiver's seed, frequency and air, on the frame's number and signals, and on
the frames received since tuning. Each effect has its own random numbers, so switching one effect off changes no other.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum, StrEnum

import cv2
import numpy as np
from numpy.typing import NDArray

from scout_model.air import REFERENCE_M, Fading, counted_distance_m, fade_level, key_of, snr_db, words_of
from scout_model.description import AirDescription
from scout_model.dimensions import FRAMES_PER_S, PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX
from scout_model.grain import Grain, Picture

SETTLING_S = 0.25  # chosen: with a mission's 0.3 s for connecting a frequency, the first picture used is steady
SNOW_LEVELS = 70.0  # chosen: standard deviation in grey levels; black and white specks all over
FAINTEST_LEVELS = 0.1  # chosen: a weaker grain is rounded away
WEAK_DB = 16.0  # chosen: below, contrast fades towards gray
TEARS = 5.0  # chosen: lines in a frame while both motors run at full speed
STRAY_TEARS = 0.01  # chosen: lines in a frame while the motors stand still, from other electrical devices
GHOST = 0.08  # chosen: average strength of the echoes, as a share of the picture's
GHOST_SEEN = 0.2  # chosen: a frame with a fainter ghost still counts as clean
GHOST_SHIFT_PX = 9  # chosen: 1.5 microseconds: an echo with a detour of 250 m, or a reflection inside the receiver
PARTIAL = 0.01  # chosen: share of frames the framegrabber leaves incomplete while the signal is good
PARTIAL_IN_FADE = 0.5  # chosen: RAM 2002 attributes partial images to signals that are "bad enough"

_BANK_MARGIN_PX = 128  # chosen: 16 384 different windows into the noise, drawn once instead of every frame
_DICE_KEPT = 1024  # chosen: those of a trial, which other trials of the same seed throw again; 200 kB
_GARBAGE_SHIFT_PX = 60  # chosen: rows tear by up to a fifth of the picture's width
_SLIP_PX = (2.0, 10.0)  # chosen: shift of a row against the row above, at the edge and in the depth of a fade
_OFF_LEVELS = (60.0, 120.0)  # chosen: error of black in a fade; RAM 2002: whole rows look "drastically different"
_CLAMP_ROWS = 6  # chosen: rows until the receiver determines the black level again
_LONG_AGO = -1_000_000


class FrameKind(StrEnum):
    """The worst fault of a frame, from none to complete loss."""

    CLEAN = "clean"
    GHOST = "ghost"
    TORN = "torn"
    FADED = "faded"
    PARTIAL = "partial"
    SETTLING = "settling"
    GARBAGE = "garbage"
    SNOW = "snow"


@dataclass(frozen=True, slots=True)
class Signal:
    """The signal of one robot.

    Attributes:
        picture: Of its camera: grey levels 0 to 255, shape (240, 320), row 0 on top. It is only read.
        distance_m: From the receiver's antenna, above 0.
        motors: Average speed of both wheels, 0 to 1 of their limit.
        on_since_frame: First frame in which its transmitter was on at this frequency.
    """

    picture: Picture
    robot: str = ""
    distance_m: float = REFERENCE_M
    motors: float = 0.0
    on_since_frame: int = _LONG_AGO


@dataclass(frozen=True, slots=True)
class Reception:
    """One frame as it leaves the framegrabber.

    Attributes:
        picture: Grey levels 0 to 255, shape (240, 320), row 0 on top.
        transmitters: Number of robots that transmit on the frequency; the picture is meaningful only if it is 1.
        kind: Worst fault of the frame.
    """

    picture: Picture
    transmitters: int
    kind: FrameKind


class _Effect(IntEnum):
    """Streams of random numbers, one for each effect."""

    WHETHER = 0
    TEARS = 1
    SLIP = 2
    PARTIAL = 3
    GARBAGE = 4
    SETTLING = 5
    FADING = 6
    ECHO = 7


@dataclass(frozen=True, slots=True)
class _Dice:
    """Random numbers of a frame, drawn whether an effect is on or off; effects draw further ones themselves.

    Attributes:
        top: Place of the frame's window into the bank of noise.
        left: The same.
        partial: Whether the frame is incomplete: below the share of such frames.
        tears: Number of torn lines.
    """

    top: int
    left: int
    partial: float
    tears: int

    def window(self, levels: float, *, kept: bool) -> Grain:
        """Return noise of about this standard deviation, in steps of 1 dB: few banks serve all strengths.

        Args:
            levels: The standard deviation, in grey levels.
            kept: True: cut it from a bank that is kept; False: make it for this picture, with the same result.
        """
        level_db = round(20 * math.log10(max(levels, FAINTEST_LEVELS)))
        rows = slice(self.top, self.top + PICTURE_HEIGHT_PX)
        columns = slice(self.left, self.left + PICTURE_WIDTH_PX)
        if not kept:
            return _grain_of(_noise()[rows, columns], level_db)
        bank = _bank(level_db)
        return Grain(bank.brighter[rows, columns], bank.darker[rows, columns])


class Receiver:
    """A video receiver tuned to one frequency, with its framegrabber.

    Args:
        air: Effects and their strengths.
        keeps_noise: True: noise of some 30 strengths is kept, 0.33 MB each, for all receivers of the process. False:
            it is made for each picture, which takes 0.13 ms longer. The pictures are the same.
    """

    def __init__(
        self, seed: int, frequency: str, air: AirDescription | None = None, *, keeps_noise: bool = True
    ) -> None:
        self._air = AirDescription() if air is None else air
        self._keeps_noise = keeps_noise
        self._key = (abs(seed), key_of(frequency))
        self._words = [word for number in self._key for word in words_of(number)]
        self._fading: dict[str, Fading] = {}
        self._echoes: dict[str, Fading] = {}
        self._settling_frames = round(SETTLING_S * FRAMES_PER_S * self._air.settling)
        self._tuned_frame: int | None = None
        self._last: Picture | None = None

    def tune(self) -> None:
        """Clear the receiver's state; the picture settles again from the next frame on."""
        self._tuned_frame = self._last = None

    def receive(self, signals: Sequence[Signal], frame: int) -> Reception:
        """Return the received frame.

        Args:
            signals: The signal of each robot that transmits on the frequency.
            frame: Number of the frame, 0 or more, larger than at the call before.

        Raises:
            ValueError: A picture has another shape than (240, 320) or is not of bytes; a distance is not above 0;
                motors are not within 0 to 1; the frame is negative.
        """
        if frame < 0:
            raise ValueError(f"frame {frame} is negative")
        for signal in signals:
            _check(signal)
        if self._tuned_frame is None:
            self._tuned_frame = frame
        dice = self._dice(signals, frame)
        if not signals:
            reception = Reception(self._snow(dice), 0, FrameKind.SNOW)
        elif len(signals) == 1 or self._air.interference == 0:
            nearest = min(signals, key=lambda signal: signal.distance_m)
            picture, kind = self._receive_one(nearest, frame, self._tuned_frame, dice)
            reception = Reception(picture, len(signals), kind)
        else:
            reception = Reception(self._garbage(signals, frame, dice), len(signals), FrameKind.GARBAGE)
        self._last = reception.picture.copy()  # the caller may paint on the picture
        return reception

    def _receive_one(self, signal: Signal, frame: int, tuned_frame: int, dice: _Dice) -> tuple[Picture, FrameKind]:
        air = self._air
        away_m = counted_distance_m(signal.distance_m, air.weak_signal)
        strength_db = snr_db(away_m)
        picture, kind = signal.picture, FrameKind.CLEAN
        ghost = self._ghost(signal.robot, frame)
        if ghost > 0:
            picture = _with_ghost(picture, ghost)
            kind = FrameKind.GHOST if ghost >= GHOST_SEEN else kind
        if strength_db < WEAK_DB and air.weak_signal > 0:
            contrast = max(0.0, strength_db / WEAK_DB)
            picture = np.asarray(cv2.convertScaleAbs(picture, None, contrast, 128.0 * (1.0 - contrast)), np.uint8)
        power, depth = self._fade(signal.robot, away_m, frame)
        picture = self._with_noise(picture, strength_db + 10 * math.log10(power), dice)
        if dice.tears:
            picture, kind = _with_tears(picture, dice.tears, self._random(_Effect.TEARS, frame)), FrameKind.TORN
        if depth > 0:
            picture, kind = _slipping(picture, depth, self._random(_Effect.SLIP, frame)), FrameKind.FADED
        if dice.partial < air.noise * air.partial_frames * (PARTIAL_IN_FADE if depth > 0 else PARTIAL):
            picture, kind = self._partial(picture, dice, self._random(_Effect.PARTIAL, frame)), FrameKind.PARTIAL
        settled_frames = frame - max(tuned_frame, signal.on_since_frame)
        if 0 <= settled_frames < self._settling_frames:
            unlocked = 1.0 - settled_frames / self._settling_frames
            picture, kind = _rolling(picture, unlocked, self._random(_Effect.SETTLING, frame)), FrameKind.SETTLING
        if picture is signal.picture:
            picture = picture.copy()
        return picture, kind

    def _dice(self, signals: Sequence[Signal], frame: int) -> _Dice:
        nearest = min(signals, key=lambda signal: signal.distance_m, default=None)
        tears = 0.0 if nearest is None else STRAY_TEARS + TEARS * nearest.motors
        return _throw((*self._words, *words_of(frame), _Effect.WHETHER), self._air.noise * self._air.tears * tears)

    def _random(self, effect: _Effect, frame: int) -> np.random.Generator:
        return _generator((*self._words, *words_of(frame), effect))

    def _fade(self, robot: str, away_m: float, frame: int) -> tuple[float, float]:
        """Return the signal's power as a share of its mean, and the depth of the fade, 0 to 1."""
        level = self._air.noise * self._air.fades * fade_level(away_m)
        if level == 0:
            return 1.0, 0.0
        power = max(1e-6, self._course(self._fading, robot, _Effect.FADING).power(frame / FRAMES_PER_S))
        return power, max(0.0, 1.0 - power / level)

    def _ghost(self, robot: str, frame: int) -> float:
        strength = GHOST * self._air.noise * self._air.ghosts
        if strength == 0:
            return 0.0
        power = self._course(self._echoes, robot, _Effect.ECHO).power(frame / FRAMES_PER_S)
        return strength * math.sqrt(power)

    def _course(self, courses: dict[str, Fading], robot: str, effect: _Effect) -> Fading:
        course = courses.get(robot)
        if course is None:
            course = courses[robot] = Fading((*self._key, key_of(robot), effect))
        return course

    def _with_noise(self, picture: Picture, strength_db: float, dice: _Dice) -> Picture:
        levels = self._air.noise * self._air.white_noise * 255.0 / 10 ** (strength_db / 20)
        if levels < FAINTEST_LEVELS:
            return picture
        return self._grain(dice, min(levels, SNOW_LEVELS)).on(picture)

    def _grain(self, dice: _Dice, levels: float) -> Grain:
        return dice.window(levels, kept=self._keeps_noise)

    def _snow(self, dice: _Dice) -> Picture:
        gray = np.full((PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX), 128, np.uint8)
        if self._air.snow == 0:
            return gray
        return self._grain(dice, SNOW_LEVELS * self._air.snow).on(gray)

    def _partial(self, picture: Picture, dice: _Dice, rng: np.random.Generator) -> Picture:
        """Return the picture with its lower rows replaced by rows of an older picture, black or noise."""
        first_row = int(rng.integers(8, PICTURE_HEIGHT_PX - 8))
        partial = picture.copy()
        match int(rng.integers(3)):
            case 0 if self._last is not None:
                partial[first_row:] = self._last[first_row:]
            case 0 | 1:
                partial[first_row:] = 0
            case _:
                gray = np.full_like(picture, 128)
                partial[first_row:] = self._grain(dice, SNOW_LEVELS).on(gray)[first_row:]
        return partial

    def _garbage(self, signals: Sequence[Signal], frame: int, dice: _Dice) -> Picture:
        """Return a picture whose rows come from random transmitters, each shifted sideways."""
        rng = self._random(_Effect.GARBAGE, frame)
        nearest = min(signals, key=lambda signal: signal.distance_m)
        sources = rng.integers(0, len(signals), PICTURE_HEIGHT_PX)
        shifts_px = rng.integers(0, _GARBAGE_SHIFT_PX + 1, PICTURE_HEIGHT_PX)
        spoiled = rng.random(PICTURE_HEIGHT_PX) < self._air.interference
        # Row by row from pictures that wrap around at the right edge: faster than one index for all pixels.
        endless = [_endless(signal.picture) for signal in signals]
        mixed = nearest.picture.copy()
        for row in np.flatnonzero(spoiled).tolist():
            shift_px = int(shifts_px[row])
            mixed[row] = endless[sources[row]][row, shift_px : shift_px + PICTURE_WIDTH_PX]
        return self._grain(dice, SNOW_LEVELS / 2 * self._air.interference).on(mixed)


def _check(signal: Signal) -> None:
    picture = signal.picture
    if picture.shape != (PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX) or picture.dtype != np.uint8:
        raise ValueError(f"a picture of shape {picture.shape} of {picture.dtype}, not (240, 320) of uint8")
    if not signal.distance_m > 0 or not math.isfinite(signal.distance_m):
        raise ValueError(f"distance_m must be above 0 and finite, not {signal.distance_m}")
    if not 0 <= signal.motors <= 1:
        raise ValueError(f"motors must be within 0 to 1, not {signal.motors}")


def _generator(words: Sequence[int]) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.array(words, np.uint32)))  # NumPy's default, made sooner


@functools.lru_cache(_DICE_KEPT)
def _throw(words: Sequence[int], tears: float) -> _Dice:
    """Return the random numbers of the frame with these words, and so many torn lines on average."""
    rng = _generator(words)
    top, left, partial = int(rng.integers(0, _BANK_MARGIN_PX)), int(rng.integers(0, _BANK_MARGIN_PX)), rng.random()
    return _Dice(top, left, partial, int(rng.poisson(tears)))


@functools.cache
def _noise() -> NDArray[np.float32]:
    """Return noise of standard deviation 1, larger than a picture; the same in every run."""
    shape = (PICTURE_HEIGHT_PX + _BANK_MARGIN_PX, PICTURE_WIDTH_PX + _BANK_MARGIN_PX)
    white = np.random.default_rng(0).standard_normal(shape, np.float32)
    # The bandwidth of a video amplifier is smaller than the column rate, so noise is smeared along the rows.
    smeared = np.asarray(cv2.GaussianBlur(white, (5, 1), 0), np.float32)
    return np.asarray(smeared / smeared.std(), np.float32)


@functools.lru_cache(64)
def _bank(level_db: int) -> Grain:
    return _grain_of(_noise(), level_db)


def _grain_of(noise: NDArray[np.float32], level_db: int) -> Grain:
    return Grain.of(noise, math.pow(10, level_db / 20))


def _with_ghost(picture: Picture, strength: float) -> Picture:
    """Return the picture with its echo; the brightness stays the same."""
    ghosted = np.empty_like(picture)
    share = strength / (1.0 + strength)
    # All rows as one, which OpenCV adds without a stop at each row's end; the left edge, before the echo, follows.
    row, ghosted_row = picture.reshape(1, -1), ghosted.reshape(1, -1)
    late, early = row[:, GHOST_SHIFT_PX:], row[:, :-GHOST_SHIFT_PX]
    cv2.addWeighted(late, 1.0 - share, early, share, 0.0, dst=ghosted_row[:, GHOST_SHIFT_PX:])
    ghosted[:, :GHOST_SHIFT_PX] = picture[:, :GHOST_SHIFT_PX]
    return ghosted


def _with_tears(picture: Picture, count: int, rng: np.random.Generator) -> Picture:
    """Return the picture with so many horizontal lines, 1 to 3 rows high: bright or dark, or the rows torn sideways."""
    torn = picture.copy()
    for _ in range(count):
        top, height = int(rng.integers(PICTURE_HEIGHT_PX)), int(rng.integers(1, 4))
        begin, length = int(rng.integers(PICTURE_WIDTH_PX)), int(rng.integers(40, PICTURE_WIDTH_PX))
        rows = slice(top, top + height)
        match int(rng.integers(4)):
            case 0:
                torn[rows, begin : begin + length] = 255
            case 1:
                torn[rows, begin : begin + length] = 0
            case _:
                torn[rows] = np.roll(torn[rows], begin, axis=1)
    return torn


def _slipping(picture: Picture, depth: float, rng: np.random.Generator) -> Picture:
    """Return the picture without sync: each row is shifted against the last, and black is lost every few rows."""
    step_px = _SLIP_PX[0] + (_SLIP_PX[1] - _SLIP_PX[0]) * depth
    slipped = _shifted(picture, np.cumsum(rng.normal(0.0, step_px, PICTURE_HEIGHT_PX)))
    bands = PICTURE_HEIGHT_PX // _CLAMP_ROWS
    offsets = np.trunc(rng.uniform(*_OFF_LEVELS, bands) * rng.choice((-1, 1), bands))
    lost = Grain.of(np.repeat(offsets, _CLAMP_ROWS)[:, np.newaxis])
    return Grain(*(np.repeat(part, PICTURE_WIDTH_PX, axis=1) for part in (lost.brighter, lost.darker))).on(slipped)


def _rolling(picture: Picture, unlocked: float, rng: np.random.Generator) -> Picture:
    """Return the picture while it settles: rolled up and slanted, less and less."""
    slant_px = rng.normal(0.0, 200.0) * unlocked * np.linspace(0.0, 1.0, PICTURE_HEIGHT_PX)
    slanted = _shifted(picture, slant_px + rng.normal(0.0, 1.0 + 4.0 * unlocked, PICTURE_HEIGHT_PX))
    return np.roll(slanted, int(rng.integers(PICTURE_HEIGHT_PX) * unlocked), axis=0)


def _shifted(picture: Picture, shifts_px: NDArray[np.float64]) -> Picture:
    """Return the picture with each row rotated to the right by its own shift."""
    endless = np.concatenate([picture, picture], axis=1)
    lefts = np.mod(-np.rint(shifts_px), PICTURE_WIDTH_PX).astype(np.intp)
    # As NumPy's sliding_window_view, which takes longer than the copy.
    height, width = endless.shape
    shape, strides = (height, width - PICTURE_WIDTH_PX + 1, PICTURE_WIDTH_PX), (*endless.strides, 1)
    windows: NDArray[np.uint8] = np.ndarray(shape, np.uint8, endless, strides=strides)
    return windows[np.arange(len(lefts)), lefts]


def _endless(picture: Picture) -> Picture:
    return np.concatenate([picture, picture[:, :_GARBAGE_SHIFT_PX]], axis=1)
