"""Catalogue of component types, with their roles and parameters.

Types come from the project's own list and from the designed file. Another process reads the documentation and
parameters of their classes (``look_up``), because the import of a behavior imports OpenCV.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from importlib import resources

from backbone.mission.class_facts import ClassFacts
from backbone.mission.edit import Element, outline
from backbone.mission.model import EXECUTION_UNIT
from backbone.mission.shipped_types import shipped_text
from backbone.naming import Subsystem


class Role(StrEnum):
    """Role of a type."""

    BEHAVIOR = "behavior"
    ARC = "ARC"
    RESOURCE = "resource"
    WORLD = "world"
    SERVICE = "service"
    CONSOLE = "console"


@dataclass(frozen=True, slots=True)
class TypeEntry:
    """A component type.

    Attributes:
        name: Its name in mission files.
        needs: Role → type of resource that an ARC needs.
        uses: Types of resource to which a resource must be linked.
        is_stock: True: the project ships it.
        is_declared: True: the designed file declares it.
    """

    name: str
    class_path: str
    role: Role
    needs: Mapping[str, str]
    uses: tuple[str, ...]
    is_stock: bool
    is_declared: bool


def stock() -> Element:
    """Return the project's own types, as a mission without other content."""
    return outline(shipped_text())


def new_text() -> bytes:
    """Return the text of a new mission: one host."""
    return resources.files("ui_console.design").joinpath("new.xml").read_bytes()


def stock_type(name: str) -> Element | None:
    """Return the type of this name from the project's own list."""
    return _types().get(name)


def stock_resource(kind: str) -> Element | None:
    """Return the initial content of a resource of this type."""
    return next((one for one in _shapes() if one.text("type") == kind), None)


def entries(mission: Element) -> list[TypeEntry]:
    """Return every type: the file's own in its order, then the project's.

    Args:
        mission: The designed file.
    """
    section = mission.first("types")
    declared = [] if section is None else section.all("type")
    names = {one.text("name") for one in declared}
    world = mission.first("world")
    world_type = (world.text("type") if world is not None else "") or "simulated_world"
    known = _types()
    own = [_entry(one, world_type, is_stock=one.text("name") in known, is_declared=True) for one in declared]
    rest = [
        _entry(one, world_type, is_stock=True, is_declared=False) for name, one in known.items() if name not in names
    ]
    return own + rest


def description(entry: TypeEntry, facts: Mapping[str, ClassFacts]) -> list[str]:
    """Return the description of a type, as lines for people.

    Args:
        facts: Class path → facts of the class.
    """
    lines = [f"{entry.name}: {entry.role}, {entry.class_path}"]
    if entry.needs:
        lines.append(f"holds one each of: {', '.join(entry.needs)}")
    if entry.uses:
        lines.append(f"tied to: {', '.join(entry.uses)}")
    known = facts.get(entry.class_path)
    if known is None:
        return [*lines, "", "not looked up"]
    if known.failure:
        return [*lines, "", known.failure]
    lines += ["", *known.doc.splitlines(), ""]
    if not known.parameters:
        return [*lines, "no parameters"]
    for one in known.parameters:
        lines.append(f"{one.name}: {one.summary}")
        if one.doc:
            lines.append(f"    {one.doc}")
    return lines


@lru_cache(maxsize=1)
def _types() -> dict[str, Element]:
    found = stock().first("types")
    return {} if found is None else {one.text("name"): one for one in found.children}


@lru_cache(maxsize=1)
def _shapes() -> tuple[Element, ...]:
    shapes = outline(resources.files("ui_console.design").joinpath("stock.xml").read_bytes())
    found = shapes.first("resources")
    return () if found is None else tuple(found.children)


def _entry(declared: Element, world_type: str, *, is_stock: bool, is_declared: bool) -> TypeEntry:
    needs = {needed.text("role") or needed.text("type"): needed.text("type") for needed in declared.all("needs")}
    return TypeEntry(
        declared.text("name"),
        declared.text("class"),
        _role(declared, needs, world_type),
        needs,
        tuple(declared.text("uses").split()),
        is_stock,
        is_declared,
    )


def _role(declared: Element, needs: Mapping[str, str], world_type: str) -> Role:
    match declared.text("subsystem"):
        case Subsystem.MISSION_CONTROL:
            return Role.SERVICE if declared.text("name") == EXECUTION_UNIT else Role.BEHAVIOR
        case Subsystem.UI_CONSOLE:
            return Role.CONSOLE
        case Subsystem.BACKBONE:
            return Role.SERVICE
        case _ if needs:
            return Role.ARC
        case _:
            return Role.WORLD if declared.text("name") == world_type else Role.RESOURCE
