"""Consistency checks of the simulated world of a mission file."""

from __future__ import annotations

import math
from itertools import pairwise

from backbone.mission.class_paths import CLASS_PATH
from backbone.mission.document import Element
from backbone.mission.parameter_checks import check_class_parameters, check_class_path
from backbone.mission.report import Report, quoted
from backbone.mission.room_files import check_room_file
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

BODY = 'Write class="package.module:Class" of the robot\'s body, importable on this machine'
BODIES = ("furniture", "ramp", "landmark", "dark", "robot", "target")
CARRIER = "carrier"  # the shape of a target that brings robots in
NEAREST_SET_DOWN_M, FARTHEST_SET_DOWN_M = 0.45, 1.2  # equal to those in scout_model.dimensions; a test compares
CARRIER_PLACES = 6  # same
TABLE_TOP_M, TABLE_LEGS_M = 0.03, 0.10  # least size of a table: the thickness of its top, two of its legs
PAIRS_AT_MOST = 1_000_000  # chosen: half a second; a thousand robots among a thousand tables


def check_world(tables: Tables, report: Report) -> None:
    """Report faults in the world, and robots that are only in it or only among the resources."""
    world = tables.world
    if world is None:
        return
    _check_type(world, tables, report)
    check_host(world, tables, report)
    check_parameters(world, (WORLD,), report)
    check_class_parameters(world, (WORLD,), tables, report)
    bodies = [child for child in world.children if child.tag in BODIES]
    check_unique(bodies, "name", "body", report)
    _check_names(bodies, report)
    _check_robots(world, tables, report)
    _check_classes(world, tables, report)
    room = world.first("room")
    if room is not None:
        check_room_file(room, report)
    width_m, depth_m = (None, None) if room is None else (room.number("width-m"), room.number("depth-m"))
    if width_m is not None and depth_m is not None and width_m > 0 and depth_m > 0:
        for body in bodies:
            for place in body.all("point") if body.tag == "target" else [body]:
                _check_inside(place, body, width_m, depth_m, report)
    boxes = [box for box in world.all("furniture") if box.text("shape") != "table"]
    _check_not_inside(world.all("robot"), boxes, "width-m", "depth-m", report)
    _check_tables(world, report)
    _check_not_inside(world.all("robot"), world.all("ramp"), "length-m", "width-m", report)
    _check_carried(world, report)
    for target in world.all("target"):
        _check_path(target, report)


def _check_type(world: Element, tables: Tables, report: Report) -> None:
    name = world.text("type")
    if not is_known(world, "type", "component type", tables.types, report):
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


def _check_names(bodies: list[Element], report: Report) -> None:
    for body in bodies:
        if body.tag in ("landmark", "target") and body.text("name") == WORLD:
            report.fault(
                body.place_of("name"), f"no {body.tag} can be named {WORLD}, as the whole is", "Give it another name"
            )


def _check_robots(world: Element, tables: Tables, report: Report) -> None:
    robots = {robot.text("name"): robot for robot in tables.robots()}
    bodies = {robot.text("name") for robot in world.all("robot")}
    for robot in world.all("robot"):
        name = robot.text("name")
        if not is_known(robot, "name", "resource", sorted(tables.resources), report):
            continue
        if name not in robots:
            report.fault(
                robot.place_of("name"),
                f"resource {name} has no network id, so it is no robot and has no body",
                f'Name a robot, or add <parameter name="{NETWORK_ID}" value="…"/> to the resource',
            )
        elif tables.resources[name].text("driver") != SIMULATED:
            report.fault(
                robot.place_of("name"),
                f"resource {name} is real (driver {tables.resources[name].text('driver')}), but has a simulated body",
                'Remove the body, or write driver="simulated"',
            )
    for name, robot in robots.items():
        if robot.text("driver") == SIMULATED and name not in bodies and is_legal(name):
            report.fault(
                robot.place_of("name"),
                f"simulated robot {quoted(name)} has no body in the world"
                f"{report.hint(name, sorted(bodies - tables.resources.keys()))}",
                f'Add <robot name="{name}" x-m="…" y-m="…"/> to <world>',
            )


def _check_inside(place: Element, body: Element, width_m: float, depth_m: float, report: Report) -> None:
    for along, attribute, extent, room_m in (("x", "x-m", "width-m", width_m), ("y", "y-m", "depth-m", depth_m)):
        middle_m = place.number(attribute)
        half_m = (place.number(extent) or 0.0) / 2 if place.tag in ("furniture", "dark") else 0.0
        if middle_m is None or half_m <= middle_m <= room_m - half_m:
            if place.tag == "robot" and middle_m in (0.0, room_m):
                in_wall = f"robot {body.text('name')} stands in a wall: {along} at {middle_m:g} m"
                report.fault(place.place_of(attribute), in_wall, "Move it into the room")
            continue
        reach = f"from {middle_m - half_m:g} to {middle_m + half_m:g}" if half_m else f"at {middle_m:g}"
        report.fault(
            place.place_of(attribute),
            f"{body.tag} {body.text('name')} is outside the room: {along} {reach} m",
            f"The room goes from 0 to {room_m:g} m along {along}",
        )


def _check_tables(world: Element, report: Report) -> None:
    least = {"height-m": TABLE_TOP_M, "width-m": TABLE_LEGS_M, "depth-m": TABLE_LEGS_M}
    for table in (box for box in world.all("furniture") if box.text("shape") == "table"):
        for extent, least_m in least.items():
            extent_m = table.number(extent)
            if extent_m is not None and 0 < extent_m <= least_m:
                report.fault(
                    table.place_of(extent),
                    f"{table.text('name')} is too small for a table",
                    f"Make its {extent} more than {least_m:g}, or make it a box",
                )


def _check_not_inside(robots: list[Element], bodies: list[Element], along: str, across: str, report: Report) -> None:
    """Report each robot inside a body, which has these two extents and maybe a heading; skip missing numbers."""
    if len(robots) * len(bodies) > PAIRS_AT_MOST:
        return
    places = [(robot, robot.number("x-m"), robot.number("y-m")) for robot in robots]
    for body in bodies:
        x_m, y_m, length_m, width_m = (body.number(name) for name in ("x-m", "y-m", along, across))
        if x_m is None or y_m is None or length_m is None or width_m is None:
            continue
        heading_rad = math.radians(body.number("heading-deg") or 0.0)
        cosine, sine = math.cos(heading_rad), math.sin(heading_rad)
        for robot, robot_x_m, robot_y_m in places:
            if robot_x_m is None or robot_y_m is None:
                continue
            east_m, north_m = robot_x_m - x_m, robot_y_m - y_m
            along_m, across_m = east_m * cosine + north_m * sine, north_m * cosine - east_m * sine
            if abs(along_m) < length_m / 2 and abs(across_m) < width_m / 2:
                report.fault(
                    robot.place, f"robot {robot.text('name')} stands inside {body.text('name')}", "Move one of them"
                )


def _check_path(target: Element, report: Report) -> None:
    points = [(point.number("x-m"), point.number("y-m")) for point in target.all("point")]
    if len(points) > 1 and len(set(points)) == 1 and None not in points[0]:
        report.fault(
            target.place,
            f"all way points of {target.text('name')} are the same",
            "Give it a way to go, or make it furniture",
        )


def _check_classes(world: Element, tables: Tables, report: Report) -> None:
    for robot in world.all("robot"):
        class_path = robot.text("class")
        facts = tables.classes.get(tables.embodied(robot))
        if facts is not None and facts.failure:
            report.fault(robot.place_of("class"), facts.failure, "Mend the robot's body or class as the message says")
        if not class_path:
            _check_body(robot, tables, report)
            continue
        if CLASS_PATH.fullmatch(class_path):
            check_class_path(robot, "class", report)


def _check_body(robot: Element, tables: Tables, report: Report) -> None:
    """Report a robot without a class whose type has no body either; an unknown robot is reported elsewhere."""
    kinds = {resource.text("name"): resource.text("type") for resource in tables.robots()}
    kind = kinds.get(robot.text("name"), "")
    facts = tables.facts_of(kind)
    if facts is not None and not facts.abilities.body_class:
        report.fault(robot.place, f"type {kind} of {robot.text('name')} names no body", BODY)


def _check_carried(world: Element, report: Report) -> None:
    """Report robots whose carrier does not exist, has no place left, or cannot reach their place."""
    carriers = {target.text("name"): target for target in world.all("target") if target.text("shape") == CARRIER}
    aboard = dict.fromkeys(carriers, 0)
    for robot in world.all("robot"):
        carrier = robot.text("carried-by")
        if not carrier or not is_known(robot, "carried-by", "carrier", carriers, report) or carrier not in carriers:
            continue
        aboard[carrier] += 1
        if aboard[carrier] == CARRIER_PLACES + 1:
            report.fault(
                robot.place_of("carried-by"), f"{carrier} has {CARRIER_PLACES} places", "Give it to another carrier"
            )
        distance_m = _distance_to_path_m(robot, carriers[carrier])
        if distance_m is not None and not NEAREST_SET_DOWN_M <= distance_m <= FARTHEST_SET_DOWN_M:
            report.fault(
                robot.place_of("carried-by"),
                f"{carrier} passes {robot.text('name')}'s place {distance_m:.2f} m away",
                f"Its arm reaches from {NEAREST_SET_DOWN_M} to {FARTHEST_SET_DOWN_M} m beside its path",
            )


def _distance_to_path_m(robot: Element, target: Element) -> float | None:
    """Return the distance of a robot's place from a target's path; None if a number is missing."""
    x_m, y_m = robot.number("x-m"), robot.number("y-m")
    points = [(point.number("x-m"), point.number("y-m")) for point in target.all("point")]
    if x_m is None or y_m is None or len(points) < 2:
        return None
    nearest_m = math.inf
    for (ax, ay), (bx, by) in pairwise(points):
        if ax is None or ay is None or bx is None or by is None:
            return None
        squared = (bx - ax) ** 2 + (by - ay) ** 2
        share = 0.0 if squared == 0 else ((x_m - ax) * (bx - ax) + (y_m - ay) * (by - ay)) / squared
        share = min(1.0, max(0.0, share))
        nearest_m = min(nearest_m, math.dist((x_m, y_m), (ax + share * (bx - ax), ay + share * (by - ay))))
    return nearest_m
