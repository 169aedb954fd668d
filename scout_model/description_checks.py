"""Checks of a world's description before its model is composed. Pure."""

from __future__ import annotations

import math
from collections import Counter

from scout_model.carrier import check_stops
from scout_model.description import DarkPlace, Furniture, Landmark, Ramp, RobotPlace, Target, WorldDescription
from scout_model.dimensions import TABLE_LEG_M, TABLE_TOP_M
from scout_model.errors import InvalidWorld
from scout_model.radio_link import FIRST_NETWORK_ID, LAST_NETWORK_ID
from scout_model.robot import robot_class
from scout_model.targets import SHAPES, path_length_m

_FURNITURE_SHAPES = ("box", "table")
_OUTERMOST = "world"  # MuJoCo's name of the body that has all others


def check(description: WorldDescription) -> None:
    """Check that the world can be built.

    Raises:
        InvalidWorld: The world cannot be built; the first reason is given.
    """
    width_m, depth_m = description.width_m, description.depth_m
    if not (0 < width_m < math.inf and 0 < depth_m < math.inf):
        raise InvalidWorld(f"a room of {width_m} by {depth_m} m")
    parts: list[Furniture | RobotPlace | Target | Ramp | Landmark | DarkPlace] = [
        *description.furniture,
        *description.robots,
        *description.targets,
        *description.ramps,
        *description.landmarks,
        *description.dark_places,
    ]
    names = Counter(part.name for part in parts)
    for name, uses in names.items():
        if uses > 1 or not name or "/" in name:
            raise InvalidWorld(f"name {name!r} is empty, has a '/', or is used {uses} times")
    if _OUTERMOST in {landmark.name for landmark in description.landmarks} | {one.name for one in description.targets}:
        raise InvalidWorld(f"no landmark or target can be named {_OUTERMOST!r}, as the whole is")
    ids = Counter(place.network_id for place in description.robots)
    for network_id, uses in ids.items():
        if uses > 1 or not FIRST_NETWORK_ID <= network_id <= LAST_NETWORK_ID:
            raise InvalidWorld(
                f"network id {network_id} is used {uses} times or outside {FIRST_NETWORK_ID} to {LAST_NETWORK_ID}"
            )
    for place in description.robots:
        if not (0 < place.x_m < width_m and 0 < place.y_m < depth_m and math.isfinite(place.heading_rad)):
            raise InvalidWorld(f"{place.name} at ({place.x_m}, {place.y_m}) m is not in the room")
        robot_class(place.kind)
        if place.battery_j is not None and not 0 < place.battery_j < math.inf:
            raise InvalidWorld(f"{place.name} with a battery of {place.battery_j} J")
    for dark in description.dark_places:
        _check_extents(dark.name, (dark.width_m, dark.depth_m, dark.height_m), dark.x_m, dark.y_m)
    for furniture in description.furniture:
        _check_shape(furniture)
    for ramp in description.ramps:
        _check_extents(ramp.name, (ramp.length_m, ramp.width_m, ramp.height_m), ramp.x_m, ramp.y_m, ramp.heading_rad)
    for landmark in description.landmarks:
        if not _finite(landmark.x_m, landmark.y_m, landmark.heading_rad):
            raise InvalidWorld(f"{landmark.name} is nowhere")
    for target in description.targets:
        _check_target(target)
    check_stops(description)


def _check_extents(name: str, sizes_m: tuple[float, ...], *place: float) -> None:
    if not all(0 < size_m < math.inf for size_m in sizes_m) or not _finite(*place):
        raise InvalidWorld(f"{name} has impossible sizes {sizes_m} m")


def _check_shape(furniture: Furniture) -> None:
    sizes_m = (furniture.width_m, furniture.depth_m, furniture.height_m)
    _check_extents(furniture.name, sizes_m, furniture.x_m, furniture.y_m)
    if furniture.shape not in _FURNITURE_SHAPES:
        raise InvalidWorld(f"{furniture.name}: shape {furniture.shape!r} is none of {', '.join(_FURNITURE_SHAPES)}")
    if furniture.shape == "table" and (
        furniture.height_m <= TABLE_TOP_M or min(furniture.width_m, furniture.depth_m) <= 2 * TABLE_LEG_M
    ):
        raise InvalidWorld(f"{furniture.name} is too small for a table")


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
