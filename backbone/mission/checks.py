"""Consistency checks of a mission file: hosts, core services, types, resources, names.

Pure: elements in, faults out. These checks skip values that the schema has refused, so that each mistake is reported
once. World and behaviors have files of their own.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from backbone.authentication import is_address, is_loopback, is_of_one_link, is_reachable
from backbone.component_database.messages import Multiplicity
from backbone.creator.messages import TYPE as CREATOR
from backbone.creator.messages import creator_name, offer_name
from backbone.mission.behavior_checks import check_behaviors
from backbone.mission.class_facts import ClassFacts, shipped_classes
from backbone.mission.class_paths import CLASS_PATH
from backbone.mission.document import Element
from backbone.mission.module_checks import check_modules
from backbone.mission.needs_checks import check_commands, check_needs, check_replaced, check_roles
from backbone.mission.parameter_checks import (
    check_class_parameters,
    check_class_path,
    check_driver,
    check_service_parameters,
    check_type_class,
)
from backbone.mission.process_checks import check_processes
from backbone.mission.report import Place, Report, listed, quoted
from backbone.mission.room_files import check_floor_plan
from backbone.mission.tables import (
    CORE_SERVICES,
    NETWORK_ID,
    ROOM,
    SIMULATED,
    WORLD,
    Tables,
    check_host,
    check_multiplicity,
    check_parameters,
    check_unique,
    host_tags_lacking,
    is_known,
    parameters,
    section,
)
from backbone.mission.world_checks import check_world
from backbone.naming import MAX_NAME_LENGTH, Subsystem, is_legal

ARC = "behavior's ARC"  # its component is named <behavior>-<kind>
LAUNCHER = "launcher"  # the component that 'up' runs as
FIRST_NETWORK_ID, LAST_NETWORK_ID = 1, 254  # as the radio's packets carry it: one byte, without 0 and 255
SET_BY_RESOURCE = ("driver", "sharable", "capacity", "links")  # Resource.rc_parameters


def check(root: Element, classes: Mapping[str, ClassFacts], report: Report) -> None:
    """Report every fault that these checks can find.

    Args:
        classes: Class path → facts of the class; parameters of other classes are not checked.
    """
    tables = Tables.of(root, classes)
    _check_hosts(tables, report)
    _check_core(tables, report)
    _check_types(tables, report)
    check_world(tables, report)
    _check_resources(tables, report)
    check_modules(tables, report)
    check_behaviors(tables, report)
    _check_component_names(tables, report)
    check_processes(tables, _reserved(tables), report)


def _check_hosts(tables: Tables, report: Report) -> None:
    hosts = section(tables.root, "hosts")
    check_unique(hosts, "name", "host", report)
    for host in hosts:
        address = host.text("address")
        if not is_address(address):
            report.fault(
                host.place_of("address"),
                f"{quoted(address)} is no IP address and no host name",
                "Write it like 192.0.2.7 or field.local",
            )
        name = creator_name(host.text("name"))
        if is_legal(host.text("name")) and not is_legal(name):
            report.fault(
                host.place_of("name"), "the name is too long for a creator's", f"{name} must fit {MAX_NAME_LENGTH}"
            )
    _check_hub_endpoint(hosts, report)


def _check_hub_endpoint(hosts: list[Element], report: Report) -> None:
    """Report a first host that other machines cannot reach, and ports of hosts that run no hub."""
    for host in hosts[1:]:
        if host.has("port"):
            report.fault(
                host.place_of("port"),
                f"host {host.text('name')} has a port, but runs no hub",
                f"Remove it; the hub runs on the first host, {hosts[0].text('name')}",
            )
    others = [host.text("name") for host in hosts[1:] if host.text("address") and not is_loopback(host.text("address"))]
    if others and not is_reachable(hosts[0].text("address")):
        report.fault(
            hosts[0].place_of("address"),
            f"no other machine reaches {quoted(hosts[0].text('address'))}, and {listed(others)} must",
            f"Write the address at which they reach {hosts[0].text('name')}",
        )
    elif others and is_address(hub := hosts[0].text("address")) and is_of_one_link(hub):
        report.fault(
            hosts[0].place_of("address"),
            f"each machine reaches {quoted(hub)} by an interface of its own",
            "Write an address that is the same everywhere, like fd00::7 or 192.0.2.7",
        )


def _check_core(tables: Tables, report: Report) -> None:
    first: dict[tuple[str, str], Element] = {}
    for service in section(tables.root, "core"):
        name, where = service.text("type"), service.text("host")
        if is_known(service, "type", "core service", CORE_SERVICES, report):
            before = first.setdefault((name, where if name == CREATOR else ""), service)
            if before is not service:
                report.fault(
                    service.place,
                    f"a second {name}{f' on {where}' if name == CREATOR else ''}; "
                    f"the first is in line {before.place.line}",
                    "Remove one; creator runs once on each host, every other core service once in the mission",
                )
        check_host(service, tables, report)
        check_service_parameters(service, tables, report)
        main = _main_host(tables)
        if name in CORE_SERVICES and name != CREATOR and where in tables.hosts and where != main:
            report.fault(
                service.place_of("host"),
                f"{name} on host {where}: other hosts than the first run only their creator",
                f"Put it on {main}",
            )


def _main_host(tables: Tables) -> str:
    """Return the name of the host that runs the core services."""
    return next(iter(tables.hosts), "…")


def _check_types(tables: Tables, report: Report) -> None:
    types = section(tables.root, "types")
    check_unique(types, "name", "type", report)
    for component_type in types:
        _check_core_type(component_type, report)
        if component_type.place != tables.root.place:
            check_needs(component_type, tables, report)
            check_roles(component_type, tables, report)
            check_commands(component_type, tables, report)
            check_replaced(component_type, tables, report)
        _check_type_tags(component_type, tables, report)
        class_path = component_type.text("class")
        is_own = tables.is_only_here and class_path not in shipped_classes() and CLASS_PATH.fullmatch(class_path)
        if is_own and check_class_path(component_type, "class", report):
            check_type_class(component_type, tables.classes.get(class_path), report)


def _check_core_type(component_type: Element, report: Report) -> None:
    name, core = component_type.text("name"), component_type.flag("core")
    if core and name not in CORE_SERVICES and is_legal(name):
        report.fault(
            component_type.place_of("core"),
            f"{name} is no core service{report.hint(name, CORE_SERVICES)}",
            f"Core services are {', '.join(CORE_SERVICES)}; others are started by the placer, without core",
        )
    if name not in CORE_SERVICES:
        return
    if core is False:
        report.fault(component_type.place_of("core"), f"{name} is a core service", 'Add core="true"')
    if component_type.text("subsystem") != Subsystem.BACKBONE and component_type.text("subsystem") in set(Subsystem):
        report.fault(
            component_type.place_of("subsystem"), f"{name} belongs to the backbone", 'Write subsystem="backbone"'
        )
    right = Multiplicity.MANY if name == CREATOR else Multiplicity.ONE
    if component_type.text("multiplicity") != right and component_type.text("multiplicity") in set(Multiplicity):
        why = "there is one on each host" if name == CREATOR else "there is one in a mission"
        report.fault(
            component_type.place_of("multiplicity"), f"multiplicity of {name}: {why}", f'Write multiplicity="{right}"'
        )


def _check_type_tags(component_type: Element, tables: Tables, report: Report) -> None:
    if not tables.hosts or not component_type.words("tags"):
        return
    lacking = {name: host_tags_lacking(host, component_type) for name, host in tables.hosts.items()}
    if all(lacking.values()):
        reasons = "; ".join(f"{name} lacks {', '.join(tags)}" for name, tags in lacking.items())
        report.fault(
            component_type.place_of("tags"),
            f"no host can run type {component_type.text('name')}: {reasons}",
            "Give a host these tags, or remove them here",
        )


def _check_resources(tables: Tables, report: Report) -> None:
    resources = section(tables.root, "resources")
    of_one: dict[str, Element] = {}
    ids: dict[int, Element] = {}
    for robot in tables.robots():
        if NETWORK_ID not in parameters(robot):
            report.fault(
                robot.place,
                f"{robot.text('type')} {robot.text('name')} has no network id",
                f'Add <parameter name="{NETWORK_ID}" value="…"/>, from {FIRST_NETWORK_ID} to {LAST_NETWORK_ID}',
            )
    for resource in resources:
        kind = resource.text("type")
        if kind in tables.types and not tables.is_resource_type(kind):
            report.fault(
                resource.place_of("type"),
                f"type {kind} runs no hardware",
                f"Types of resource are those of subsystem resource_pool without <needs>: "
                f"{listed(tables.resource_types()) or 'there is none'}",
            )
        elif kind not in tables.types:
            is_known(resource, "type", "type of resource", tables.resource_types(), report)
        check_host(resource, tables, report)
        facts = tables.facts_of(kind)
        if facts is not None and not facts.failure and not set(SET_BY_RESOURCE) <= set(facts.given):
            report.fault(
                resource.place_of("type"),
                f"type {kind} is no resource: its class {tables.types[kind].text('class')} is no resource controller",
                "Derive the class from resource_pool.resource_controller:ResourceController",
            )
            continue
        check_parameters(resource, SET_BY_RESOURCE, report)
        check_class_parameters(resource, SET_BY_RESOURCE, tables, report)
        _check_uses(resource, tables, report)
        check_driver(resource, tables, report)
        _check_world_of(resource, tables, report)
        if facts is not None and ROOM in facts.given:
            check_floor_plan(resource, report)
        _check_network_id(resource, ids, report)
        capacity = resource.number("capacity")
        if capacity is not None and 0 < capacity < 1 and resource.flag("sharable") is False:
            report.fault(
                resource.place_of("capacity"),
                f"capacity {capacity:g} of {resource.text('name')}, which is not sharable",
                'Add sharable="true", or remove the capacity',
            )
        check_multiplicity(resource, "type", f"resource of type {kind}", tables, of_one, report)


def _check_uses(resource: Element, tables: Tables, report: Report) -> None:
    uses = resource.all("uses")
    check_unique(uses, "name", "use of resource", report)
    for used in uses:
        kind = used.text("type")
        type_fits = is_known(used, "type", "type of resource", tables.resource_types(), report)
        of_kind = [other.text("name") for other in tables.resources_of(kind)] if type_fits else list(tables.resources)
        name = used.text("name")
        if type_fits and name in tables.resources and name not in of_kind and tables.resources[name].text("type"):
            report.fault(
                used.place_of("name"),
                f"{name} is a {tables.resources[name].text('type')}, no {kind}",
                f"Write its type, or name one of these: {listed(of_kind) or 'there is none'}",
            )
        elif is_known(used, "name", kind if type_fits else "resource", of_kind, report) and name == resource.text(
            "name"
        ):
            report.fault(used.place_of("name"), f"{name} uses itself", "Name another resource")
    used_kinds = {used.text("type") for used in uses}
    component_type = tables.types.get(resource.text("type"))
    for kind in [] if component_type is None else dict.fromkeys(component_type.words("uses")):
        if kind not in used_kinds and tables.is_resource_type(kind):
            there = listed([other.text("name") for other in tables.resources_of(kind)])
            report.fault(
                resource.place,
                f"{resource.text('type')} {resource.text('name')} is on no {kind}",
                f'Add <uses type="{kind}" name="…"/>; there is: {there}' if there else f"Add a resource of type {kind}",
            )


def _check_world_of(resource: Element, tables: Tables, report: Report) -> None:
    if resource.text("driver") != SIMULATED:
        return
    if tables.world is None:
        report.fault(
            resource.place_of("driver"),
            f"{resource.text('name')} is simulated, but there is no world that plays it",
            "Add a <world>, or name the driver of real hardware",
        )
        return
    for given in resource.all("parameter"):
        name = tables.world.text("name")
        if given.text("name") == WORLD and given.text("value") != name and is_legal(name):
            report.fault(
                given.place_of("value"),
                f"no world is named {quoted(given.text('value'))}{report.hint(given.text('value'), [name])}",
                f"Write {name}, or leave the parameter out",
            )


def _check_network_id(resource: Element, ids: dict[int, Element], report: Report) -> None:
    for given in resource.all("parameter"):
        if given.text("name") != NETWORK_ID:
            continue
        value = parameters(resource)[NETWORK_ID]
        if isinstance(value, bool) or not isinstance(value, int) or not FIRST_NETWORK_ID <= value <= LAST_NETWORK_ID:
            report.fault(
                given.place_of("value"),
                f"network id {quoted(given.text('value'))} of {resource.text('name')} is illegal",
                f"Write a whole number from {FIRST_NETWORK_ID} to {LAST_NETWORK_ID}",
            )
            return
        before = ids.setdefault(value, resource)
        if before is not resource:
            report.fault(
                given.place_of("value"),
                f"network id {value} of {resource.text('name')} is {before.text('name')}'s too",
                "Give each robot its own",
            )
        return


def _check_component_names(tables: Tables, report: Report) -> None:
    """Report a name that two components would have: RCs, world, units, behaviors, their ARCs, core services."""
    reserved = _reserved(tables)
    first: dict[str, tuple[str, Place]] = {}
    for name, what, place in sorted(_components(tables), key=lambda component: component[2]):
        if not is_legal(name):
            if len(name) > MAX_NAME_LENGTH and what == ARC:
                report.fault(place, f"the ARC's name, {name}, is too long", "Shorten the behavior's name")
            continue
        if name in reserved:
            report.fault(place, f"the {what} has the name {quoted(name)} of a core service", "Choose another name")
            continue
        before, there = first.setdefault(name, (what, place))
        if there != place:
            told_twice = (
                f"a second {what} {quoted(name)}; the first is in line {there.line}"
                if what == before
                else f"the {what} has the name {quoted(name)} of the {before} in line {there.line}"
            )
            report.fault(place, told_twice, "Give each component of the mission its own name")


def _reserved(tables: Tables) -> set[str]:
    """Return the names of the backbone's own components."""
    names = {LAUNCHER, *CORE_SERVICES}
    return names | {name(host) for host in tables.hosts for name in (creator_name, offer_name)}


def _components(tables: Tables) -> Iterator[tuple[str, str, Place]]:
    """Yield name, kind and place of each named component."""
    for resource in section(tables.root, "resources"):
        yield resource.text("name"), "resource", resource.place_of("name")
    if tables.world is not None:
        yield tables.world.text("name"), "world", tables.world.place_of("name")
    for unit in tables.units:
        yield unit.text("name"), "unit", unit.place_of("name")
    for behavior in tables.behaviors:
        yield behavior.text("name"), "behavior", behavior.place_of("name")
    for behavior, arc in tables.claims():
        if arc.text("kind") in tables.types and is_legal(behavior.text("name")):
            yield f"{behavior.text('name')}-{arc.text('kind')}", ARC, arc.place_of("kind")
