"""What can be said to the component database."""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

from backbone.errors import Refusal
from backbone.naming import Subsystem
from backbone.ranges import FEW, MANY, Count, Line, Mention
from backbone.wire import Message

ADDRESS = "backbone/component_database"


class Multiplicity(StrEnum):
    """How many components of a type may run at the same time (RAM 2002, "Backbone")."""

    ONE = "one"
    MANY = "many"


class ComponentType(Message, frozen=True):
    """One kind of component.

    Attributes:
        name: Type name as used in the mission file.
        class_path: ``package.module:Class``.
        subsystem: Where its components belong.
        multiplicity: How many may run.
        core: True for core services, which only the bring-up starts.
        tags: Host tags its components need.
        restart: True if its creator restarts it however it ended, unless it was ordered to; False: its owner asks for
            another one.
        needs: Kinds of RC it holds one of each; empty if it is no ARC.
    """

    name: Mention
    class_path: Line
    subsystem: Subsystem
    multiplicity: Multiplicity = Multiplicity.MANY
    core: bool = False
    tags: Annotated[list[Mention], FEW] = []
    restart: bool = True
    needs: Annotated[list[Mention], FEW] = []


class Admit(Message, frozen=True):
    """May one more component of this type start under this name?"""

    type: Mention
    name: Mention


class Admitted(Message, frozen=True):
    """Answer to ``Admit``: yes, and this is its type."""

    component_type: ComponentType


class ListTypes(Message, frozen=True):
    """Which types are there?"""


class TypeCount(Message, frozen=True):
    """A type and how many of it run now."""

    component_type: ComponentType
    running: Count


class Types(Message, frozen=True):
    """Answer to ``ListTypes``, sorted by name."""

    types: Annotated[list[TypeCount], MANY]


class UnknownType(Refusal):
    """No component type of this name exists in this mission."""

    code = "component_database.unknown"
    remedy = "Declare the type in the mission file, or use one that 'scout-backbone status' lists."


class MultiplicityExceeded(Refusal):
    """As many of this type run as may; facts: ``name``, ``host``, ``pid`` of the one that runs."""

    code = "component_database.multiplicity"
    remedy = "Use the one that runs, or stop it first."


class CoreService(Refusal):
    """Core services are started by the bring-up alone."""

    code = "component_database.core"
    remedy = "Core services start with 'scout-backbone up' and are restarted by it."


class RunningUnknown(Refusal):
    """Who runs is not known now, so nothing can be admitted by it."""

    code = "component_database.running_unknown"
    remedy = "Ask again when the nameserver is back."


ComponentDatabaseQuestion = Admit | ListTypes
