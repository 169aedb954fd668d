"""Motion detection: what changes against a running average, in pictures from an analog radio link.

Half-size mean → blur → running average → difference → threshold → rows that changed as a whole are
link noise → connected regions → a vote over the last frames. Without the row filter and the vote,
link noise alone gives an alarm in every slice. A picture whose rows have slipped sideways is no picture
of the scene: most of its vertical edges are elsewhere; it is rejected, and leaves no trace in the average.

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

SLOW_WEIGHT = 0.08  # chosen: a standing body is forgotten after about half a second
FAST_FRAMES = 8  # chosen: 0.27 s at 30 frames a second, the price of every swap-in
MOVING_SHARE = 0.25  # chosen: of the first pictures; where more than so many differ from the others, something passes
LEAST_DIFFERENCE = 28.0  # chosen: grey levels; above the blurred noise of a 13 dB link
MEAN_DIFFERENCES = 4.5  # chosen: in units of the mean difference, so that a noisy link raises the bar
ROW_SHARE = 0.55  # chosen: a torn row changes as a whole, a body never fills more than half of one
ROWS_SHARE = 0.25  # chosen: with more torn rows than this the whole picture is doubtful
EDGE_LEVELS = 12.0  # chosen: grey levels between neighbors in the average; furniture and doors have more
EDGES_SHARE = 0.62  # measured: a Pioneer 1.2 m away hides up to 0.49 of the edges, slipped rows move 0.77 and more
LEAST_SAME = 3  # chosen: of the first pictures; as many slipped ones in a row hardly ever keep the edges in place
LEAST_EDGES_PX = 200  # measured: the papers' room shows 550 to 700; a small body can hide most of a few
REJECTED_IN_TURN = 15  # chosen: a second; the longest of the papers' bursts are shorter, then it is a new view
LEAST_AREA_PX = 40  # chosen: in the halved picture; a Pioneer at 4 m covers about 300
STREAK_HEIGHT_PX = 4  # chosen: a torn piece of 1 to 3 rows, halved and blurred, is at most this high
STREAK_RATIO = 4.0  # chosen: and at least this much wider than high
VOTES, VOTERS = 3, 5  # chosen: link noise does not hit the same detector three times within five frames


@dataclass(frozen=True, slots=True)
class Blob:
    """A rectangle around what changed, in pixels of the full picture, origin in its upper left corner."""

    x_px: int
    y_px: int
    width_px: int
    height_px: int
    area_px: int


@dataclass(frozen=True, slots=True, eq=False)
class Stages:
    """The pictures a detector went through for its last one, of half the size, for a look at how it judged.

    Attributes:
        picture: The new picture, blurred, grey levels.
        average: What it was compared with; changes when the next picture is looked at.
        difference: How far it was from the average, grey levels.
        bar: Grey levels above which a difference is more than noise.
        changed: Where it differed by more than noise does.
        kept: The same without rows that changed as a whole; all False if the picture was not judged.
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

    Sixteen times as fast as NumPy's for as few as eight: pictures are compared whole, not pixels one by one.

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
    """Return the grey levels above which a difference of two pictures is more than noise."""
    return max(LEAST_DIFFERENCE, MEAN_DIFFERENCES * float(difference.mean()))


def changed_pixels(average: NDArray[np.float32], picture: NDArray[np.float32]) -> NDArray[np.bool_]:
    """Return where the picture differs from the average by more than noise does.

    Args:
        average: Grey levels, shape (height, width).
        picture: Grey levels, the same shape.

    Returns:
        True where the difference exceeds ``LEAST_DIFFERENCE`` and ``MEAN_DIFFERENCES`` times its mean.
    """
    difference = np.asarray(cv2.absdiff(picture, average), np.float32)
    return np.asarray(difference > noise_bar(difference), np.bool_)


def torn_rows(changed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which rows changed as a whole, shape (height,): the link tore them.

    Example:
        >>> torn_rows(np.array([[True, True, True], [True, False, False]]))
        array([ True, False])
    """
    return np.asarray(changed.sum(axis=1) / changed.shape[1] > ROW_SHARE, np.bool_)


def edges_moved(average: NDArray[np.float32], picture: NDArray[np.float32]) -> float:
    """Return on which share of the average's vertical edges the picture differs; 0 if it has hardly any.

    Args:
        average: Grey levels, shape (height, width).
        picture: The same shape.

    Example:
        >>> post = np.zeros((240, 160), np.float32); post[:, 80:] = 100.0
        >>> edges_moved(post, np.roll(post, 3, axis=1)), edges_moved(0 * post, post)
        (1.0, 0.0)
    """
    edges = cv2.absdiff(average[:, 1:], average[:, :-1]) > EDGE_LEVELS
    count = int(np.count_nonzero(edges))
    if count < LEAST_EDGES_PX:
        return 0.0
    differs = cv2.absdiff(picture, average) > EDGE_LEVELS
    return float(np.count_nonzero(edges & (differs[:, 1:] | differs[:, :-1])) / count)


def largest_blob(changed: NDArray[np.bool_], *, drop_streaks: bool = True) -> Blob | None:
    """Return the largest connected region that is neither too small nor a streak, or None.

    Args:
        changed: Of the halved picture, shape (height, width).
        drop_streaks: False lets streaks pass, the pieces of torn rows.

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
    """What a picture shows against an average.

    Attributes:
        stages: The pictures on the way.
        sound: Rows that may change the average, as a mask of the picture's shape; None: it is no picture of the scene.
        blob: The largest region that changed.
    """

    stages: Stages
    sound: NDArray[np.bool_] | None
    blob: Blob | None


def prepared(frame: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Return the picture as it is compared: at half its size, blurred.

    Args:
        frame: Grey levels 0 to 255, shape (height, width), row 0 on top.

    Raises:
        ValueError: It is no grey picture of at least 2 × 2 pixels.
    """
    if frame.ndim != 2 or min(frame.shape) < 2:
        raise ValueError(f"a grey picture has shape (height, width), not {frame.shape}")
    return np.asarray(cv2.blur(halve(frame), (3, 3)), np.float32)


def judge(picture: NDArray[np.float32], average: NDArray[np.float32], *, filters_rows: bool = True) -> Judged:
    """Return what a picture shows against an average of the same shape.

    Args:
        picture: A prepared one.
        average: Of prepared ones.
        filters_rows: False leaves out the filter of whole rows and their pieces.
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
    """Decides by the last ``VOTERS`` pictures whether a region is more than link noise.

    Attributes:
        last: Whether each of them had a region, newest last.
    """

    def __init__(self) -> None:
        self.last: deque[bool] = deque(maxlen=VOTERS)

    def count(self, blob: Blob | None) -> Blob | None:
        """Return the region of a further picture, if ``VOTES`` of the last ``VOTERS`` pictures had one."""
        self.last.append(blob is not None)
        return blob if sum(self.last) >= VOTES else None


class Background:
    """The running average of one camera's prepared pictures; it is kept when its robot is swapped out.

    Attributes:
        times_begun: How often it began to adapt fast; what was seen before then counts no more.
    """

    def __init__(self) -> None:
        self._average: NDArray[np.float32] | None = None
        self._fresh: list[NDArray[np.float32]] = []
        self._is_settling = True
        self._rejected_in_turn = 0
        self.times_begun = 0

    def begin(self) -> None:
        """Adapt fast to what changed meanwhile: the next ``FAST_FRAMES`` pictures are compared with nothing."""
        self._fresh.clear()
        self._is_settling, self._rejected_in_turn = True, 0
        self.times_begun += 1

    def to_compare(self, picture: NDArray[np.float32]) -> NDArray[np.float32] | None:
        """Return the average to compare the next picture with; None: it is one of the first, and part of the average.

        Args:
            picture: A new shape begins anew.
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
        """Move the average towards the picture that was compared with it; many rejected ones in a row are a new view.

        Args:
            sound: As in ``Judged``.
        """
        if sound is None:
            self._rejected_in_turn += 1
            if self._rejected_in_turn > REJECTED_IN_TURN:
                self.begin()
            return
        self._rejected_in_turn = 0
        assert self._average is not None  # noqa: S101  the picture was compared with it
        cv2.accumulateWeighted(picture, self._average, SLOW_WEIGHT, mask=sound.astype(np.uint8))

    def _settle(self, picture: NDArray[np.float32]) -> None:
        """Take one of the first pictures after a swap; after the last of them there is an average again.

        Where these pictures agree, the scene stands still, and is learned as it is now: who left or came meanwhile
        does not move. Where they do not agree something passes, and the old view stays for comparison.

        If enough of them show the old view, only those count; otherwise the view is new, and a slipped picture
        looks like a turned robot. Their median is taken, which a few bad ones do not move; while most of
        them are not like it, one more picture is waited for.
        """
        self._fresh.append(picture)
        if len(self._fresh) < FAST_FRAMES:
            return
        old = self._average
        same = [] if old is None else [fresh for fresh in self._fresh if edges_moved(old, fresh) <= EDGES_SHARE]
        counted = same if len(same) >= LEAST_SAME else self._fresh
        median = median_of(counted)
        alike = sum(edges_moved(median, fresh) <= EDGES_SHARE for fresh in counted)
        if 2 * alike <= len(counted):
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
    """Looks at one camera's pictures, one after the other; keeps the average when its robot is swapped out.

    Args:
        filters_rows: False leaves out the second filter, of whole rows and their pieces: to measure what it is for.
    """

    def __init__(self, *, filters_rows: bool = True) -> None:
        self._filters_rows = filters_rows
        self.stages: Stages | None = None
        """The pictures on the way to the last judgment; None: the last picture was one of the first after a swap."""
        self._background, self._vote = Background(), Vote()
        self._times_begun = 0
        self.frames = self.rejected = 0

    def swapped_in(self) -> None:
        """Adapt fast to what changed meanwhile: the next ``FAST_FRAMES`` pictures detect nothing."""
        self._background.begin()
        self._forget_what_was_before()

    @property
    def votes(self) -> Sequence[bool]:
        """Whether each of the last ``VOTERS`` judged pictures since the swap had a region, newest last."""
        return self._vote.last

    def look(self, frame: NDArray[np.uint8]) -> Blob | None:
        """Return where something moves, or None.

        Args:
            frame: Grey levels 0 to 255, shape (height, width), row 0 on top; a new shape starts afresh.

        Returns:
            The largest region of this picture, if ``VOTES`` of the last ``VOTERS`` pictures had one.

        Raises:
            ValueError: It is no grey picture of at least 2 × 2 pixels.
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
        """Forget the votes of the time before the background began anew, if it has."""
        if self._times_begun != self._background.times_begun:
            self._times_begun = self._background.times_begun
            self._vote.last.clear()
