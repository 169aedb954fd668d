"""Databases that know kinds of ARC and hardware, so that consoles know what their operators can do with these."""

from __future__ import annotations

from collections.abc import Sequence

from backbone.addresses import COMPONENT_DATABASE, DEPENDENCY_DATABASE
from backbone.bus.interface import Bus
from backbone.component.component import Component
from backbone.component_database.messages import ComponentType, ListTypes, TypeCount, Types
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.naming import Subsystem
from backbone.wire import Envelope, Message
from resource_pool.arcs.skeleton import LitDriveArc
from resource_pool.rcs.scout import Scout
from resource_pool.rcs.skeleton import Lamp


def lit_types(name: str) -> list[ComponentType]:
    """Return the types of a robot with a lamp; its kind of ARC has this name."""
    made: list[tuple[str, type[Component], dict[str, str]]] = [  # type: ignore[type-arg]  of any parameters
        ("scout", Scout, {}),
        ("lamp", Lamp, {}),
        (name, LitDriveArc, LitDriveArc.kinds()),
    ]
    return [
        ComponentType(kind, "x:Y", Subsystem.RESOURCE_POOL, needs=needs, abilities=cls.abilities())
        for kind, cls, needs in made
    ]


def serve_types(bus: Bus, types: Sequence[ComponentType]) -> None:
    """Answer on this bus as the component database."""

    async def answer(_asked: Envelope[Message]) -> Message:
        return Types([TypeCount(one, 1) for one in types])

    bus.serve(COMPONENT_DATABASE, ListTypes, answer)
    bus.declare_alive(COMPONENT_DATABASE)


def serve_resources(bus: Bus, resources: Sequence[Resource]) -> None:
    """Answer on this bus as the dependency database."""

    async def answer(_asked: Envelope[Message]) -> Message:
        return Resources(list(resources))

    bus.serve(DEPENDENCY_DATABASE, AskResources, answer)
    bus.declare_alive(DEPENDENCY_DATABASE)
