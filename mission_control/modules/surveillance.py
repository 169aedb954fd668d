"""The vision of a watching behavior as modules (averaging → detection → tracking), and the earlier method.

Together the three modules give the same results as ``vision.motion_detection.MotionDetector``, picture by picture. Each
can be exchanged for another algorithm with the same inputs and outputs, and each has its own debug views.

The average depends on the judgment of the previous picture. ``Averaging`` gets the newest judgment as a latest value,
so the graph has no cycle.

Source: RAM 2002, "Distributed Surveillance Task"; modules: RoboFrame 2006, section IV.
"""

from __future__ import annotations

from typing import Annotated

import msgspec
import numpy as np
from numpy.typing import NDArray

from mission_control.messages import GreyPicture, MotionSeen, PictureJudged, Region, SwappedIn
from mission_control.modules.module import Module
from mission_control.modules.ports import LATEST
from mission_control.vision.frame_averaging import AVERAGED, FrameAveraging
from mission_control.vision.motion_detection import Background, Blob, Judged, Vote, judge, prepared

BRIGHTER = 4  # chosen: the least difference that counts, 28 grey levels, is clearly visible


class BackgroundComparison(msgspec.Struct, frozen=True, eq=False):
    """A picture and the average to compare it with.

    Attributes:
        number: Grows by one with each comparison.
        view: Grows when the camera may show another view; regions of an earlier view are then dropped.
        captured_s: Mission time of the capture.
        robot: The robot of the camera.
        picture: The prepared picture, grey levels.
        average: Average of the earlier pictures, the same shape.
    """

    number: int
    view: int
    captured_s: float
    robot: str
    picture: NDArray[np.float32]
    average: NDArray[np.float32]


class Judgment(msgspec.Struct, frozen=True, eq=False):
    """A comparison and its result."""

    comparison: BackgroundComparison
    judged: Judged


class Averaging(Module):
    """Keeps the running average of one camera's pictures, and learns a new view fast."""

    class Inputs(Module.Inputs):
        """The picture; ``swapped_in`` arrives with the first picture after a context switch."""

        picture: GreyPicture
        swapped_in: SwappedIn | None = None
        judgment: Annotated[Judgment | None, LATEST] = None

    class Outputs(Module.Outputs):
        """No output while the first pictures of a view are learned."""

        comparison: BackgroundComparison | None = None

    def reset(self) -> None:
        """Know no view."""
        self._background, self._number = Background(), 0
        self._learned = 0  # number of the newest comparison whose judgment was learned

    def update(self, inputs: Inputs) -> Outputs:
        """Learn from the judgment of the previous picture; return this picture with the average."""
        judgment, given = inputs.judgment, inputs.picture
        if judgment is not None and judgment.comparison.number > self._learned:
            self._learned = judgment.comparison.number
            self._background.learn(judgment.comparison.picture, judgment.judged.sound)
        if inputs.swapped_in is not None:
            self._background.begin()
        picture = prepared(_pixels(given))
        average = self._background.to_compare(picture)
        if average is None:
            return self.Outputs()
        self._number += 1
        view = self._background.times_begun
        return self.Outputs(
            BackgroundComparison(self._number, view, given.captured_s, given.robot, picture, average.copy())
        )  # a copy, because the average changes later, and an output must not


class Detection(Module):
    """Judges where a picture differs from the average by more than noise."""

    class Inputs(Module.Inputs):
        """The comparison."""

        comparison: BackgroundComparison

    class Outputs(Module.Outputs):
        """The judgment of each comparison."""

        judgment: Judgment

    class Parameters(Module.Parameters, frozen=True):
        """Parameters of ``Detection``.

        Attributes:
            filters_rows: True: rows that changed as a whole count as link noise.
        """

        filters_rows: bool = True

    parameters: Parameters

    def update(self, inputs: Inputs) -> Outputs:
        """Return the judgment."""
        comparison = inputs.comparison
        judged = judge(comparison.picture, comparison.average, filters_rows=self.parameters.filters_rows)
        stages = judged.stages
        self.debug.picture("difference", lambda: BRIGHTER * stages.difference)
        self.debug.picture("changed", lambda: 127 * (stages.changed.astype(np.uint8) + stages.kept))
        self.debug.value("threshold", stages.bar)
        return self.Outputs(Judgment(comparison, judged))


class Tracking(Module):
    """Tracks regions over pictures: motion is certain only if several of the last pictures show it."""

    class Inputs(Module.Inputs):
        """Judgments, one after the other."""

        judgment: Judgment

    class Outputs(Module.Outputs):
        """The result of each picture, and motion if the picture shows it."""

        judged: PictureJudged
        motion: MotionSeen | None = None

    def reset(self) -> None:
        """Forget all regions."""
        self._vote, self._view = Vote(), 0

    def update(self, inputs: Inputs) -> Outputs:
        """Count the region; return it if enough of the last pictures had one."""
        comparison, judged = inputs.judgment.comparison, inputs.judgment.judged
        if comparison.view != self._view:
            self._view = comparison.view
            self._vote.last.clear()
        blob = None if judged.sound is None else self._vote.count(judged.blob)
        votes, at_s, robot = list(self._vote.last), comparison.captured_s, comparison.robot
        self.debug.value("votes", sum(votes))
        region = None if blob is None else region_of(blob)
        return self.Outputs(
            PictureJudged(at_s, robot, votes, region, judged.sound is None),
            None if region is None else MotionSeen(at_s, robot, region),
        )


class FrameDifference(Module):
    """The earlier method for the same task, in one module, for comparison with the three others."""

    class Inputs(Module.Inputs):
        """As for ``Averaging``."""

        picture: GreyPicture
        swapped_in: SwappedIn | None = None

    class Outputs(Module.Outputs):
        """As for ``Tracking``; if both run side by side, one of them needs other keys."""

        motion: MotionSeen | None = None

    class Parameters(Module.Parameters, frozen=True):
        """Parameters of ``FrameDifference``.

        Attributes:
            averaged: Number of pictures in an average.
        """

        averaged: Annotated[int, msgspec.Meta(ge=1)] = AVERAGED

    parameters: Parameters

    def reset(self) -> None:
        """Forget all pictures."""
        self._frames = FrameAveraging(self.parameters.averaged)

    def update(self, inputs: Inputs) -> Outputs:
        """Return the region in which the last pictures differ from the ones before."""
        if inputs.swapped_in is not None:
            self._frames.swapped_in()
        given = inputs.picture
        blob = self._frames.look(_pixels(given))
        if blob is None:
            return self.Outputs()
        return self.Outputs(MotionSeen(given.captured_s, given.robot, region_of(blob)))


def _pixels(picture: GreyPicture) -> NDArray[np.uint8]:
    return np.frombuffer(picture.pixels, np.uint8).reshape(picture.height_px, picture.width_px)


def region_of(blob: Blob) -> Region:
    """Return the rectangle of a blob as a message."""
    return Region(blob.x_px, blob.y_px, blob.width_px, blob.height_px)
