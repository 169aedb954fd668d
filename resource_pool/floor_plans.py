"""Floor plans: the plan of a described room, and the robot's pose that follows from a sighting of a landmark.

Rules of this file: no bus, no clock, no physics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from resource_pool.dead_reckoning import Belief, FloorPose
from resource_pool.localization import FloorPlan, FloorShape, LandmarkSighting, ShapeKind
from scout_model.description import WorldDescription
from scout_model.dimensions import BOARD_THICKNESS_M, BOARD_WIDTH_M

TWICE_AS_NEAR = 2.0  # chosen: boards look alike; the nearest is taken if the next would move the belief twice as far


def plan_of(room: WorldDescription) -> FloorPlan:
    """Return the plan of a room: furniture, ramps, dark places and landmarks, but no moving bodies."""
    blocks = [(ShapeKind.FURNITURE, one) for one in room.furniture] + [
        (ShapeKind.DARK, one) for one in room.dark_places
    ]
    return FloorPlan(
        room.width_m,
        room.depth_m,
        [
            *(FloorShape(one.name, kind, one.x_m, one.y_m, one.width_m, one.depth_m) for kind, one in blocks),
            *(
                FloorShape(one.name, ShapeKind.RAMP, one.x_m, one.y_m, one.length_m, one.width_m, one.heading_rad)
                for one in room.ramps
            ),
            *(board(one.name, FloorPose(one.x_m, one.y_m, one.heading_rad)) for one in room.landmarks),
        ],
    )


def board(name: str, at: FloorPose) -> FloorShape:
    """Return the shape of a landmark's board; the board faces along the heading."""
    return FloorShape(
        name, ShapeKind.LANDMARK, at.x_m, at.y_m, BOARD_THICKNESS_M, BOARD_WIDTH_M, heading_rad=at.heading_rad
    )


def before_board(at: FloorPose, sighting: LandmarkSighting) -> FloorPose:
    """Return the robot's pose in the room, if it sees this board."""
    ahead_x, ahead_y = math.cos(at.heading_rad), math.sin(at.heading_rad)
    return FloorPose(
        at.x_m + sighting.ahead_m * ahead_x + sighting.left_m * ahead_y,
        at.y_m + sighting.ahead_m * ahead_y - sighting.left_m * ahead_x,
        at.heading_rad + math.pi + sighting.heading_rad,
    )


def sighted_from(plan: FloorPlan, sighting: LandmarkSighting, belief: Belief) -> FloorPose | None:
    """Return the pose of a robot that sees some landmark of the plan; boards look alike.

    Returns:
        The candidate pose nearest to the belief. None if the plan has no landmark, or if the second nearest candidate
        is less than twice as far away and the belief is too uncertain to exclude it.
    """
    boards = (FloorPose(one.x_m, one.y_m, one.heading_rad) for one in plan.shapes if one.kind is ShapeKind.LANDMARK)
    poses: Sequence[FloorPose] = sorted(
        (before_board(at, sighting) for at in boards), key=lambda pose: pose.distance_m(belief.pose)
    )
    if not poses:
        return None
    nearest_m, next_m = (
        poses[0].distance_m(belief.pose),
        poses[1].distance_m(belief.pose) if len(poses) > 1 else math.inf,
    )
    is_plain = next_m > TWICE_AS_NEAR * max(nearest_m, belief.spread_m)
    return poses[0] if is_plain else None
