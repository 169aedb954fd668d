"""Messages of behaviors: reports to their parents, and published events."""

from __future__ import annotations

from typing import Annotated

from backbone.errors import Refusal
from backbone.mission.behavior_reports import BehaviorStatus, BreakOff, BrokenOff, ChildReport, ReportNoted
from backbone.ranges import (
    FEW,
    MANY,
    Count,
    Instant,
    Mention,
    PictureSide,
    PixelCount,
    PixelPlace,
    Pixels,
    Text,
    Values,
)
from backbone.wire import Message

__all__ = [
    "AskBehavior",
    "BehaviorState",
    "BehaviorStatus",
    "BreakOff",
    "BrokenOff",
    "ChildReport",
    "GreyPicture",
    "MotionSeen",
    "NotAChild",
    "NotYourOrder",
    "PictureJudged",
    "Region",
    "ReportNoted",
    "SwappedIn",
    "WaypointReached",
]


class AskBehavior(Message, frozen=True):
    """Ask for a behavior's progress."""


class BehaviorState(Message, frozen=True):
    """Answer to ``AskBehavior``.

    Attributes:
        payload: Payload of its last report to its parent.
        holds: Role → name of its granted RCs; empty while suspended or without an ARC.
        suspended_because: Why the behavior is not at work: reason and cause of the suspension of its ARC or, without an
            ARC, of all its running children; also before its first grant. Empty: the behavior is at work, or has
            finished.
        tree: Its branch of the behavior tree as text, one line a node.
    """

    name: Mention
    status: BehaviorStatus
    payload: Values
    holds: Annotated[dict[Mention, Mention], MANY]
    suspended_because: Text
    tree: Text


class Region(Message, frozen=True):
    """A rectangle in a picture, in pixels from its upper left corner."""

    x_px: PixelPlace
    y_px: PixelPlace
    width_px: PixelCount
    height_px: PixelCount


class GreyPicture(Message, frozen=True):
    """A picture of one robot's camera, for modules.

    Attributes:
        robot: The robot of the camera.
        captured_s: Mission time of the capture.
        width_px: Columns.
        height_px: Rows.
        pixels: Grey levels, row by row from the top; ``width_px`` times ``height_px`` of them.
    """

    robot: Mention
    captured_s: Instant
    width_px: PictureSide
    height_px: PictureSide
    pixels: Pixels

    def __post_init__(self) -> None:
        if self.width_px * self.height_px != len(self.pixels):
            raise ValueError(f"{len(self.pixels)} pixels for {self.width_px} x {self.height_px}")


class SwappedIn(Message, frozen=True):
    """A robot's pictures arrive again after a context switch, and may show another view.

    Attributes:
        at_s: Mission time of the grant.
    """

    at_s: Instant


class MotionSeen(Message, frozen=True):
    """Motion in a picture, published as an event by a watching behavior, and as an output by a module.

    Attributes:
        at_s: Mission time of the picture.
        robot: The robot of the camera.
        region: Its region of the picture.
    """

    at_s: Instant
    robot: Mention
    region: Region


class PictureJudged(Message, frozen=True):
    """The analysis of one picture, which was compared with the average of earlier pictures.

    Attributes:
        captured_s: Mission time of the picture.
        robot: The robot of the camera.
        votes: Whether each of the last analyzed pictures had a region, newest last.
        region: Region of motion; None: no certain motion.
        is_rejected: Whether the picture is too torn to be used.
    """

    captured_s: Instant
    robot: Mention
    votes: Annotated[list[bool], FEW]
    region: Region | None = None
    is_rejected: bool = False


class WaypointReached(Message, frozen=True):
    """Arrival at a way point, published as an event by a patrol.

    Attributes:
        robot: The patrolling robot.
        number: Counts from 1 over all rounds; each number is published once.
        waypoint: Number of the way point, from 0, in the order of the patrol's parameter.
    """

    at_s: Instant
    robot: Mention
    number: Count
    waypoint: Count


class NotAChild(Refusal):
    """The sender of the report is not a child of this behavior."""

    code = "behavior.not_a_child"
    remedy = "Report to the behavior named before you in your path."


class NotYourOrder(Refusal):
    """Only the console that ordered a behavior breaks it off; only the launcher changes its place in the tree."""

    code = "behavior.not_your_order"
    remedy = "Take the robot at a console, or change the mission by 'scout-backbone stop' and 'scout-backbone tree'."
