"""Converts the declared elements of a faultless mission to its description."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence

from backbone.component.abilities import NO_ABILITIES
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.mission.behavior_nodes import ArcNeed, BehaviorNode
from backbone.mission.class_facts import ClassFacts
from backbone.mission.declaration.elements import (
    ArcAttributes,
    ArcElement,
    BehaviorAttributes,
    BehaviorElement,
    BehaviorsElement,
    MissionElement,
    ResourceElement,
    TypeElement,
)
from backbone.mission.declaration.module_elements import UnitElement
from backbone.mission.declaration.parts import Declared, ParameterElement
from backbone.mission.declaration.world_elements import AirElement, TargetElement, WorldElement
from backbone.mission.model import (
    EXECUTION_UNIT,
    ComponentDescription,
    CoreServiceDescription,
    Host,
    LastBranchDescription,
    MissionDescription,
)
from backbone.mission.room_files import floor_plan_text, room_text
from backbone.mission.tables import CORE_SERVICES, FLOOR_PLAN, NETWORK_ID, ROOM, SIMULATED, WORLD, parameter_value

NOTHING_KNOWN = ClassFacts()


def describe(
    mission: MissionElement,
    source: str,
    classes: Mapping[str, ClassFacts],
    arranged: Mapping[str, Mapping[str, object]],
) -> MissionDescription:
    """Return the description of a mission without faults.

    Args:
        classes: Class path → facts of the class.
        arranged: Execution unit → parameters of its component.
    """
    hosts = () if mission.hosts is None else tuple(Host(**one.model_dump()) for one in mission.hosts.host)
    world, tree = mission.world, mission.behaviors or BehaviorsElement()
    resources = () if mission.resources is None else mission.resources.resource
    units = () if mission.modules is None else mission.modules.unit
    members = (*resources, *(() if world is None else (world,)), *units)
    host_of_process = {one.process: one.host for one in members if one.process and one.host}
    types = () if mission.types is None else tuple(_component_type(one, classes) for one in mission.types.type)
    robots = {one.name for one in types if one.abilities.is_robot}
    in_rooms = {one.name for one in types if ROOM in classes.get(one.class_path, NOTHING_KNOWN).given}
    return MissionDescription(
        name=mission.name,
        priority=mission.priority,
        hosts=hosts,
        core=_core(mission, [host.name for host in hosts]),
        types=types,
        resources=tuple(_resource(one, world, host_of_process, robots, in_rooms, source) for one in resources),
        components=() if world is None else (_world(world, resources, source, host_of_process, types),),
        units=tuple(_unit(one, host_of_process, arranged.get(one.name, {})) for one in units),
        behaviors=tuple(map(_behavior, tree.behavior)),
        source=source,
        last=(
            None
            if tree.last is None
            else LastBranchDescription(behavior=_behavior(tree.last.behavior), within_s=tree.last.within_s)
        ),
    )


def _parameters(given: Iterable[ParameterElement]) -> dict[str, bool | int | float | str]:
    return {one.name: parameter_value(one.value) for one in given}


def _core(mission: MissionElement, hosts: Sequence[str]) -> tuple[CoreServiceDescription, ...]:
    written = () if mission.core is None else mission.core.service
    services = [
        CoreServiceDescription(type=one.type, host=one.host, parameters=_parameters(one.parameter)) for one in written
    ]
    return tuple(sorted(services, key=lambda one: (CORE_SERVICES.index(one.type), hosts.index(one.host))))


def _component_type(declared: TypeElement, classes: Mapping[str, ClassFacts]) -> ComponentType:
    facts = classes.get(declared.class_path)
    return ComponentType(
        name=declared.name,
        class_path=declared.class_path,
        subsystem=declared.subsystem,
        multiplicity=declared.multiplicity,
        core=declared.core,
        tags=list(declared.tags),
        restart=declared.restart,
        needs={needed.role or needed.type: needed.type for needed in declared.needs},
        abilities=NO_ABILITIES if facts is None else facts.abilities,
        shares_process=facts is None or facts.shares_process,
        alike_most=1 if facts is None else facts.alike_most,
    )


def _resource(
    declared: ResourceElement,
    world: WorldElement | None,
    host_of_process: Mapping[str, str],
    robots: Collection[str],
    in_rooms: Collection[str],
    source: str,
) -> Resource:
    links: dict[str, list[str]] = {}
    for used in declared.uses:
        links.setdefault(used.type, []).append(used.name)
    played_by = {WORLD: world.name} if world is not None and declared.driver == SIMULATED else {}
    given = _parameters(declared.parameter)
    room: dict[str, object] = {}
    if declared.type in in_rooms:
        room = {} if world is None else {ROOM: _room(world)}
        if name := given.get(FLOOR_PLAN):
            given[FLOOR_PLAN] = floor_plan_text(source, str(name))
    values = declared.model_dump(exclude={"uses", "parameter", "features", "host"})
    return Resource(
        **values,
        host=declared.host or host_of_process.get(declared.process, ""),
        features=list(declared.features),
        parameters={**played_by, **room, **given},
        links=links,
        is_robot=declared.type in robots,
    )


def _unit(
    declared: UnitElement, host_of_process: Mapping[str, str], parameters: Mapping[str, object]
) -> ComponentDescription:
    return ComponentDescription(
        type=EXECUTION_UNIT,
        name=declared.name,
        host=declared.host or host_of_process.get(declared.process, ""),
        parameters=dict(parameters),
        process=declared.process,
    )


def _behavior(declared: BehaviorElement) -> BehaviorNode:
    return BehaviorNode(
        **declared.model_dump(include=set(BehaviorAttributes.model_fields), exclude_defaults=True),
        parameters=_parameters(declared.parameter),
        arc=None if declared.arc is None else _arc(declared.arc),
        children=tuple(map(_behavior, declared.behavior)),
    )


def _arc(declared: ArcElement) -> ArcNeed:
    return ArcNeed(
        **declared.model_dump(include=set(ArcAttributes.model_fields), exclude_defaults=True),
        wish={wish.type: wish.name for wish in declared.wish if wish.name},
        features={wish.type: wish.features for wish in declared.wish if wish.features},
    )


def _world(
    world: WorldElement,
    resources: Sequence[ResourceElement],
    source: str,
    host_of_process: Mapping[str, str],
    types: Sequence[ComponentType],
) -> ComponentDescription:
    body_of = {one.name: one.abilities.body_class for one in types}
    given = {
        one.name: {NETWORK_ID: _parameters(one.parameter).get(NETWORK_ID), "kind": body_of.get(one.type, "")}
        for one in resources
    }
    return ComponentDescription(
        type=world.type,
        name=world.name,
        host=world.host or host_of_process.get(world.process, ""),
        parameters={**_parameters(world.parameter), WORLD: _world_content(world, given, source)},
        process=world.process,
    )


def _world_content(world: WorldElement, given: Mapping[str, Mapping[str, object]], source: str) -> dict[str, object]:
    """Return the world as plain data, with the field names of ``scout_model.description.WorldDescription``.

    Args:
        world: The declared world.
        given: Robot → what its resource declares of its body.
        source: Path of the mission file.
    """
    return {
        **_standing(world),
        "seed": world.seed,
        "robots": [
            {
                **_body(robot, "class_path"),
                **given[robot.name],
                **({"kind": robot.class_path} if robot.class_path else {}),
            }
            for robot in world.robot
        ],
        "targets": list(map(_target, world.target)),
        "air": (world.air or AirElement()).model_dump(),
        "mjcf": room_text(source, world.room.mjcf) if world.room.mjcf else "",
    }


def _room(world: WorldElement) -> dict[str, object]:
    """Return the content of the room at the beginning, including robots, as plain data of ``WorldDescription``."""
    robots = [{**_body(robot, "class_path"), NETWORK_ID: 0} for robot in world.robot]
    return {**_standing(world), "robots": robots}


def _standing(world: WorldElement) -> dict[str, object]:
    """Return the size of the room and its immovable content."""
    return {
        "width_m": world.room.width_m,
        "depth_m": world.room.depth_m,
        "furniture": list(map(_body, world.furniture)),
        "ramps": list(map(_body, world.ramp)),
        "landmarks": list(map(_body, world.landmark)),
        "dark_places": list(map(_body, world.dark)),
    }


def _body(declared: Declared, *left_out: str) -> dict[str, object]:
    """Return the attributes of a body, its heading in radians."""
    values = declared.model_dump(exclude=set(left_out))
    if "heading_deg" in values:
        values["heading_rad"] = math.radians(values.pop("heading_deg"))
    return values


def _target(target: TargetElement) -> dict[str, object]:
    return {**_body(target, "point"), "path": [[point.x_m, point.y_m] for point in target.point]}
