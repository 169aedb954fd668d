"""Six modules that raise an alarm if a person comes towards a camera that stands still.

picture → PictureAverage → PictureDifference → RegionFinder → RegionVote → GrowthEstimator → ApproachAlarm → alarm

The modules exchange messages, and each value depends only on the values before it. So each module can be in any unit,
process or host, and the outputs are the same: docs/how-to/arrange-modules.md.
"""

from collections import deque
from math import log
from typing import Annotated

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from backbone.ranges import Instant, Mention, Share
from backbone.wire import Message
from mission_control.messages import GreyPicture, PictureJudged, Region
from mission_control.modules.module import Module
from mission_control.modules.surveillance import region_of
from mission_control.vision.frame_averaging import average
from mission_control.vision.motion_detection import LEAST_DIFFERENCE, Blob, Vote, halve, largest_blob

Grey = NDArray[np.uint8]
Few = Annotated[int, msgspec.Meta(ge=1, le=256)]
Growth = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]


class Found(Message, frozen=True):
    captured_s: Instant
    robot: Mention
    region: Region | None


class Growing(Message, frozen=True):
    captured_s: Instant
    robot: Mention
    growth_hz: Growth  # at 0.5 a body at constant speed arrives after 2 s; negative: it moves away


class Alarm(Message, frozen=True):
    captured_s: Instant
    robot: Mention
    is_on: bool
    certainty: Share


class PictureAverage(Module):
    """The mean of the last pictures, at half their size, which reduces noise."""

    class Inputs(Module.Inputs):
        picture: GreyPicture

    class Outputs(Module.Outputs):
        average: GreyPicture

    class Parameters(Module.Parameters, frozen=True):
        count: Few = 2

    parameters: Parameters

    def reset(self) -> None:
        self.last: deque[Grey] = deque(maxlen=self.parameters.count)

    def update(self, inputs: Inputs) -> Outputs:
        small = halve(pixels_of(inputs.picture))
        if self.last and self.last[0].shape != small.shape:
            self.last.clear()
        self.last.append(small)
        return self.Outputs(picture_like(inputs.picture, average(list(self.last))))


class PictureDifference(Module):
    """The difference of each picture from an earlier one."""

    class Inputs(Module.Inputs):
        average: GreyPicture

    class Outputs(Module.Outputs):
        difference: GreyPicture

    class Parameters(Module.Parameters, frozen=True):
        earlier: Few = 4

    parameters: Parameters

    def reset(self) -> None:
        self.last: deque[Grey] = deque(maxlen=self.parameters.earlier + 1)

    def update(self, inputs: Inputs) -> Outputs:
        now = pixels_of(inputs.average)
        if self.last and self.last[0].shape != now.shape:
            self.last.clear()
        self.last.append(now)
        difference = np.asarray(cv2.absdiff(now, self.last[0]), np.uint8)
        self.debug.picture("difference", lambda: difference)
        return self.Outputs(picture_like(inputs.average, difference))


class RegionFinder(Module):
    """The largest region whose difference exceeds the noise."""

    class Inputs(Module.Inputs):
        difference: GreyPicture

    class Outputs(Module.Outputs):
        found: Found

    class Parameters(Module.Parameters, frozen=True):
        least_difference: float = LEAST_DIFFERENCE

    parameters: Parameters

    def update(self, inputs: Inputs) -> Outputs:
        given = inputs.difference
        blob = largest_blob(pixels_of(given) > self.parameters.least_difference)
        return self.Outputs(Found(given.captured_s, given.robot, None if blob is None else region_of(blob)))


class RegionVote(Module):
    """The region, if several of the last pictures had one; a watching behavior uses ``judged`` as its vision."""

    class Inputs(Module.Inputs):
        found: Found

    class Outputs(Module.Outputs):
        judged: PictureJudged
        certain: Found

    def reset(self) -> None:
        self.vote = Vote()

    def update(self, inputs: Inputs) -> Outputs:
        at_s, robot, region = inputs.found.captured_s, inputs.found.robot, inputs.found.region
        blob = None if region is None else Blob(region.x_px, region.y_px, region.width_px, region.height_px, 0)
        certain = None if self.vote.count(blob) is None else region
        judged = PictureJudged(at_s, robot, list(self.vote.last), certain)
        return self.Outputs(judged, Found(at_s, robot, certain))


class GrowthEstimator(Module):
    """The growth rate of the region: the slope of a line through the logarithms of its last heights."""

    class Inputs(Module.Inputs):
        certain: Found

    class Outputs(Module.Outputs):
        growing: Growing

    class Parameters(Module.Parameters, frozen=True):
        over: Annotated[int, msgspec.Meta(ge=2, le=256)] = 30

    parameters: Parameters

    def reset(self) -> None:
        self.heights: deque[tuple[float, float]] = deque(maxlen=self.parameters.over)
        self.missing = 0

    def update(self, inputs: Inputs) -> Outputs:
        seen = inputs.certain
        self.missing = self.missing + 1 if seen.region is None else 0
        if seen.region is not None:
            self.heights.append((seen.captured_s, log(seen.region.height_px)))
        elif self.missing > self.parameters.over:  # it is gone
            self.heights.clear()
        growth_hz = slope(list(self.heights)) if len(self.heights) == self.parameters.over else 0.0
        self.debug.value("growth", growth_hz)
        return self.Outputs(Growing(seen.captured_s, seen.robot, growth_hz))


class ApproachAlarm(Module):
    """The alarm is on as long as most of the last estimates show an approach."""

    class Inputs(Module.Inputs):
        growing: Growing

    class Outputs(Module.Outputs):
        alarm: Alarm

    class Parameters(Module.Parameters, frozen=True):
        least_growth_hz: float = 0.1
        over: Few = 8

    parameters: Parameters

    def reset(self) -> None:
        self.last: deque[bool] = deque(maxlen=self.parameters.over)

    def update(self, inputs: Inputs) -> Outputs:
        growing = inputs.growing
        self.last.append(growing.growth_hz >= self.parameters.least_growth_hz)
        certainty = sum(self.last) / self.parameters.over
        return self.Outputs(Alarm(growing.captured_s, growing.robot, certainty > 0.5, certainty))


def pixels_of(picture: GreyPicture) -> Grey:
    return np.frombuffer(picture.pixels, np.uint8).reshape(picture.height_px, picture.width_px)


def picture_like(picture: GreyPicture, pixels: Grey) -> GreyPicture:
    height_px, width_px = pixels.shape
    return GreyPicture(picture.robot, picture.captured_s, width_px, height_px, memoryview(pixels).cast("B"))


def slope(points: list[tuple[float, float]]) -> float:
    """Return the slope of the line with the least squares; 0 if all points have one time."""
    middle_x, middle_y = (sum(one) / len(points) for one in zip(*points, strict=True))
    spread = sum((x - middle_x) ** 2 for x, _y in points)
    return sum((x - middle_x) * (y - middle_y) for x, y in points) / spread if spread else 0.0
