"""Properties of an element: its attributes and parameters, with their meanings and choices.

Pure. Meanings and defaults come from the schema; for parameters, from the class.
"""

from __future__ import annotations

from collections.abc import Mapping

import msgspec

from backbone.mission.class_facts import ClassFacts
from backbone.mission.declaration.vocabulary import vocabulary
from backbone.mission.edit import Element, Path
from backbone.mission.tables import SIMULATED
from ui_console.design.catalogue import Role, entries
from ui_console.design.commands import DesignCommand
from ui_console.design.effects import rename, set_value, write_parameter

HAVE_PARAMETERS = ("behavior", "resource", "world")
WITH_NAMES = ("host", "type", "resource", "world", "behavior", "target", "robot")
"""Tags of elements to whose names other elements refer; setting such a name is a renaming."""


class Property(msgspec.Struct, frozen=True):
    """One attribute or parameter.

    Attributes:
        name: Its name.
        value: Its text; None: not written in the file.
        default: Its value if it is not written; None: no default.
        is_missing: True: it is required, and not written.
        is_parameter: True: it is a parameter.
        doc: Its meaning and range.
        choices: Possible values, if they can be listed.
    """

    name: str
    value: str | None
    default: str | None
    is_missing: bool
    is_parameter: bool
    doc: str
    choices: tuple[str, ...] = ()

    def command(self, path: Path, tag: str, value: str) -> DesignCommand:
        """Return the command that sets the property; an empty text removes it."""
        if self.is_parameter:
            return write_parameter(path, self.name, value or None)
        if self.name == "name" and tag in WITH_NAMES and value:
            return rename(path, value)
        return set_value(path, self.name, value or None)


def properties(mission: Element, node: Element, facts: Mapping[str, ClassFacts]) -> list[Property]:
    """Return all properties of an element, attributes first.

    Args:
        mission: The whole file.
        facts: Class path → facts of the class.
    """
    rule = vocabulary().get(node.tag)
    if rule is None:
        return []
    found = [
        Property(
            name,
            node.values.get(name),
            one.default,
            one.required and name not in node.values,
            is_parameter=False,
            doc=" ".join([one.documentation, *_built_in(mission, node, name, facts)]),
            choices=choices(mission, node, name, one.words),
        )
        for name, one in rule.attributes.items()
    ]
    return found + (_parameters(mission, node, facts) if node.tag in HAVE_PARAMETERS else [])


def choices(mission: Element, node: Element, attribute: str, words: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Return the possible values of an attribute at its place; empty if they cannot be listed."""
    match node.tag, attribute:
        case (_, "host"):
            return _names(mission, "hosts")
        case ("behavior", "type"):
            return _of_role(mission, Role.BEHAVIOR)
        case ("arc", "kind"):
            return _of_role(mission, Role.ARC)
        case ("resource", "type") | ("uses", "type") | ("needs", "type"):
            return _of_role(mission, Role.RESOURCE)
        case ("wish", "type"):
            arc = mission.at(node.path[:-1])
            return next((tuple(one.needs) for one in entries(mission) if one.name == arc.text("kind")), ())
        case ("wish", "name") | ("uses", "name"):
            resources = mission.first("resources")
            there = [] if resources is None else resources.all("resource")
            return tuple(one.text("name") for one in there if one.text("type") == node.text("type"))
        case ("robot", "carried-by"):
            world = mission.first("world")
            targets = [] if world is None else world.all("target")
            return tuple(one.text("name") for one in targets if one.text("shape") == "carrier")
        case _:
            return words


def class_of(mission: Element, node: Element) -> str:
    """Return the class path of an element's component; empty if that is not known."""
    return next((one.class_path for one in entries(mission) if one.name == node.text("type")), "")


def _built_in(mission: Element, node: Element, attribute: str, facts: Mapping[str, ClassFacts]) -> list[str]:
    """Return the names of the built-in drivers, which is no choice, because a class may be written as well."""
    known = facts.get(class_of(mission, node), ClassFacts())
    is_driver = node.tag == "resource" and attribute == known.driver_field == "driver"
    return [f"Built in: {', '.join(known.options)}."] if is_driver and known.options else []


def _parameters(mission: Element, node: Element, facts: Mapping[str, ClassFacts]) -> list[Property]:
    given = {one.text("name"): one.text("value") for one in node.all("parameter")}
    of_class = facts.get(class_of(mission, node), ClassFacts())
    driver = given.get(of_class.driver_field) or node.values.get("driver", SIMULATED)
    known = of_class.parameters_with(driver) or of_class.parameters
    found = [
        Property(
            one.name,
            given.get(one.name),
            one.default.strip('"') or None,
            is_missing=not one.default and one.name not in given,
            is_parameter=True,
            doc=" ".join(part for part in (one.doc, f"({one.summary})") if part),
            choices=one.words,
        )
        for one in known
    ]
    names = {one.name for one in known}
    doc = "Its class has no such parameter." if known else "Not looked up."
    return found + [
        Property(name, value, None, is_missing=False, is_parameter=True, doc=doc)
        for name, value in given.items()
        if name not in names
    ]


def _names(mission: Element, section: str) -> tuple[str, ...]:
    found = mission.first(section)
    return () if found is None else tuple(one.text("name") for one in found.children)


def _of_role(mission: Element, role: Role) -> tuple[str, ...]:
    return tuple(one.name for one in entries(mission) if one.role is role)
