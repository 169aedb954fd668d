"""Commands that change a mission while it is designed, and their refusals.

Pure: values. ``effects`` carries them out.
"""

from __future__ import annotations

from dataclasses import dataclass

from backbone.errors import Refusal
from backbone.mission.edit import NewElement, Path


class DesignRefused(Refusal):
    """A command is not possible; the draft is as it was."""

    code = "design.refused"
    remedy = "Choose something else."


class ElementNameTaken(DesignRefused):
    """Two elements of a kind would have one name, so a reference to it would mean both."""

    code = "design.name_taken"
    remedy = "Give it a name that no other element has."


class NothingToUndo(DesignRefused):
    """There is no step in this direction."""

    code = "design.no_step"
    remedy = "Nothing was done, or all of it is undone."


@dataclass(frozen=True, slots=True)
class Add:
    """Add a given element."""

    parent: Path
    element: NewElement
    at: int | None = None


@dataclass(frozen=True, slots=True)
class AddType:
    """Declare a type that the project ships, with the types it needs; declared types stay."""

    name: str


@dataclass(frozen=True, slots=True)
class AddBehavior:
    """Add a node of the behavior tree, and declare its type if need be.

    Attributes:
        parent: A behavior; the mission or its ``<behaviors>`` for a root.
        type: Its type.
        name: Its name.
        priority: Among its siblings.
    """

    parent: Path
    type: str
    name: str
    priority: int = 1


@dataclass(frozen=True, slots=True)
class ClaimArc:
    """Set the ARC that a behavior claims, in place of its present one; the kind is declared if need be."""

    behavior: Path
    kind: str
    minimum_runtime_s: str


@dataclass(frozen=True, slots=True)
class AddResource:
    """Add a piece of hardware in its first shape, tied to existing hardware, and its body if there is a world."""

    type: str
    name: str


@dataclass(frozen=True, slots=True)
class AddWorld:
    """Add the simulated room, with a body for every robot."""

    width_m: str
    depth_m: str


@dataclass(frozen=True, slots=True)
class Remove:
    """Remove an element and all in it; with a robot goes its body."""

    path: Path


@dataclass(frozen=True, slots=True)
class Relocate:
    """Move an element; ``at`` is its number among its siblings afterwards."""

    path: Path
    parent: Path
    at: int


@dataclass(frozen=True, slots=True)
class SetValue:
    """Set an attribute; None leaves it out."""

    path: Path
    attribute: str
    value: str | None


@dataclass(frozen=True, slots=True)
class WriteParameter:
    """Set a parameter of a behavior, a resource or a service; None leaves it out."""

    path: Path
    name: str
    value: str | None


@dataclass(frozen=True, slots=True)
class Rename:
    """Rename an element, and all references to it."""

    path: Path
    name: str


Command = (
    Add
    | AddType
    | AddBehavior
    | ClaimArc
    | AddResource
    | AddWorld
    | Remove
    | Relocate
    | SetValue
    | WriteParameter
    | Rename
)
