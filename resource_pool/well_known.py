"""Camera pictures, robots' poses and the floor plan in Foxglove's well-known schemas. Pure.

Imported only where Foxglove's SDK is installed, by the entry point of ``backbone.foxglove.well_known``.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

from foxglove.messages import (
    ArrowPrimitive,
    Color,
    CubePrimitive,
    FrameTransform,
    Quaternion,
    RawImage,
    SceneEntity,
    SceneUpdate,
    TextPrimitive,
    Vector3,
)
from foxglove.messages import Pose as Placed

from backbone.foxglove.well_known import Translations, WellKnown, moment
from resource_pool.localization import FloorPlan, FloorShape, Pose, ShapeKind
from resource_pool.messages import Frame

ROOM = "room"
"""The frame of reference of all poses."""
ARROW_M = 0.11  # RAM 2002, "Robots for Surveillance and Reconnaissance": a Scout is 110 mm long
LABEL_PX = 14.0  # chosen: as other labels of the 3D panel
FLAT_M = 0.01  # chosen: a plan has no heights, so nothing hides a robot
ROBOT = Color(r=0.1, g=0.5, b=0.9, a=1.0)
LABEL = Color(r=0.9, g=0.9, b=0.9, a=1.0)
FLOOR = Color(r=0.3, g=0.3, b=0.3, a=0.5)
SHAPES = {
    ShapeKind.FURNITURE: Color(r=0.6, g=0.45, b=0.3, a=1.0),
    ShapeKind.WALL: Color(r=0.7, g=0.7, b=0.7, a=1.0),
    ShapeKind.RAMP: Color(r=0.5, g=0.6, b=0.5, a=1.0),
    ShapeKind.DARK: Color(r=0.05, g=0.05, b=0.05, a=1.0),
    ShapeKind.LANDMARK: Color(r=0.9, g=0.7, b=0.1, a=1.0),
}


def picture(frame: Frame) -> Iterator[WellKnown]:
    """Yield the picture, pixel for pixel, on the topic of the robot's camera."""
    image = RawImage(
        timestamp=moment(frame.captured_s),
        frame_id=frame.robot,
        width=frame.width_px,
        height=frame.height_px,
        encoding="mono8",
        step=frame.width_px,
        data=bytes(frame.pixels),
    )
    yield WellKnown(f"/robots/{frame.robot}/camera", image, is_all=True)


def place(pose: Pose) -> Iterator[WellKnown]:
    """Yield the body's coordinate frame in the room, and an arrow with its name."""
    at, where, turned = moment(pose.at_s), Vector3(x=pose.x_m, y=pose.y_m), _turned(pose.heading_rad)
    transform = FrameTransform(
        timestamp=at, parent_frame_id=ROOM, child_frame_id=pose.body, translation=where, rotation=turned
    )
    placed = Placed(position=where, orientation=turned)
    arrow = ArrowPrimitive(
        pose=placed,
        shaft_length=ARROW_M * 0.6,
        shaft_diameter=ARROW_M * 0.4,
        head_length=ARROW_M * 0.4,
        head_diameter=ARROW_M * 0.8,
        color=ROBOT,
    )
    label = TextPrimitive(
        pose=placed, billboard=True, font_size=LABEL_PX, scale_invariant=True, color=LABEL, text=pose.body
    )
    entity = SceneEntity(timestamp=at, frame_id=ROOM, id=pose.body, arrows=[arrow], texts=[label])
    yield WellKnown(f"/robots/{pose.body}/pose", transform)
    yield WellKnown(f"/robots/{pose.body}/mark", SceneUpdate(entities=[entity]))


def floor(plan: FloorPlan) -> Iterator[WellKnown]:
    """Yield the floor plan with its shapes; it is shown until another plan arrives."""
    ground = CubePrimitive(
        pose=Placed(position=Vector3(x=plan.width_m / 2, y=plan.depth_m / 2, z=-FLAT_M), orientation=_turned(0.0)),
        size=Vector3(x=plan.width_m, y=plan.depth_m, z=FLAT_M),
        color=FLOOR,
    )
    entity = SceneEntity(frame_id=ROOM, id="floor", cubes=[ground, *map(_standing, plan.shapes)])
    yield WellKnown("/floor", SceneUpdate(entities=[entity]))


def _standing(shape: FloorShape) -> CubePrimitive:
    return CubePrimitive(
        pose=Placed(position=Vector3(x=shape.x_m, y=shape.y_m), orientation=_turned(shape.heading_rad)),
        size=Vector3(x=shape.width_m, y=shape.depth_m, z=FLAT_M),
        color=SHAPES[shape.kind],
    )


def _turned(heading_rad: float) -> Quaternion:
    return Quaternion(z=math.sin(heading_rad / 2), w=math.cos(heading_rad / 2))


TRANSLATIONS: Translations = {Frame: picture, Pose: place, FloorPlan: floor}
