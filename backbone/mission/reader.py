"""From a mission file to a checked mission description, or to everything that is wrong with it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from backbone.component_database.messages import ComponentType, Multiplicity
from backbone.dependency_database.messages import Resource
from backbone.mission.checks import check
from backbone.mission.class_facts import ClassFacts, shipped_classes
from backbone.mission.class_paths import CLASS_PATH, class_path_fault
from backbone.mission.class_probe import ask_classes
from backbone.mission.completion import complete
from backbone.mission.document import Element, parse, read_bytes
from backbone.mission.model import HUB_PORT, ArcWish, Behavior, Component, CoreService, Host, MissionDescription
from backbone.mission.report import Fault, MissionInvalid, Report
from backbone.mission.room_files import room_text
from backbone.mission.schema import apply_schema, fill_defaults, schema_text, vocabulary
from backbone.mission.tables import CORE_SERVICES, NETWORK_ID, SIMULATED, WORLD, Tables, parameters, section
from backbone.naming import Subsystem

__all__ = ["Fault", "MissionInvalid", "read_mission", "read_mission_bytes", "schema_text"]


def read_mission(path: str | Path) -> MissionDescription:
    """Return the mission the file describes. No component is started.

    The classes of the file's own types are asked for their parameters in a process of its own, which imports them.

    Args:
        path: The mission file; faults name it as it is given here.

    Raises:
        MissionInvalid: With every fault of the file, in its order.
    """
    report = Report(str(path))
    data = read_bytes(Path(path), report)
    if data is None:
        raise MissionInvalid(report.faults())
    return read_mission_bytes(data, str(path))


def read_mission_bytes(data: bytes, source: str, classes: Mapping[str, ClassFacts] | None = None) -> MissionDescription:
    """Return the mission these bytes describe, as ``read_mission`` does of a file that holds them.

    Args:
        data: What the file holds or would hold.
        source: Its path; faults name it, and files that the mission names are looked for beside it.
        classes: What is known of classes besides the project's own; None: those that the mission names are asked.

    Raises:
        MissionInvalid: With every fault, in the order of the file.
    """
    report = Report(source)
    root = parse(data, report)
    if root is not None and apply_schema(root, report):
        complete(root)
        fill_defaults(root)
        check(root, known_classes(root) if classes is None else {**shipped_classes(), **classes}, report)
    faults = report.faults()
    if faults or root is None:
        raise MissionInvalid(faults)
    return _describe(root, source)


def known_classes(root: Element) -> dict[str, ClassFacts]:
    """Return what the classes of a mission's types say of themselves; those of its own are imported elsewhere."""
    known = shipped_classes()
    paths = {one.text("class") for one in section(root, "types")}
    asked = [path for path in sorted(paths - known.keys()) if CLASS_PATH.fullmatch(path) and not class_path_fault(path)]
    return {**known, **ask_classes(asked)}


def _describe(root: Element, source: str) -> MissionDescription:
    """Return the description of a tree without faults."""
    tables = Tables.of(root)
    return MissionDescription(
        name=root.text("name"),
        priority=int(root.text("priority")),
        hosts=tuple(
            Host(
                name=host.text("name"),
                address=host.text("address"),
                tags=tuple(host.words("tags")),
                port=int(host.text("port") or HUB_PORT),
            )
            for host in section(root, "hosts")
        ),
        core=tuple(_core(root, list(tables.hosts))),
        types=tuple(_component_type(component_type) for component_type in section(root, "types")),
        resources=tuple(_resource(resource, tables) for resource in section(root, "resources")),
        components=() if tables.world is None else (_world(tables.world, tables, source),),
        behaviors=tuple(_behavior(behavior) for behavior in section(root, "behaviors")),
        source=source,
    )


def _core(root: Element, hosts: list[str]) -> list[CoreService]:
    services = [
        CoreService(type=service.text("type"), host=service.text("host"), parameters=parameters(service))
        for service in section(root, "core")
    ]
    return sorted(services, key=lambda service: (CORE_SERVICES.index(service.type), hosts.index(service.host)))


def _component_type(component_type: Element) -> ComponentType:
    return ComponentType(
        name=component_type.text("name"),
        class_path=component_type.text("class"),
        subsystem=Subsystem(component_type.text("subsystem")),
        multiplicity=Multiplicity(component_type.text("multiplicity")),
        core=bool(component_type.flag("core")),
        tags=component_type.words("tags"),
        restart=bool(component_type.flag("restart")),
        needs=[needed.text("type") for needed in component_type.all("needs")],
    )


def _resource(resource: Element, tables: Tables) -> Resource:
    links: dict[str, list[str]] = {}
    for used in resource.all("uses"):
        links.setdefault(used.text("type"), []).append(used.text("name"))
    world = tables.world if resource.text("driver") == SIMULATED else None
    return Resource(
        name=resource.text("name"),
        type=resource.text("type"),
        host=resource.text("host"),
        sharable=bool(resource.flag("sharable")),
        capacity=_number(resource, "capacity"),
        connect_s=_number(resource, "connect-s"),
        disconnect_s=_number(resource, "disconnect-s"),
        driver=resource.text("driver"),
        parameters={**({} if world is None else {WORLD: world.text("name")}), **parameters(resource)},
        features=resource.words("features"),
        links=links,
        process=resource.text("process"),
    )


def _world(world: Element, tables: Tables, source: str) -> Component:
    return Component(
        type=world.text("type"),
        name=world.text("name"),
        host=world.text("host"),
        parameters={**parameters(world), WORLD: _world_content(world, tables, source)},
        process=world.text("process"),
    )


def _world_content(world: Element, tables: Tables, source: str) -> dict[str, Any]:
    """Return the world as plain data, with the field names of ``scout_model.description.WorldDescription``."""
    room = world.first("room")
    if room is None:
        raise AssertionError("a world without a room passed the schema")
    ids = {name: parameters(resource).get(NETWORK_ID) for name, resource in tables.resources.items()}
    return {
        "width_m": _number(room, "width-m"),
        "depth_m": _number(room, "depth-m"),
        "seed": int(world.text("seed")),
        "furniture": [
            {
                "name": box.text("name"),
                "x_m": _number(box, "x-m"),
                "y_m": _number(box, "y-m"),
                "width_m": _number(box, "width-m"),
                "depth_m": _number(box, "depth-m"),
                "height_m": _number(box, "height-m"),
                "shape": box.text("shape"),
            }
            for box in world.all("furniture")
        ],
        "scouts": [
            {
                "name": scout.text("name"),
                "network_id": ids[scout.text("name")],
                "x_m": _number(scout, "x-m"),
                "y_m": _number(scout, "y-m"),
                "heading_rad": math.radians(_number(scout, "heading-deg")),
                "kind": scout.text("class"),
                "carried_by": scout.text("carried-by"),
            }
            for scout in world.all("scout")
        ],
        "targets": [
            {
                "name": target.text("name"),
                "shape": target.text("shape"),
                "path": [[_number(point, "x-m"), _number(point, "y-m")] for point in target.all("point")],
                "speed_m_s": _number(target, "speed-m-s"),
                "begin_s": _number(target, "begin-s"),
                "rest_s": _number(target, "rest-s"),
                "there_and_back": bool(target.flag("there-and-back")),
            }
            for target in world.all("target")
        ],
        "ramps": [
            {
                "name": ramp.text("name"),
                "x_m": _number(ramp, "x-m"),
                "y_m": _number(ramp, "y-m"),
                "length_m": _number(ramp, "length-m"),
                "width_m": _number(ramp, "width-m"),
                "height_m": _number(ramp, "height-m"),
                "heading_rad": math.radians(_number(ramp, "heading-deg")),
            }
            for ramp in world.all("ramp")
        ],
        "landmarks": [
            {
                "name": landmark.text("name"),
                "x_m": _number(landmark, "x-m"),
                "y_m": _number(landmark, "y-m"),
                "heading_rad": math.radians(_number(landmark, "heading-deg")),
            }
            for landmark in world.all("landmark")
        ],
        "dark_places": [
            {
                "name": dark.text("name"),
                "x_m": _number(dark, "x-m"),
                "y_m": _number(dark, "y-m"),
                "width_m": _number(dark, "width-m"),
                "depth_m": _number(dark, "depth-m"),
                "height_m": _number(dark, "height-m"),
            }
            for dark in world.all("dark")
        ],
        "air": _air(world),
        "mjcf": room_text(source, room.text("mjcf")) if room.text("mjcf") else "",
    }


def _air(world: Element) -> dict[str, float | None]:
    """Return the air as plain data, with the field names of ``scout_model.description.AirDescription``."""
    air = world.first("air")
    given = {
        name: rule.default if air is None else air.text(name) for name, rule in vocabulary()["air"].attributes.items()
    }
    return {name.replace("-", "_"): float(value) if value else None for name, value in given.items()}


def _behavior(behavior: Element) -> Behavior:
    arc = behavior.first("arc")
    return Behavior(
        type=behavior.text("type"),
        name=behavior.text("name"),
        priority=int(behavior.text("priority")),
        parameters=parameters(behavior),
        arc=None if arc is None else _arc(arc),
        children=tuple(_behavior(child) for child in behavior.all("behavior")),
        process=behavior.text("process"),
    )


def _arc(arc: Element) -> ArcWish:
    wishes = arc.all("wish")
    return ArcWish(
        kind=arc.text("kind"),
        wish={wish.text("type"): wish.text("name") for wish in wishes if wish.text("name")},
        features={wish.text("type"): tuple(wish.words("features")) for wish in wishes if wish.words("features")},
        minimum_runtime_s=_number(arc, "minimum-runtime-s"),
        maximum_runtime_s=_number(arc, "maximum-runtime-s"),
        period_s=_number(arc, "period-s"),
        packet_time_s=_number(arc, "packet-time-s"),
    )


def _number(element: Element, attribute: str) -> float:
    value = element.number(attribute)
    if value is None:
        raise AssertionError(f"<{element.tag}> without a number in {attribute} passed the schema")
    return value
