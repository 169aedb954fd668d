"""From a world's description to one MuJoCo model of room, furniture, Scouts and targets.

Names in the model: ``<scout>/<part>`` for the parts of ``scout.xml``; ``<target>`` for a target's
body, and ``<target>/left_leg`` and ``<target>/right_leg`` for a person's legs.
"""

from __future__ import annotations

import math
from collections import Counter
from importlib import resources
from typing import Any

import mujoco
import numpy as np

from scout_model.description import Furniture, ScoutPlace, Target, WorldDescription
from scout_model.dimensions import (
    PERSON_HEIGHT_M,
    PERSON_HIP_M,
    PIONEER_HEIGHT_M,
    PIONEER_RADIUS_M,
    WALL_HEIGHT_M,
)
from scout_model.errors import InvalidWorld
from scout_model.radio_link import FIRST_NETWORK_ID, LAST_NETWORK_ID
from scout_model.targets import SHAPES, part_poses, path_length_m

_WALL_THICKNESS_M = 0.1  # chosen: a Scout in flight does not pass through within one step
_MARK_THICKNESS_M = 0.002  # chosen: enough to keep mark and surface apart in the depth buffer across the room
_MARKS, _THINGS = 1, 2  # geom groups, see room.xml


def compose(description: WorldDescription) -> str:
    """Return the world as MJCF; the same description always gives the same text.

    Raises:
        InvalidWorld: A name or network id is used twice, a number makes no sense, or a Scout stands outside.
    """
    check(description)
    spec = mujoco.MjSpec.from_string(_asset("room.xml"))
    _add_walls(spec, description)
    _add_marks(spec, description)
    for furniture in description.furniture:
        _add_furniture(spec, furniture)
    for place in description.scouts:
        _add_scout(spec, place)
    for target in description.targets:
        _add_target(spec, target)
    spec.compile()
    return str(spec.to_xml())


def check(description: WorldDescription) -> None:
    """Return if the world can be built.

    Raises:
        InvalidWorld: It cannot; the first reason.
    """
    width_m, depth_m = description.width_m, description.depth_m
    if not (0 < width_m < math.inf and 0 < depth_m < math.inf):
        raise InvalidWorld(f"a room of {width_m} by {depth_m} m")
    parts: list[Furniture | ScoutPlace | Target] = [*description.furniture, *description.scouts, *description.targets]
    names = Counter(part.name for part in parts)
    for name, uses in names.items():
        if uses > 1 or not name or "/" in name:
            raise InvalidWorld(f"name {name!r} is empty, has a '/', or is used {uses} times")
    ids = Counter(place.network_id for place in description.scouts)
    for network_id, uses in ids.items():
        if uses > 1 or not FIRST_NETWORK_ID <= network_id <= LAST_NETWORK_ID:
            raise InvalidWorld(
                f"network id {network_id} is used {uses} times or outside {FIRST_NETWORK_ID} to {LAST_NETWORK_ID}"
            )
    for place in description.scouts:
        if not (0 < place.x_m < width_m and 0 < place.y_m < depth_m and math.isfinite(place.heading_rad)):
            raise InvalidWorld(f"{place.name} at ({place.x_m}, {place.y_m}) m is not in the room")
    for furniture in description.furniture:
        sizes_m = (furniture.width_m, furniture.depth_m, furniture.height_m)
        if not all(0 < size_m < math.inf for size_m in sizes_m) or not _finite(furniture.x_m, furniture.y_m):
            raise InvalidWorld(f"{furniture.name} has impossible sizes {sizes_m} m")
    for target in description.targets:
        _check_target(target)


def _check_target(target: Target) -> None:
    if target.shape not in SHAPES:
        raise InvalidWorld(f"{target.name}: shape {target.shape!r} is none of {', '.join(SHAPES)}")
    if not all(_finite(*point) for point in target.path) or not 0 < path_length_m(target.path) < math.inf:
        raise InvalidWorld(f"{target.name}: its path {target.path} leads nowhere")
    if not 0 < target.speed_m_s < math.inf or not 0 <= target.rest_s < math.inf or not math.isfinite(target.begin_s):
        raise InvalidWorld(
            f"{target.name}: speed {target.speed_m_s} m/s, rest {target.rest_s} s, begin {target.begin_s} s"
        )


def _finite(*values: float) -> bool:
    return all(math.isfinite(value) for value in values)


def _asset(name: str) -> str:
    return resources.files("scout_model").joinpath(name).read_text(encoding="utf-8")


def _grey(level: float) -> list[float]:
    return [level, level, level, 1.0]


def _box(parent: Any, name: str, centre_m: list[float], size_m: list[float], level: float, group: int) -> None:
    """Add a box that is seen and, unless it is a mark, touched; ``size_m`` is its full extent."""
    is_solid = group != _MARKS
    parent.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=centre_m,
        size=[extent_m / 2 for extent_m in size_m],
        rgba=_grey(level),
        group=group,
        contype=int(is_solid),
        conaffinity=int(is_solid),
    )


def _cylinder(parent: Any, name: str, radius_m: float, bottom_m: float, top_m: float, level: float, group: int) -> None:
    is_solid = group != _MARKS
    parent.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=[0.0, 0.0, (bottom_m + top_m) / 2],
        size=[radius_m, (top_m - bottom_m) / 2, 0.0],
        rgba=_grey(level),
        group=group,
        contype=int(is_solid),
        conaffinity=int(is_solid),
    )


def _add_walls(spec: Any, description: WorldDescription) -> None:
    width_m, depth_m = description.width_m, description.depth_m
    half_m, height_m = _WALL_THICKNESS_M / 2, WALL_HEIGHT_M
    world = spec.worldbody
    along_x, along_y = [width_m, _WALL_THICKNESS_M, height_m], [_WALL_THICKNESS_M, depth_m, height_m]
    _box(world, "wall_south", [width_m / 2, -half_m, height_m / 2], along_x, 0.74, 0)
    _box(world, "wall_north", [width_m / 2, depth_m + half_m, height_m / 2], along_x, 0.74, 0)
    _box(world, "wall_west", [-half_m, depth_m / 2, height_m / 2], along_y, 0.70, 0)
    _box(world, "wall_east", [width_m + half_m, depth_m / 2, height_m / 2], along_y, 0.78, 0)


def _add_marks(spec: Any, description: WorldDescription) -> None:
    """Put lines on the floor, and skirting boards and posters on the walls, so that a picture shows motion."""
    width_m, depth_m = description.width_m, description.depth_m
    rng = np.random.default_rng(description.seed)
    world = spec.worldbody
    thin_m, skirting_m = _MARK_THICKNESS_M, 0.10
    for number in range(1, math.ceil(depth_m)):
        _box(world, f"line_{number}", [width_m / 2, number - 0.5, 0.0], [width_m, 0.06, thin_m], 0.30, _MARKS)
    for side, y_m in (("south", 0.0), ("north", depth_m)):
        _box(world, f"skirting_{side}", [width_m / 2, y_m, skirting_m / 2], [width_m, thin_m, skirting_m], 0.22, _MARKS)
        for number in range(math.floor(width_m / 1.5)):
            size_m = rng.uniform([0.4, 0.5], [0.8, 0.9])
            centre_m = [1.5 * number + 0.75 + float(rng.uniform(-0.2, 0.2)), y_m, 0.25 + float(size_m[1]) / 2]
            level = float(rng.choice([0.15, 0.3, 0.5, 0.95]))
            _box(
                world, f"poster_{side}_{number}", centre_m, [float(size_m[0]), thin_m, float(size_m[1])], level, _MARKS
            )
    for side, x_m in (("west", 0.0), ("east", width_m)):
        _box(world, f"skirting_{side}", [x_m, depth_m / 2, skirting_m / 2], [thin_m, depth_m, skirting_m], 0.22, _MARKS)
        for number in range(math.floor(depth_m / 1.5)):
            size_m = rng.uniform([0.4, 0.5], [0.8, 0.9])
            centre_m = [x_m, 1.5 * number + 0.75 + float(rng.uniform(-0.2, 0.2)), 0.25 + float(size_m[1]) / 2]
            level = float(rng.choice([0.15, 0.3, 0.5, 0.95]))
            _box(
                world, f"poster_{side}_{number}", centre_m, [thin_m, float(size_m[0]), float(size_m[1])], level, _MARKS
            )


def _add_furniture(spec: Any, furniture: Furniture) -> None:
    _box(
        spec.worldbody,
        furniture.name,
        [furniture.x_m, furniture.y_m, furniture.height_m / 2],
        [furniture.width_m, furniture.depth_m, furniture.height_m],
        0.56,
        _THINGS,
    )


def _add_scout(spec: Any, place: ScoutPlace) -> None:
    half_rad = place.heading_rad / 2
    frame = spec.worldbody.add_frame(
        pos=[place.x_m, place.y_m, 0.0], quat=[math.cos(half_rad), 0.0, 0.0, math.sin(half_rad)]
    )
    spec.attach(mujoco.MjSpec.from_string(_asset("scout.xml")), prefix=f"{place.name}/", frame=frame)


def _add_target(spec: Any, target: Target) -> None:
    # A mocap body must hang on the world, so each swinging leg of a person is a body of its own.
    body, *legs = (
        spec.worldbody.add_body(name=part.body, mocap=True, pos=part.position_m, quat=part.quaternion)
        for part in part_poses(target, 0.0)
    )
    if target.shape == "pioneer":
        _cylinder(body, f"{target.name}/hull", PIONEER_RADIUS_M, 0.03, 0.20, 0.20, _THINGS)
        _cylinder(body, f"{target.name}/deck", PIONEER_RADIUS_M * 0.9, 0.20, PIONEER_HEIGHT_M, 0.06, _THINGS)
        _cylinder(body, f"{target.name}/sonars", PIONEER_RADIUS_M * 1.005, 0.14, 0.17, 0.95, _MARKS)
        return
    _shape_person(body, legs, target.name)


def _shape_person(body: Any, legs: list[Any], name: str) -> None:
    head_m, shoulder_m = 0.11, PERSON_HEIGHT_M - 0.28
    body.add_geom(
        name=f"{name}/torso",
        type=mujoco.mjtGeom.mjGEOM_CYLINDER,
        pos=[0.0, 0.0, (PERSON_HIP_M + shoulder_m) / 2],
        size=[0.16, (shoulder_m - PERSON_HIP_M) / 2, 0.0],
        rgba=_grey(0.35),
        group=_THINGS,
    )
    body.add_geom(
        name=f"{name}/head",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=[0.0, 0.0, PERSON_HEIGHT_M - head_m],
        size=[head_m, 0.0, 0.0],
        rgba=_grey(0.80),
        group=_THINGS,
    )
    for limb in legs:
        limb.add_geom(
            name=limb.name,
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            pos=[0.0, 0.0, -0.45 * PERSON_HIP_M],
            size=[0.075, 0.45 * PERSON_HIP_M, 0.0],
            rgba=_grey(0.10),
            group=_THINGS,
        )
        limb.add_geom(
            name=f"{limb.name}/shoe",
            type=mujoco.mjtGeom.mjGEOM_BOX,
            pos=[0.06, 0.0, -0.95 * PERSON_HIP_M],
            size=[0.14, 0.05, 0.03],
            rgba=_grey(0.9),
            group=_THINGS,
        )
