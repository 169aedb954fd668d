"""Floor plans: the plan of a described room, its landmarks, and where a sighting of one puts a robot.

Rules of this file: no bus, no clock, no physics.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

from resource_pool.dead_reckoning import Belief, FloorPose
from resource_pool.localization import FloorPlan, FloorShape, LandmarkSighting, ShapeKind
from scout_model.description import WorldDescription
from scout_model.dimensions import BOARD_THICKNESS_M, BOARD_WIDTH_M

TWICE_AS_NEAR = 2.0  # chosen: boards look alike; one is meant if the next would move the belief twice as far


def plan_of(room: WorldDescription) -> FloorPlan:
    """Return the plan of a room: furniture, ramps, dark places, landmarks, without what moves."""
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
    """Return the shape of a landmark's board, which faces along its heading."""
    return FloorShape(
        name, ShapeKind.LANDMARK, at.x_m, at.y_m, BOARD_THICKNESS_M, BOARD_WIDTH_M, heading_rad=at.heading_rad
    )


def before_board(at: FloorPose, sighting: LandmarkSighting) -> FloorPose:
    """Return the robot's pose in the room, if the board that it sees is this one."""
    ahead_x, ahead_y = math.cos(at.heading_rad), math.sin(at.heading_rad)
    return FloorPose(
        at.x_m + sighting.ahead_m * ahead_x + sighting.left_m * ahead_y,
        at.y_m + sighting.ahead_m * ahead_y - sighting.left_m * ahead_x,
        at.heading_rad + math.pi + sighting.heading_rad,
    )


def sighted_from(plan: FloorPlan, sighting: LandmarkSighting, belief: Belief) -> FloorPose | None:
    """Return where the robot stands that sees a landmark of the plan; boards look alike.

    Returns:
        The pose nearest to the belief; None if there is no landmark, or the second nearest is less than twice as far
        away and the belief is no surer than that.
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
