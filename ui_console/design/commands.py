"""What can be done to a mission while it is designed, and how it is refused.

Pure: values. What they do is in ``effects``.
"""

from __future__ import annotations

from dataclasses import dataclass

from backbone.errors import Refusal
from backbone.mission.edit import NewElement, Path


class DesignRefused(Refusal):
    """A command that cannot be done as it was meant; the draft is as it was."""

    code = "design.refused"
    remedy = "Choose something else."


class NameTaken(DesignRefused):
    """Two of a kind would have one name, and what refers to it would mean both."""

    code = "design.name_taken"
    remedy = "Give it a name that nobody has."


class NothingToUndo(DesignRefused):
    """There is no step in this direction."""

    code = "design.no_step"
    remedy = "Nothing was done, or all of it is undone."


@dataclass(frozen=True, slots=True)
class Add:
    """Add an element as it is given."""

    parent: Path
    element: NewElement
    at: int | None = None


@dataclass(frozen=True, slots=True)
class AddType:
    """Declare a type that the project brings along, with the types it needs; those that are declared stay."""

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
class Claim:
    """Have a behavior claim an ARC, in place of the one it claims; the kind is declared if need be."""

    behavior: Path
    kind: str
    minimum_runtime_s: str


@dataclass(frozen=True, slots=True)
class AddResource:
    """Add a piece of hardware in its first shape, tied to what there is, and its body if there is a world."""

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
class Move:
    """Put an element elsewhere; ``at`` is its number among its siblings afterwards."""

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
class SetParameter:
    """Set a parameter of a behavior, a resource or a service; None leaves it out."""

    path: Path
    name: str
    value: str | None


@dataclass(frozen=True, slots=True)
class Rename:
    """Rename an element, and with it whatever refers to it."""

    path: Path
    name: str


Command = (
    Add | AddType | AddBehavior | Claim | AddResource | AddWorld | Remove | Move | SetValue | SetParameter | Rename
)
