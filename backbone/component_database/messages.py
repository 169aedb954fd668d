"""Messages to the component database."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from backbone.component.abilities import NO_ABILITIES, Abilities
from backbone.errors import Refusal
from backbone.naming import Subsystem
from backbone.ranges import FEW, MANY, Count, Line, Mention
from backbone.wire import Message


class Multiplicity(StrEnum):
    """Number of components of a type that may run at the same time (RAM 2002, "Backbone")."""

    ONE = "one"
    MANY = "many"


class ComponentType(Message, frozen=True, tag="ComponentType/2"):
    """One kind of component.

    Attributes:
        name: Type name in the mission file.
        class_path: ``package.module:Class``.
        subsystem: Subsystem of its components.
        multiplicity: How many of them may run.
        core: True for core services, which only the bring-up starts.
        tags: Tags that a host of its components must have.
        restart: True if the creator restarts its components after every end without an order; False: the owner must ask
            for a new start.
        needs: Role → kind of RC that an ARC holds; empty if it is no ARC type.
        abilities: Commands and reports of its components.
        shares_process: Whether the placer may put its components into a process with others.
        alike_most: Most of its components that the placer puts into one process with each other; 1: none.
    """

    name: Mention
    class_path: Line
    subsystem: Subsystem
    multiplicity: Multiplicity = Multiplicity.MANY
    core: bool = False
    tags: Annotated[list[Mention], FEW] = []
    restart: bool = True
    needs: Annotated[dict[Mention, Mention], FEW] = {}
    abilities: Abilities = NO_ABILITIES
    shares_process: bool = True
    alike_most: Count = 1


class Admit(Message, frozen=True):
    """Ask to admit one more component of this type under this name."""

    type: Mention
    name: Mention


class Admitted(Message, frozen=True):
    """Answer to ``Admit``: admitted, with its type."""

    component_type: ComponentType


class ListTypes(Message, frozen=True):
    """Ask for all component types."""


class TypeCount(Message, frozen=True):
    """A type and the number of its running components."""

    component_type: ComponentType
    running: Count


class Types(Message, frozen=True):
    """Answer to ``ListTypes``, sorted by name."""

    types: Annotated[list[TypeCount], MANY]


class UnknownType(Refusal):
    """No component type of this name exists in this mission."""

    code = "component_database.unknown"
    remedy = "Declare the type in the mission file, or use one that 'scout-backbone components' lists."


class MultiplicityExceeded(Refusal):
    """The multiplicity of the type allows no further one; facts: ``name``, ``host``, ``pid`` of the running one."""

    code = "component_database.multiplicity"
    remedy = "Use the one that runs, or stop it first."


class CoreService(Refusal):
    """Only the bring-up starts core services."""

    code = "component_database.core"
    remedy = "Nothing to do: 'scout-backbone up' starts core services, and restarts them."


class RunningUnknown(Refusal):
    """The nameserver does not answer, so the running components are unknown and nothing is admitted."""

    code = "component_database.running_unknown"
    remedy = "Ask again when the nameserver is back."


ComponentDatabaseQuestion = Admit | ListTypes
