"""Messages of localizers: estimated poses of robots with their uncertainty and source, and the plan of the floor.

* component → localizer: ``AskPose``, ``AskHome``, ``AskFloorPlan``; localizer → everybody: ``Pose``, published under
  its address (conversation ``poses``) when a believed position changes.
* a behavior that sees a landmark → everybody: ``LandmarkSighting``, published (conversation ``sightings``).

Positions are in meters in the room's frame: origin in a corner of the floor, x along its width, y along its depth,
headings counterclockwise from x.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import msgspec

from backbone.errors import Refusal
from backbone.ranges import MANY, Instant, Mention, Meters, Radians
from backbone.wire import Message

Extent = Annotated[float, msgspec.Meta(ge=0, le=1e6)]
"""Meters, never negative. Chosen: as far as ``Meters``."""


class UnknownPlace(Refusal):
    """The localizer does not know the body."""

    code = "localizer.unknown_body"
    remedy = "Use the name of a robot with a start place in the mission file, or of another body in the room."


class PoseSource(StrEnum):
    """Source of a position, for consoles."""

    SIMULATOR = "simulator"  # the simulated world itself; no real room has this source
    TRACKING = "tracking"  # a camera above the room
    DEAD_RECKONING = "dead reckoning"  # dead reckoning: the motions since the robot's last known place
    LANDMARK = "landmark"  # a landmark in the robot's picture


class AskPose(Message, frozen=True):
    """Ask a localizer for the pose of a robot, or of another body known to it."""

    body: Mention


class AskHome(Message, frozen=True):
    """Ask a localizer for a robot's first known pose."""

    body: Mention


class Pose(Message, frozen=True, tag="Pose/2"):
    """The estimated pose of a body: answer to ``AskPose`` and ``AskHome``, and publication.

    Attributes:
        at_s: Mission time for which it holds.
        source: Kind of the newest evidence for it.
        spread_m: Standard deviation of the position; 0: exact.
        spread_rad: Standard deviation of the heading; pi: the heading is unknown.
    """

    body: Mention
    at_s: Instant
    x_m: Meters
    y_m: Meters
    heading_rad: Radians
    source: PoseSource = PoseSource.SIMULATOR
    spread_m: Extent = 0.0
    spread_rad: Annotated[float, msgspec.Meta(ge=0, le=4)] = 0.0  # chosen: above pi, so that rounding cannot refuse it


class LandmarkSighting(Message, frozen=True):
    """A landmark in a robot's picture, with the robot's pose in the frame of the landmark's board.

    Attributes:
        at_s: Mission time of the picture.
        ahead_m: Distance from the board along the line at a right angle to it.
        left_m: Distance from that line, to the left as seen by a robot that faces the board.
        heading_rad: Heading of the robot; 0: the robot faces the board at a right angle.
        spread_m: Standard deviation of the position.
    """

    at_s: Instant
    robot: Mention
    ahead_m: Meters
    left_m: Meters
    heading_rad: Radians
    spread_m: Extent = 0.05


class ShapeKind(StrEnum):
    """Kinds of shapes on a floor plan."""

    FURNITURE = "furniture"
    WALL = "wall"
    RAMP = "ramp"
    DARK = "dark"
    LANDMARK = "landmark"


class FloorShape(Message, frozen=True):
    """A rectangle on the floor.

    Attributes:
        kind: Kind of object.
        x_m: Middle.
        y_m: Middle.
        width_m: Along its own x axis.
        depth_m: Along its own y axis.
        heading_rad: Of its own x axis.
    """

    name: Mention
    kind: ShapeKind
    x_m: Meters
    y_m: Meters
    width_m: Extent
    depth_m: Extent
    heading_rad: Radians = 0.0


class AskFloorPlan(Message, frozen=True):
    """Ask a localizer for the plan of the floor."""


class FloorPlan(Message, frozen=True):
    """Answer to ``AskFloorPlan``.

    Attributes:
        width_m: Of the room, along x.
        depth_m: Of the room, along y.
        shapes: Objects on the floor.
        image: A picture of the plan, PNG or JPEG, that covers the whole room; empty: none.
    """

    width_m: Extent
    depth_m: Extent
    shapes: Annotated[list[FloorShape], MANY] = []
    image: Annotated[bytes, msgspec.Meta(max_length=900_000)] = b""  # chosen: a drawing of 4000 x 4000 pixels
