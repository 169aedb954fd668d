"""Composes one MuJoCo model of room, furniture, robots and targets from a world's description.

Names in the model: ``<robot>/<part>`` for the parts of a robot's own MJCF; ``<target>`` for a target's
body, and ``<target>/left_leg`` and ``<target>/right_leg`` for a person's legs; ``dark/<name>`` for the sites that mark
dark places for cameras.
"""

from __future__ import annotations

import copy
import functools
import math
from collections.abc import Mapping
from importlib import resources

import msgspec
import mujoco
from numpy.random import default_rng  # here, so that a zygote has it: numpy imports it at its first use

from scout_model.description import (
    AirDescription,
    DarkPlace,
    Furniture,
    Landmark,
    Ramp,
    RobotPlace,
    Target,
    WorldDescription,
)
from scout_model.description_checks import check
from scout_model.dimensions import (
    BLOB_DIAMETER_M,
    BLOBS_M,
    BOARD_HEIGHT_M,
    BOARD_THICKNESS_M,
    BOARD_WIDTH_M,
    CARRIER_DECK_M,
    CARRIER_LENGTH_M,
    CARRIER_WIDTH_M,
    DARKNESS,
    PERSON_HEIGHT_M,
    PERSON_HIP_M,
    PIONEER_HEIGHT_M,
    PIONEER_RADIUS_M,
    TABLE_LEG_M,
    TABLE_TOP_M,
    WALL_HEIGHT_M,
)
from scout_model.errors import InvalidWorld
from scout_model.robot import robot_class
from scout_model.room_file import add_room
from scout_model.targets import CARRIER, part_poses

_MODELS_KEPT = 2  # chosen: one experiment or two by turns; some 100 kB each
_TEXTS_KEPT = 4  # chosen: one experiment or a few by turns; some ten kilobytes each
_WALL_THICKNESS_M = 0.1  # chosen: a Scout in flight does not pass through within one step
_MARK_THICKNESS_M = 0.002  # chosen: enough to keep mark and surface apart in the depth buffer across the room
_SHADE_THICKNESS_M = 0.004  # chosen: the height above a mark equals the mark's height above its surface
_FLOOR_LEVEL = 0.45  # as in room.xml
_AT_A_WALL_M = 0.05  # chosen: a dark place that ends this close to a wall darkens the wall
_MARKS, _THINGS = 1, 2  # geom groups, see room.xml
_BOX, _CYLINDER, _SPHERE = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_CYLINDER, mujoco.mjtGeom.mjGEOM_SPHERE


_composed: dict[str, str] = {}
"""Description and bodies → MJCF, of the last few worlds."""


def compose(description: WorldDescription) -> str:
    """Return the world as MJCF; the same description always gives the same text.

    Raises:
        InvalidWorld: A name or network id is used twice, a number is out of range, or a Scout stands outside the room.
    """
    check(description)
    # The model shows neither the air nor when a target departs after the beginning.
    targets = [msgspec.structs.replace(target, begin_s=min(0.0, target.begin_s)) for target in description.targets]
    shown = msgspec.structs.replace(description, targets=targets, air=AirDescription())
    bodies = {place.kind: _body_mjcf(place) for place in description.robots}
    key = repr((shown, bodies))
    text = _composed.get(key)
    if text is None:
        text = _composed[key] = _compose(shown, bodies)
        if len(_composed) > _TEXTS_KEPT:
            _composed.pop(next(iter(_composed)), None)
    return text


def _compose(description: WorldDescription, bodies: Mapping[str, str]) -> str:
    spec = mujoco.MjSpec.from_string(_asset("room.xml"))
    if description.mjcf:
        add_room(spec, description.mjcf)
    else:
        _add_walls(spec, description)
        _add_marks(spec, description)
    dark_places = [*description.dark_places, *_below_tables(description)]
    for dark in dark_places:
        _add_dark_place(spec, dark, description)
    for furniture in description.furniture:
        _add_furniture(spec, furniture, dark_places)
    for ramp in description.ramps:
        _add_ramp(spec, ramp)
    for landmark in description.landmarks:
        _add_landmark(spec, landmark)
    for place in description.robots:
        _add_robot(spec, place, bodies[place.kind])
    for target in description.targets:
        _add_target(spec, target)
    try:
        spec.compile()
        text = str(spec.to_xml())
        _compiled(text)  # the text has fewer digits than the composed model
    except ValueError as error:
        raise InvalidWorld(f"MuJoCo cannot build it: {error}") from error
    return text


def model_of(mjcf: str) -> mujoco.MjModel:
    """Return MuJoCo's model of this text, which is the caller's own."""
    return copy.copy(_compiled(mjcf))


@functools.lru_cache(maxsize=_MODELS_KEPT)
def _compiled(mjcf: str) -> mujoco.MjModel:
    return mujoco.MjModel.from_xml_string(mjcf)


def _asset(name: str) -> str:
    return resources.files("scout_model").joinpath(name).read_text(encoding="utf-8")


def _grey(level: float) -> list[float]:
    return [level, level, level, 1.0]


def _part(
    parent: mujoco.MjsBody,
    name: str,
    shape: mujoco.mjtGeom,
    centre_m: list[float],
    size_m: list[float],
    level: float,
    group: int = _THINGS,
    **more: list[float],
) -> None:
    """Add a visible part; unless it is a mark, bodies collide with it. The size follows MuJoCo's convention."""
    solid = int(group != _MARKS)
    parent.add_geom(
        name=name,
        type=shape,
        pos=centre_m,
        size=size_m,
        rgba=_grey(level),
        group=group,
        contype=solid,
        conaffinity=solid,
        **more,
    )


def _box(
    parent: mujoco.MjsBody, name: str, centre_m: list[float], size_m: list[float], level: float, group: int
) -> None:
    """Add a box; ``size_m`` is its full extent."""
    _part(parent, name, _BOX, centre_m, [extent_m / 2 for extent_m in size_m], level, group)


def _cylinder(
    parent: mujoco.MjsBody, name: str, radius_m: float, bottom_m: float, top_m: float, level: float, group: int
) -> None:
    centre_m, half_m = [0.0, 0.0, (bottom_m + top_m) / 2], (top_m - bottom_m) / 2
    _part(parent, name, _CYLINDER, centre_m, [radius_m, half_m, 0.0], level, group)


def _add_walls(spec: mujoco.MjSpec, description: WorldDescription) -> None:
    width_m, depth_m = description.width_m, description.depth_m
    half_m, height_m = _WALL_THICKNESS_M / 2, WALL_HEIGHT_M
    world = spec.worldbody
    along_x, along_y = [width_m, _WALL_THICKNESS_M, height_m], [_WALL_THICKNESS_M, depth_m, height_m]
    _box(world, "wall_south", [width_m / 2, -half_m, height_m / 2], along_x, 0.74, 0)
    _box(world, "wall_north", [width_m / 2, depth_m + half_m, height_m / 2], along_x, 0.74, 0)
    _box(world, "wall_west", [-half_m, depth_m / 2, height_m / 2], along_y, 0.70, 0)
    _box(world, "wall_east", [width_m + half_m, depth_m / 2, height_m / 2], along_y, 0.78, 0)


def _add_marks(spec: mujoco.MjSpec, description: WorldDescription) -> None:
    """Put lines on the floor, and skirting boards and posters on the walls, so that motion is visible in a picture."""
    width_m, depth_m = description.width_m, description.depth_m
    rng = default_rng(description.seed)
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


def _below_tables(description: WorldDescription) -> list[DarkPlace]:
    return [
        DarkPlace(table.name, table.x_m, table.y_m, table.width_m, table.depth_m, table.height_m - TABLE_TOP_M)
        for table in description.furniture
        if table.shape == "table"
    ]


def _add_dark_place(spec: mujoco.MjSpec, dark: DarkPlace, description: WorldDescription) -> None:
    """Darken floor and walls, and add a site by which cameras darken bodies in this place."""
    world = spec.worldbody
    size_m = [dark.width_m, dark.depth_m, dark.height_m]
    world.add_site(
        name=f"dark/{dark.name}",
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=[dark.x_m, dark.y_m, dark.height_m / 2],
        size=[extent_m / 2 for extent_m in size_m],
        group=5,
    )
    thin_m, level = _SHADE_THICKNESS_M, _FLOOR_LEVEL * DARKNESS
    _box(world, f"shade/{dark.name}", [dark.x_m, dark.y_m, 0.0], [dark.width_m, dark.depth_m, thin_m], level, _MARKS)
    if description.mjcf:
        return
    middle_m = dark.height_m / 2
    for side, wall_m, edge_m in (
        ("west", 0.0, dark.x_m - dark.width_m / 2),
        ("east", description.width_m, dark.x_m + dark.width_m / 2),
    ):
        if abs(wall_m - edge_m) <= _AT_A_WALL_M:
            size_m = [thin_m, dark.depth_m, dark.height_m]
            _box(world, f"shade/{dark.name}_{side}", [wall_m, dark.y_m, middle_m], size_m, level, _MARKS)
    for side, wall_m, edge_m in (
        ("south", 0.0, dark.y_m - dark.depth_m / 2),
        ("north", description.depth_m, dark.y_m + dark.depth_m / 2),
    ):
        if abs(wall_m - edge_m) <= _AT_A_WALL_M:
            size_m = [dark.width_m, thin_m, dark.height_m]
            _box(world, f"shade/{dark.name}_{side}", [dark.x_m, wall_m, middle_m], size_m, level, _MARKS)


def _add_furniture(spec: mujoco.MjSpec, furniture: Furniture, dark_places: list[DarkPlace]) -> None:
    """Add a box or a table. All of its parts have a ``/`` in their names, so that it may be named as a wall is."""
    world, x_m, y_m, height_m = spec.worldbody, furniture.x_m, furniture.y_m, furniture.height_m
    if furniture.shape == "box":
        is_dark = any(_is_in(furniture, dark) for dark in dark_places)
        size_m = [furniture.width_m, furniture.depth_m, height_m]
        level = 0.56 * (DARKNESS if is_dark else 1.0)
        _box(world, f"{furniture.name}/box", [x_m, y_m, height_m / 2], size_m, level, _THINGS)
        return
    under_m = height_m - TABLE_TOP_M
    top_m = [furniture.width_m, furniture.depth_m, TABLE_TOP_M]
    _box(world, f"{furniture.name}/top", [x_m, y_m, height_m - TABLE_TOP_M / 2], top_m, 0.56, _THINGS)
    # The table's underside: just below the top and a little smaller, so that it is invisible from the side.
    inset_m = TABLE_LEG_M / 2
    underside_m = [furniture.width_m - inset_m, furniture.depth_m - inset_m, _MARK_THICKNESS_M]
    _box(world, f"{furniture.name}/underside", [x_m, y_m, under_m - _MARK_THICKNESS_M], underside_m, 0.1, _THINGS)
    for number, (right, back) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        leg_x_m = x_m + right * (furniture.width_m - TABLE_LEG_M) / 2
        leg_y_m = y_m + back * (furniture.depth_m - TABLE_LEG_M) / 2
        leg_m = [TABLE_LEG_M, TABLE_LEG_M, under_m]
        _box(world, f"{furniture.name}/leg_{number}", [leg_x_m, leg_y_m, under_m / 2], leg_m, 0.3, _THINGS)


def _is_in(furniture: Furniture, dark: DarkPlace) -> bool:
    """Return whether a piece of furniture is entirely inside a dark place."""
    return (
        abs(furniture.x_m - dark.x_m) + furniture.width_m / 2 <= dark.width_m / 2
        and abs(furniture.y_m - dark.y_m) + furniture.depth_m / 2 <= dark.depth_m / 2
        and furniture.height_m <= dark.height_m
    )


def _turned(heading_rad: float) -> list[float]:
    return [math.cos(heading_rad / 2), 0.0, 0.0, math.sin(heading_rad / 2)]


def _add_ramp(spec: mujoco.MjSpec, ramp: Ramp) -> None:
    """Add a wedge. A tilted board would leave an edge at its foot, and be visible below the floor."""
    half_m, across_m, height_m = ramp.length_m / 2, ramp.width_m / 2, ramp.height_m
    corners_m = [
        (along_m, side_m, up_m)
        for along_m, up_m in ((-half_m, 0.0), (half_m, 0.0), (half_m, height_m))
        for side_m in (-across_m, across_m)
    ]
    spec.add_mesh(name=ramp.name, uservert=[number for corner_m in corners_m for number in corner_m])
    spec.worldbody.add_geom(
        name=f"{ramp.name}/slope",
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=ramp.name,
        pos=[ramp.x_m, ramp.y_m, 0.0],
        quat=_turned(ramp.heading_rad),
        rgba=_grey(0.62),
        group=_THINGS,
    )


def _add_landmark(spec: mujoco.MjSpec, landmark: Landmark) -> None:
    body = spec.worldbody.add_body(
        name=landmark.name, pos=[landmark.x_m, landmark.y_m, 0.0], quat=_turned(landmark.heading_rad)
    )
    size_m = [BOARD_THICKNESS_M, BOARD_WIDTH_M, BOARD_HEIGHT_M]
    _box(body, f"{landmark.name}/board", [-BOARD_THICKNESS_M / 2, 0.0, BOARD_HEIGHT_M / 2], size_m, 0.97, _THINGS)
    for number, (right_m, up_m) in enumerate(BLOBS_M):
        name, size_m = f"{landmark.name}/blob_{number}", [BLOB_DIAMETER_M / 2, _MARK_THICKNESS_M / 2, 0.0]
        facing = [math.sqrt(0.5), 0.0, math.sqrt(0.5), 0.0]
        _part(body, name, _CYLINDER, [0.0, right_m, up_m], size_m, 0.05, _MARKS, quat=facing)


def require_body(kind: str) -> None:
    """Check that MuJoCo can build one robot of this kind.

    Raises:
        InvalidWorld: There is no such kind, or its body lacks a part or cannot be built.
    """
    spec, place = mujoco.MjSpec.from_string(_asset("room.xml")), RobotPlace("robot", 1, 1.0, 1.0, 0.0, kind)
    _add_robot(spec, place, robot_class(kind).body_mjcf())
    if spec.body("robot/body") is None or spec.joint("robot/free") is None:
        raise InvalidWorld(f'the body of {kind} has no <body name="body"> with a <freejoint name="free"/>')
    try:
        mujoco.MjSpec.from_string(robot_class(kind).body_mjcf()).compile()  # attached, sensors of nothing disappear
        spec.compile()
    except ValueError as error:
        raise InvalidWorld(f"the body of {kind} cannot be built: {' '.join(str(error).split())}") from error


def _body_mjcf(place: RobotPlace) -> str:
    try:
        return robot_class(place.kind).body_mjcf()
    except ValueError as error:
        raise InvalidWorld(f"{place.name}, a {place.kind}, has no body: {error}") from error


def _add_robot(spec: mujoco.MjSpec, place: RobotPlace, body_mjcf: str) -> None:
    frame = spec.worldbody.add_frame(pos=[place.x_m, place.y_m, 0.0], quat=_turned(place.heading_rad))
    try:
        body = mujoco.MjSpec.from_string(body_mjcf)
        spec.attach(body, prefix=f"{place.name}/", frame=frame)
    except ValueError as error:
        why = " ".join(str(error).split())
        raise InvalidWorld(f"the body of {place.name}, a {place.kind}, cannot be built: {why}") from error


def _add_target(spec: mujoco.MjSpec, target: Target) -> None:
    # A mocap body must be a child of the world body, so each swinging leg of a person is a body of its own.
    body, *legs = (
        spec.worldbody.add_body(name=part.body, mocap=True, pos=part.position_m, quat=part.quaternion)
        for part in part_poses(target, 0.0)
    )
    if target.shape == "pioneer":
        _cylinder(body, f"{target.name}/hull", PIONEER_RADIUS_M, 0.03, 0.20, 0.20, _THINGS)
        _cylinder(body, f"{target.name}/deck", PIONEER_RADIUS_M * 0.9, 0.20, PIONEER_HEIGHT_M, 0.06, _THINGS)
        _cylinder(body, f"{target.name}/sonars", PIONEER_RADIUS_M * 1.005, 0.14, 0.17, 0.95, _MARKS)
        return
    if target.shape == CARRIER:
        _shape_carrier(body, target.name)
        return
    _shape_person(body, legs, target.name)


def _shape_carrier(body: mujoco.MjsBody, name: str) -> None:
    length_m, width_m = CARRIER_LENGTH_M, CARRIER_WIDTH_M
    hull_m, deck_m = [length_m, width_m - 0.10, CARRIER_DECK_M - 0.08], [length_m, width_m, 0.03]
    _box(body, f"{name}/hull", [0.0, 0.0, 0.05 + hull_m[2] / 2], hull_m, 0.35, _THINGS)
    _box(body, f"{name}/deck", [0.0, 0.0, CARRIER_DECK_M - deck_m[2] / 2], deck_m, 0.70, _THINGS)
    for number, (along, across) in enumerate(((-1, -1), (1, -1), (-1, 1), (1, 1))):
        centre_m = [along * 0.19, across * (width_m / 2 - 0.025), 0.09]
        upright = [math.sqrt(0.5), math.sqrt(0.5), 0.0, 0.0]
        _part(body, f"{name}/wheel_{number}", _CYLINDER, centre_m, [0.09, 0.025, 0.0], 0.08, quat=upright)


def _shape_person(body: mujoco.MjsBody, legs: list[mujoco.MjsBody], name: str) -> None:
    head_m, shoulder_m = 0.11, PERSON_HEIGHT_M - 0.28
    _cylinder(body, f"{name}/torso", 0.16, PERSON_HIP_M, shoulder_m, 0.35, _THINGS)
    _part(body, f"{name}/head", _SPHERE, [0.0, 0.0, PERSON_HEIGHT_M - head_m], [head_m, 0.0, 0.0], 0.80)
    for limb in legs:
        _part(limb, limb.name, _CYLINDER, [0.0, 0.0, -0.45 * PERSON_HIP_M], [0.075, 0.45 * PERSON_HIP_M, 0.0], 0.10)
        _part(limb, f"{limb.name}/shoe", _BOX, [0.06, 0.0, -0.95 * PERSON_HIP_M], [0.14, 0.05, 0.03], 0.9)
