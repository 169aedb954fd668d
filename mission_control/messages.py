"""What behaviors say: to their parents, and to whoever listens."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from backbone.ranges import MANY, Count, Instant, Mention, PixelCount, PixelPlace, Text, Values
from backbone.wire import Message


class BehaviorStatus(StrEnum):
    """How far a behavior is."""

    RUNNING = "running"  # at work, or suspended and waiting to go on
    SUCCESS = "success"  # done, its aim was reached; final
    FAILURE = "failure"  # done, its aim cannot be reached; final

    @property
    def is_final(self) -> bool:
        """True for success and failure."""
        return self is not BehaviorStatus.RUNNING


class Report(Message, frozen=True):
    """Child to parent: this is how far I am.

    Attributes:
        child: Name of the child.
        status: A final one is said once and stands.
        payload: What the parent may need to decide: plain values only.
    """

    child: Mention
    status: BehaviorStatus
    payload: Values = {}


class ReportNoted(Message, frozen=True):
    """Answer to ``Report``."""


class AskBehavior(Message, frozen=True):
    """How far are you?"""


class BehaviorState(Message, frozen=True):
    """Answer to ``AskBehavior``.

    Attributes:
        name: Of the behavior.
        status: How far it is.
        payload: As last reported to its parent.
        holds: Kind → name of the RCs it holds now; empty while suspended or without an ARC.
        suspended_because: Reason and by whom, empty unless suspended.
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


class MotionSeen(Message, frozen=True):
    """Published as an event by a watching behavior: something moved.

    Attributes:
        at_s: Mission time at which the picture was taken.
        robot: Robot whose camera saw it.
        region: Where in its picture.
    """

    at_s: Instant
    robot: Mention
    region: Region


class WaypointReached(Message, frozen=True):
    """Published as an event by a patrol: the robot is at a way point.

    Attributes:
        at_s: Mission time.
        robot: Robot that patrols.
        number: Counts from 1 over all rounds; each number is published once.
        waypoint: Which one, from 0, in the order of the patrol's parameter.
    """

    at_s: Instant
    robot: Mention
    number: Count
    waypoint: Count
