"""What has to fit together in the simulated world of a mission file."""

from __future__ import annotations

from backbone.mission.document import Element
from backbone.mission.report import Report, told
from backbone.mission.tables import (
    NETWORK_ID,
    SIMULATED,
    WORLD,
    Tables,
    check_host,
    check_parameters,
    check_unique,
    is_known,
)
from backbone.naming import Subsystem, is_legal

PAIRS_AT_MOST = 1_000_000  # chosen: half a second; a thousand robots among a thousand tables


def check_world(tables: Tables, report: Report) -> None:
    """Report what does not fit in the world, and robots that are only in it or only among the resources."""
    world = tables.world
    if world is None:
        return
    _check_type(world, tables, report)
    check_host(world, tables, report)
    check_parameters(world, (WORLD,), report)
    bodies = [child for child in world.children if child.tag in ("furniture", "scout", "target")]
    check_unique(bodies, "name", "body", report)
    _check_robots(world, tables, report)
    room = world.first("room")
    width_m, depth_m = (None, None) if room is None else (room.number("width-m"), room.number("depth-m"))
    if width_m is not None and depth_m is not None and width_m > 0 and depth_m > 0:
        for body in bodies:
            for place in body.all("point") if body.tag == "target" else [body]:
                _check_inside(place, body, width_m, depth_m, report)
    _check_not_in_boxes(world.all("scout"), world.all("furniture"), report)
    for target in world.all("target"):
        _check_path(target, report)


def _check_type(world: Element, tables: Tables, report: Report) -> None:
    name = world.text("type")
    if not tables.types or not is_known(world, "type", "component type", tables.types, report):
        return
    if not tables.belongs_to(name, Subsystem.RESOURCE_POOL) or tables.needs(name):
        report.fault(
            world.place_of("type"),
            f"type {name} plays no world",
            "Name a type of subsystem resource_pool without <needs>",
        )
    elif tables.resources_of(name):
        report.fault(
            world.place_of("type"),
            f"type {name} is that of resource {tables.resources_of(name)[0].text('name')} too",
            "Name the type that plays the world",
        )


def _check_robots(world: Element, tables: Tables, report: Report) -> None:
    robots = {robot.text("name"): robot for robot in tables.robots()}
    bodies = {scout.text("name") for scout in world.all("scout")}
    for scout in world.all("scout"):
        name = scout.text("name")
        if not is_known(scout, "name", "resource", sorted(tables.resources), report):
            continue
        if name not in robots:
            report.fault(
                scout.place_of("name"),
                f"resource {name} has no network id, so it is no robot and has no body",
                f'Name a robot, or add <parameter name="{NETWORK_ID}" value="…"/> to the resource',
            )
        elif tables.resources[name].text("driver") != SIMULATED:
            report.fault(
                scout.place_of("name"),
                f"resource {name} is real (driver {tables.resources[name].text('driver')}), but has a simulated body",
                'Remove the body, or write driver="simulated"',
            )
    for name, robot in robots.items():
        if robot.text("driver") == SIMULATED and name not in bodies and is_legal(name):
            report.fault(
                robot.place_of("name"),
                f"simulated robot {told(name)} has no body in the world"
                f"{report.hint(name, sorted(bodies - tables.resources.keys()))}",
                f'Add <scout name="{name}" x-m="…" y-m="…"/> to <world>',
            )


def _check_inside(place: Element, body: Element, width_m: float, depth_m: float, report: Report) -> None:
    for along, attribute, extent, room_m in (("x", "x-m", "width-m", width_m), ("y", "y-m", "depth-m", depth_m)):
        middle_m = place.number(attribute)
        half_m = (place.number(extent) or 0.0) / 2 if place.tag == "furniture" else 0.0
        if middle_m is None or half_m <= middle_m <= room_m - half_m:
            continue
        reach = f"from {middle_m - half_m:g} to {middle_m + half_m:g}" if half_m else f"at {middle_m:g}"
        report.fault(
            place.place_of(attribute),
            f"{body.tag} {body.text('name')} is outside the room: {along} {reach} m",
            f"The room goes from 0 to {room_m:g} m along {along}",
        )


def _check_not_in_boxes(scouts: list[Element], boxes: list[Element], report: Report) -> None:
    if len(scouts) * len(boxes) > PAIRS_AT_MOST:
        return
    extents = [(box, [box.number(name) for name in ("x-m", "y-m", "width-m", "depth-m")]) for box in boxes]
    for scout in scouts:
        x_m, y_m = scout.number("x-m"), scout.number("y-m")
        for box, (box_x_m, box_y_m, width_m, depth_m) in extents:
            if _is_within(x_m, box_x_m, width_m) and _is_within(y_m, box_y_m, depth_m):
                report.fault(
                    scout.place, f"scout {scout.text('name')} stands inside {box.text('name')}", "Move one of them"
                )


def _is_within(point_m: float | None, middle_m: float | None, extent_m: float | None) -> bool:
    """Say whether a point is between the ends of an extent; never where one of them is missing."""
    if point_m is None or middle_m is None or extent_m is None:
        return False
    return abs(point_m - middle_m) < extent_m / 2


def _check_path(target: Element, report: Report) -> None:
    points = [(point.number("x-m"), point.number("y-m")) for point in target.all("point")]
    if len(points) > 1 and len(set(points)) == 1 and None not in points[0]:
        report.fault(
            target.place,
            f"all way points of {target.text('name')} are the same",
            "Give it a way to go, or make it furniture",
        )
