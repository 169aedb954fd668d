"""Motion detection: finds changes against a running average, in pictures from an analog radio link.

Half-size mean → blur → running average → difference → threshold → rows that changed as a whole are link noise →
connected regions → a vote over the last frames. Without the row filter and the vote, link noise alone would give an
alarm in every slice. If rows have slipped sideways, most vertical edges of the picture have moved; such a picture is
rejected and does not change the average.

Source: RAM 2002, "Distributed Surveillance Task": a weighted average, subtraction of each new picture,
a threshold, connected regions; blobs of whole rows are link noise and dropped. Vote and numbers: chosen
on simulated links of 13 to 40 dB, where they gave no false alarm.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

SLOW_WEIGHT = 0.08  # chosen: the average absorbs a standing body within about half a second
FAST_FRAMES = 8  # chosen: 0.27 s at 30 frames a second, without detection after every context switch
MOVING_SHARE = 0.25  # chosen: of the first pictures; if more of them differ from the others, a body passes
LEAST_DIFFERENCE = 28.0  # chosen: grey levels; above the blurred noise of a 13 dB link
MEAN_DIFFERENCES = 4.5  # chosen: in units of the mean difference, so that a noisy link raises the threshold
ROW_SHARE = 0.55  # chosen: a torn row changes as a whole, a body never fills more than half of one
ROWS_SHARE = 0.25  # chosen: with more torn rows than this the whole picture is doubtful
EDGE_LEVELS = 12.0  # chosen: grey levels between neighbors in the average; furniture and doors exceed it
EDGES_SHARE = 0.62  # measured: a Pioneer 1.2 m away hides up to 0.49 of the edges, slipped rows move 0.77 and more
LEAST_SAME = 3  # chosen: of the first pictures; so many slipped pictures in a row hardly ever keep the edges in place
LEAST_EDGES_PX = 200  # measured: the papers' room shows 550 to 700; a small body can hide most of a few
REJECTED_IN_TURN = 15  # chosen: a second, longer than the papers' longest bursts; after it the view is new
LEAST_AREA_PX = 40  # chosen: in the halved picture; a Pioneer at 4 m covers about 300
STREAK_HEIGHT_PX = 4  # chosen: a torn piece of 1 to 3 rows, halved and blurred, is at most this high
STREAK_RATIO = 4.0  # chosen: and at least this many times wider than high
VOTES, VOTERS = 3, 5  # chosen: link noise does not hit the same detector three times within five frames


@dataclass(frozen=True, slots=True)
class Blob:
    """A rectangle around changed pixels, in pixels of the full picture, origin in its upper left corner."""

    x_px: int
    y_px: int
    width_px: int
    height_px: int
    area_px: int


@dataclass(frozen=True, slots=True, eq=False)
class Stages:
    """The intermediate pictures of the last analysis, at half the size, for debug views.

    Attributes:
        picture: The new picture, blurred, grey levels.
        average: The average used for comparison; changes with the next picture.
        difference: Absolute difference from the average, grey levels.
        bar: Threshold in grey levels above which a difference is more than noise.
        changed: Pixels that differed by more than noise.
        kept: The same without rows that changed as a whole; all False if the picture was rejected.
    """

    picture: NDArray[np.float32]
    average: NDArray[np.float32]
    difference: NDArray[np.float32]
    bar: float
    changed: NDArray[np.bool_]
    kept: NDArray[np.bool_]


def halve(frame: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the picture at half its size, each pixel the mean of four.

    Args:
        frame: Grey levels 0 to 255, shape (height, width), row 0 on top.

    Returns:
        Grey levels, shape (height // 2, width // 2).

    Example:
        >>> halve(np.array([[0, 100], [100, 200]], np.uint8))
        array([[100]], dtype=uint8)
    """
    height, width = frame.shape
    small = cv2.resize(frame, (width // 2, height // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8)


def median_of(pictures: Sequence[NDArray[np.float32]]) -> NDArray[np.float32]:
    """Return the median of each pixel; of an even number of pictures the mean of the middle two.

    For eight pictures this is sixteen times as fast as NumPy's median, because whole pictures are compared, not single
    pixels.

    Args:
        pictures: Grey levels, one or more of shape (height, width).

    Example:
        >>> median_of([np.full((1, 1), level, np.float32) for level in (9.0, 1.0, 4.0, 3.0)])
        array([[3.5]], dtype=float32)

    Raises:
        ValueError: There is no picture.
    """
    if not pictures:
        raise ValueError("no picture, no median")
    ordered, middle = list(pictures), len(pictures) // 2
    for last in range(len(ordered) - 1, middle - 1 - (len(ordered) + 1) % 2, -1):
        for place in range(last):
            low, high = ordered[place], ordered[place + 1]
            ordered[place], ordered[place + 1] = np.minimum(low, high), np.maximum(low, high)
    if len(ordered) % 2:
        return ordered[middle]
    return np.asarray((ordered[middle - 1] + ordered[middle]) / 2, np.float32)


def noise_bar(difference: NDArray[np.float32]) -> float:
    """Return the threshold in grey levels above which a difference of two pictures is more than noise."""
    return max(LEAST_DIFFERENCE, MEAN_DIFFERENCES * float(difference.mean()))


def torn_rows(changed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the rows that changed as a whole because the link tore them, shape (height,).

    Example:
        >>> torn_rows(np.array([[True, True, True], [True, False, False]]))
        array([ True, False])
    """
    if np.count_nonzero(changed) <= ROW_SHARE * changed.shape[1]:  # too few for one row, as in most pictures
        return np.zeros(len(changed), np.bool_)
    return np.asarray(changed.sum(axis=1) / changed.shape[1] > ROW_SHARE, np.bool_)


def edges_moved(average: NDArray[np.float32], picture: NDArray[np.float32]) -> float:
    """Return the share of the average's vertical edges at which the picture differs; 0 if there are hardly any edges.

    Args:
        average: Grey levels, shape (height, width).
        picture: The same shape.

    Example:
        >>> post = np.zeros((240, 160), np.float32); post[:, 80:] = 100.0
        >>> edges_moved(post, np.roll(post, 3, axis=1)), edges_moved(0 * post, post)
        (1.0, 0.0)
    """
    return _edges_moved(average, [picture])[0]


def _like(average: NDArray[np.float32], pictures: Sequence[NDArray[np.float32]]) -> list[NDArray[np.float32]]:
    """Return the pictures in which few of the average's edges have moved."""
    return [one for one, share in zip(pictures, _edges_moved(average, pictures), strict=True) if share <= EDGES_SHARE]


def _edges_moved(average: NDArray[np.float32], pictures: Sequence[NDArray[np.float32]]) -> list[float]:
    edges = np.abs(average[:, 1:] - average[:, :-1]) > EDGE_LEVELS  # OpenCV refuses a picture of one column
    if (count := int(np.count_nonzero(edges))) < LEAST_EDGES_PX:
        return [0.0] * len(pictures)
    differ = [cv2.absdiff(picture, average) > EDGE_LEVELS for picture in pictures]
    return [float(np.count_nonzero(edges & (one[:, 1:] | one[:, :-1])) / count) for one in differ]


def largest_blob(changed: NDArray[np.bool_], *, drop_streaks: bool = True) -> Blob | None:
    """Return the largest connected region that is neither too small nor a streak, or None.

    Args:
        changed: Changed pixels of the halved picture, shape (height, width).
        drop_streaks: False: streaks (pieces of torn rows) are accepted, too.

    Returns:
        The region in pixels of the full picture.
    """
    best: Blob | None = None
    if np.count_nonzero(changed) < LEAST_AREA_PX:
        return best
    count, _labels, found, _centres = cv2.connectedComponentsWithStats(changed.view(np.uint8), connectivity=8)
    for x, y, width, height, area in found[1:count].tolist():
        is_streak = drop_streaks and height <= STREAK_HEIGHT_PX and width >= STREAK_RATIO * height
        if area >= LEAST_AREA_PX and not is_streak and (best is None or 4 * area > best.area_px):
            best = Blob(2 * x, 2 * y, 2 * width, 2 * height, 4 * area)
    return best


@dataclass(frozen=True, slots=True, eq=False)
class Judged:
    """The result of a comparison of a picture with an average.

    Attributes:
        stages: The intermediate pictures.
        sound: Rows that may change the average, as a mask of the picture's shape; None: the picture is rejected.
        blob: The largest region that changed.
    """

    stages: Stages
    sound: NDArray[np.bool_] | None
    blob: Blob | None


def prepared(frame: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the picture prepared for comparison: at half its size, blurred.

    Args:
        frame: Grey levels 0 to 255, shape (height, width), row 0 on top.

    Raises:
        ValueError: The array is not a grey picture of at least 2 × 2 pixels.
    """
    if frame.ndim != 2 or min(frame.shape) < 2:
        raise ValueError(f"a grey picture has shape (height, width), not {frame.shape}")
    return np.asarray(cv2.blur(halve(frame), (3, 3)), np.float32)


def judge(picture: NDArray[np.float32], average: NDArray[np.float32], *, filters_rows: bool = True) -> Judged:
    """Compare a picture with an average of the same shape.

    Args:
        picture: A prepared picture.
        average: Average of prepared pictures.
        filters_rows: False: without the filter for whole rows and their pieces.
    """
    difference = np.asarray(cv2.absdiff(picture, average), np.float32)
    bar = noise_bar(difference)
    changed = np.asarray(difference > bar, np.bool_)
    torn = torn_rows(changed) if filters_rows else np.zeros(len(changed), np.bool_)
    stages = Stages(picture, average, difference, bar, changed, np.zeros_like(changed))
    if torn.mean() > ROWS_SHARE or (filters_rows and edges_moved(average, picture) > EDGES_SHARE):
        return Judged(stages, None, None)
    sound = np.repeat(~torn[:, np.newaxis], picture.shape[1], axis=1)
    stages = replace(stages, kept=changed & sound)
    return Judged(stages, sound, largest_blob(stages.kept, drop_streaks=filters_rows))


class Vote:
    """Decides from the last ``VOTERS`` pictures whether a region is more than link noise.

    Attributes:
        last: Whether each of them had a region, newest last.
    """

    def __init__(self) -> None:
        self.last: deque[bool] = deque(maxlen=VOTERS)

    def count(self, blob: Blob | None) -> Blob | None:
        """Count the region of a further picture; return it if ``VOTES`` of the last ``VOTERS`` pictures had one."""
        self.last.append(blob is not None)
        return blob if sum(self.last) >= VOTES else None


class Background:
    """The running average of one camera's prepared pictures; it is kept while its robot is swapped out.

    Attributes:
        times_begun: Number of restarts of fast adaptation; earlier votes are dropped at each restart.
    """

    def __init__(self) -> None:
        self._average: NDArray[np.float32] | None = None
        self._fresh: list[NDArray[np.float32]] = []
        self._is_settling = True
        self._rejected_in_turn = 0
        self.times_begun = 0

    def begin(self) -> None:
        """Begin fast adaptation to changes in the meantime: the next ``FAST_FRAMES`` pictures are not compared."""
        self._fresh.clear()
        self._is_settling, self._rejected_in_turn = True, 0
        self.times_begun += 1

    def to_compare(self, picture: NDArray[np.float32]) -> NDArray[np.float32] | None:
        """Return the average for comparison with the next picture; None: the picture is used for adaptation.

        Args:
            picture: The prepared picture; after a change of shape the adaptation begins again.
        """
        known = self._fresh[0] if self._fresh else self._average
        if known is not None and known.shape != picture.shape:
            self._average = None
            self.begin()
        if self._is_settling or self._average is None:
            self._settle(picture)
            return None
        return self._average

    def learn(self, picture: NDArray[np.float32], sound: NDArray[np.bool_] | None) -> None:
        """Move the average towards the compared picture; many rejected pictures in a row begin a new adaptation.

        Args:
            sound: As in ``Judged``.
        """
        if sound is None:
            self._rejected_in_turn += 1
            if self._rejected_in_turn > REJECTED_IN_TURN:
                self.begin()
            return
        self._rejected_in_turn = 0
        if self._average is not None and self._average.shape == picture.shape:  # else the judgment was late
            cv2.accumulateWeighted(picture, self._average, SLOW_WEIGHT, mask=sound.astype(np.uint8))

    def _settle(self, picture: NDArray[np.float32]) -> None:
        """Collect one of the first pictures after a context switch; after the last one there is an average again.

        Pixels at which these pictures agree show a still scene; their present values are learned, so a body that came
        or left meanwhile does not count as motion. At the other pixels a body passes, and the old values stay for
        comparison.

        If enough of the pictures show the old view, only these are used. Otherwise the view is new, because a slipped
        picture looks like one of a turned robot. The result is the pictures' median, which a few bad pictures do not
        change. As long as most pictures differ from it, one more picture is collected.
        """
        self._fresh.append(picture)
        if len(self._fresh) < FAST_FRAMES:
            return
        old = self._average
        same = [] if old is None else _like(old, self._fresh)
        counted = same if len(same) >= LEAST_SAME else self._fresh
        median = median_of(counted)
        if 2 * len(_like(median, counted)) <= len(counted):
            del self._fresh[0]
            return
        if old is not None and counted is same:
            differ = sum(cv2.absdiff(median, fresh) > LEAST_DIFFERENCE for fresh in counted)
            np.copyto(old, median, where=differ <= MOVING_SHARE * len(counted))
        else:
            self._average = median
        self._fresh.clear()
        self._is_settling = False


class MotionDetector:
    """Analyzes one camera's pictures, one after the other; keeps the average while its robot is swapped out.

    Args:
        filters_rows: False: without the filter for whole rows and their pieces, to measure its effect.
    """

    def __init__(self, *, filters_rows: bool = True) -> None:
        self._filters_rows = filters_rows
        self.stages: Stages | None = None
        """The intermediate pictures of the last analysis; None: the last picture was used for adaptation."""
        self._background, self._vote = Background(), Vote()
        self._times_begun = 0
        self.frames = self.rejected = 0

    def swapped_in(self) -> None:
        """Begin fast adaptation to changes in the meantime; the next ``FAST_FRAMES`` pictures detect nothing."""
        self._background.begin()
        self._forget_what_was_before()

    @property
    def votes(self) -> Sequence[bool]:
        """Whether each of the last ``VOTERS`` judged pictures since the swap had a region, newest last."""
        return self._vote.last

    def look(self, frame: NDArray[np.uint8]) -> Blob | None:
        """Return the region of motion, or None.

        Args:
            frame: Grey levels 0 to 255, shape (height, width), row 0 on top; after a change of shape the adaptation
                begins again.

        Returns:
            The largest region of this picture, if ``VOTES`` of the last ``VOTERS`` pictures had one.

        Raises:
            ValueError: The array is not a grey picture of at least 2 × 2 pixels.
        """
        picture, found = prepared(frame), None
        self.frames, self.stages = self.frames + 1, None
        average = self._background.to_compare(picture)
        if average is not None:
            judged = judge(picture, average, filters_rows=self._filters_rows)
            self.stages = judged.stages
            self._background.learn(picture, judged.sound)
            if judged.sound is None:
                self.rejected += 1
            else:
                found = self._vote.count(judged.blob)
        self._forget_what_was_before()
        return found

    def _forget_what_was_before(self) -> None:
        """Drop the votes if the background has begun again since."""
        if self._times_begun != self._background.times_begun:
            self._times_begun = self._background.times_begun
            self._vote.last.clear()
