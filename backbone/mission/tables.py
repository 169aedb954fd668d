"""The named elements of a mission file, for checks and reader."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field

import msgspec

from backbone.authentication import is_loopback
from backbone.component_database.messages import Multiplicity
from backbone.mission.class_facts import PLANNER, ClassFacts
from backbone.mission.class_paths import CLASS_PATH, class_path_fault
from backbone.mission.document import Element
from backbone.mission.report import Report, listed, quoted
from backbone.naming import Subsystem, is_legal
from backbone.ranges import wildness
from backbone.shipped import is_shipped

CORE_SERVICES = ("nameserver", "component_database", "placer", "creator", "dependency_database", "rc_manager")
"""In their order of start. Source: RAM 2002, "Backbone"."""

SIMULATED = "simulated"  # the driver whose hardware is simulated by the mission's world
SIMULATED_WORLD = "simulated_world"  # the shipped type of the simulated world
WORLD = "world"  # the parameter that names the world, and the world's own parameter
ROOM = "room"  # the parameter with the room, for classes that have it
FLOOR_PLAN = "floor_plan"  # their parameter for a picture of the floor: in the file its name, later its content
NETWORK_ID = "network_id"  # the parameter by which the radio distinguishes robots


@dataclass(frozen=True)
class Tables:
    """Elements by name; if several have one name, the first.

    Attributes:
        by_type: Type → all its resources, in the order of the file.
        world: The simulated world, if there is one.
        behaviors: Every node of the behavior tree, parents before their children.
        classes: Class path → facts of the class.
    """

    root: Element
    hosts: dict[str, Element]
    types: dict[str, Element]
    resources: dict[str, Element]
    by_type: dict[str, list[Element]]
    world: Element | None
    behaviors: list[Element]
    classes: Mapping[str, ClassFacts] = field(default_factory=dict)

    @classmethod
    def of(cls, root: Element, classes: Mapping[str, ClassFacts] | None = None) -> Tables:
        """Return the tables of a mission."""
        behaviors = root.first("behaviors")
        return cls(
            root,
            _by_name(section(root, "hosts")),
            _by_name(section(root, "types")),
            _by_name(section(root, "resources")),
            _by_type(section(root, "resources")),
            root.first("world"),
            [] if behaviors is None else [element for element in behaviors if element.tag == "behavior"],
            classes or {},
        )

    @property
    def units(self) -> list[Element]:
        """The execution units, in the order of the file."""
        modules = self.root.first("modules")
        return [] if modules is None else modules.all("unit")

    def facts_of(self, kind: str) -> ClassFacts | None:
        """Return the facts of the class of this type; None: unknown."""
        found = self.classes.get(self.types[kind].text("class")) if kind in self.types else None
        return None if found is None or found.failure else found

    def driver_of(self, resource: Element) -> str:
        """Return the name or class path of the driver that the file names for a resource."""
        facts = self.facts_of(resource.text("type"))
        by_parameter = "" if facts is None else parameters(resource).get(facts.driver_field)
        return str(by_parameter or resource.text("driver"))

    def driven(self, resource: Element) -> str:
        """Return class path and driver of a resource with a driver of its own, for ``ask_classes``; empty: it has none.

        The driver must be on this machine, as far as can be seen without running code.
        """
        facts, driver = self.facts_of(resource.text("type")), self.driver_of(resource)
        if not self.is_only_here or facts is None or facts.options is None or not CLASS_PATH.fullmatch(driver):
            return ""
        return "" if class_path_fault(driver) else f"{self.types[resource.text('type')].text('class')} {driver}"

    def facts_with_driver(self, resource: Element) -> ClassFacts | None:
        """Return the facts of the class of a resource, and of its driver where this is known."""
        return self.classes.get(self.driven(resource)) or self.facts_of(resource.text("type"))

    def embodied(self, robot: Element) -> str:
        """Return class path of the world and of a robot's own body, for ``ask_classes``; empty: shipped or not here."""
        kind = self.resources[robot.text("name")].text("type") if robot.text("name") in self.resources else ""
        facts = self.facts_of(kind)
        body = robot.text("class") or ("" if facts is None else facts.abilities.body_class)
        is_own = CLASS_PATH.fullmatch(body) and not is_shipped(body)
        if self.world is None or self.world.text("type") not in self.types or not self.is_only_here or not is_own:
            return ""
        return "" if class_path_fault(body) else f"{self.types[self.world.text('type')].text('class')} {body}"

    def planned(self, service: Element) -> str:
        """Return the question about a planner of one's own for ``ask_classes``; empty: none, or not on this machine."""
        planner = str(parameters(service).get(PLANNER, ""))
        is_asked = self.is_only_here and CLASS_PATH.fullmatch(planner) and not class_path_fault(planner)
        return f"{PLANNER} {planner}" if is_asked else ""

    @property
    def is_only_here(self) -> bool:
        """True if no component runs on another machine."""
        return all(is_loopback(host.text("address")) for host in self.hosts.values())

    def needs(self, kind: str) -> dict[str, str]:
        """Return role → type of resource that an ARC of this kind needs; empty if it is not an ARC."""
        found = self.types.get(kind)
        return {} if found is None else {role_of(needed): needed.text("type") for needed in found.all("needs")}

    def belongs_to(self, name: str, subsystem: Subsystem) -> bool:
        """Return whether this type is of the subsystem; a type with an illegal subsystem may be of any."""
        found = self.types.get(name)
        return found is not None and (
            found.text("subsystem") == subsystem or found.text("subsystem") not in set(Subsystem)
        )

    def is_resource_type(self, name: str) -> bool:
        """Return whether this type runs a piece of hardware, so is not a service, ARC, behavior or world."""
        return (
            self.belongs_to(name, Subsystem.RESOURCE_POOL)
            and not self.needs(name)
            and name != (SIMULATED_WORLD if self.world is None else self.world.text("type"))
        )

    def resource_types(self) -> list[str]:
        """Return the names of all types that run hardware."""
        return [name for name in self.types if self.is_resource_type(name)]

    def resources_of(self, kind: str) -> list[Element]:
        """Return the resources of a type, in the order of the file."""
        return self.by_type.get(kind, [])

    def is_resource_of(self, name: str, kind: str) -> bool:
        """Return whether a resource of this name and type exists."""
        return name in self.resources and self.resources[name].text("type") == kind

    def robots(self) -> list[Element]:
        """Return the resources that a radio distinguishes: all of each type that has a resource with a network id."""
        return [
            resource
            for same_type in self.by_type.values()
            if any(NETWORK_ID in parameters(resource) for resource in same_type)
            for resource in same_type
        ]

    def claims(self) -> list[tuple[Element, Element]]:
        """Return every behavior that claims an ARC, with the ARC."""
        return [(behavior, arc) for behavior in self.behaviors if (arc := behavior.first("arc")) is not None]


def role_of(needed: Element) -> str:
    """Return the role of a need in its ARC."""
    return needed.text("role") or needed.text("type")


def section(root: Element, tag: str) -> list[Element]:
    """Return the content of a section of the mission; empty if it is left out."""
    found = root.first(tag)
    return [] if found is None else found.children


def parameter_value(text: str) -> bool | int | float | str:
    """Return the value of a parameter: a number, true or false if the text is JSON for it, otherwise the text.

    A number that no message can carry remains a text, so that no class gets it as a number.

    Example:
        >>> parameter_value("15"), parameter_value("0.5"), parameter_value("true"), parameter_value("/dev/video0")
        (15, 0.5, True, '/dev/video0')
    """
    try:
        value = msgspec.json.decode(text.encode())
    except msgspec.DecodeError:
        return text
    return value if isinstance(value, bool | int | float) and not wildness(value) else text


def parameters(element: Element) -> dict[str, bool | int | float | str]:
    """Return the parameters written in an element."""
    return {given.text("name"): parameter_value(given.text("value")) for given in element.all("parameter")}


def host_tags_lacking(host: Element, component_type: Element) -> list[str]:
    """Return the tags that a type requires and a host does not have."""
    return [tag for tag in component_type.words("tags") if tag not in host.words("tags")]


NAMES_OF_TYPES = ("component type", "type of behavior", "type of resource", "kind of ARC")


def is_known(element: Element, attribute: str, what: str, known: Collection[str], report: Report) -> bool:
    """Return whether the attribute names something that exists; report a legal name that does not."""
    name = element.text(attribute)
    if name in known:
        return True
    if is_legal(name):
        there = f"There is: {names}" if (names := listed(known)) else f"Declare a {what} of this name"
        hint = report.hint(name, known)
        own = "; a class of your own needs a <type> in <types>" if what in NAMES_OF_TYPES and not hint else ""
        report.fault(element.place_of(attribute), f"no {what} is named {quoted(name)}{hint}", there + own)
    return False


def check_unique(elements: Iterable[Element], attribute: str, what: str, report: Report) -> None:
    """Report every element that repeats another's value."""
    first: dict[str, Element] = {}
    for element in elements:
        name = element.text(attribute)
        before = first.setdefault(name, element)
        if name and before is not element:
            report.fault(
                element.place_of(attribute),
                f"a second {what} {quoted(name)}; the first is in line {before.place.line}",
                "Give each its own name, or remove one",
            )


def check_multiplicity(
    element: Element, attribute: str, what: str, tables: Tables, of_one: dict[str, Element], report: Report
) -> None:
    """Report an element that is the second of a type of which only one may run.

    Args:
        attribute: Names the type.
        what: The type, for people.
        of_one: Type → its first element; the caller keeps it.
    """
    kind = element.text(attribute)
    if kind not in tables.types or tables.types[kind].text("multiplicity") != Multiplicity.ONE:
        return
    before = of_one.setdefault(kind, element)
    if before is not element:
        report.fault(
            element.place_of(attribute),
            f"a second {what}, of which only one may run; the first is in line {before.place.line}",
            'Remove one, or write multiplicity="many" at the type',
        )


def check_parameters(element: Element, reserved: Collection[str], report: Report) -> None:
    """Report parameters that occur twice, and those that other parts of the file set."""
    given = element.all("parameter")
    check_unique(given, "name", "parameter", report)
    for parameter in given:
        if parameter.text("name") in reserved:
            report.fault(
                parameter.place_of("name"),
                f"parameter {quoted(parameter.text('name'))} of a <{element.tag}> is set by the rest of the file",
                f"Give the parameter another name; taken are: {listed(sorted(reserved))}",
            )


def check_host(element: Element, tables: Tables, report: Report) -> None:
    """Report a host that does not exist, or that cannot run the element's type."""
    if not element.text("host") or not is_known(element, "host", "host", tables.hosts, report):
        return
    component_type = tables.types.get(element.text("type"))
    if component_type is None:
        return
    lacking = host_tags_lacking(tables.hosts[element.text("host")], component_type)
    if lacking:
        report.fault(
            element.place_of("host"),
            f"host {element.text('host')} lacks {listed(lacking)}, which type {element.text('type')} asks for",
            "Name a host with these tags, or add them to the host",
        )


def _by_type(resources: list[Element]) -> dict[str, list[Element]]:
    found: dict[str, list[Element]] = {}
    for resource in resources:
        found.setdefault(resource.text("type"), []).append(resource)
    return found


def _by_name(elements: list[Element]) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for element in elements:
        if is_legal(element.text("name")):
            found.setdefault(element.text("name"), element)
    return found
