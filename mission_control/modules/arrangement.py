"""Arrangement: units as a mission file declares them, with the connections between them worked out.

The same modules in other units are another arrangement, and nothing else changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import msgspec

from backbone.naming import Subsystem, address
from mission_control.modules.graph import Graph
from mission_control.modules.orders import ModuleOrder, Source, UnitParameters, load_module_class, output_address
from mission_control.modules.unit_schedule import Trigger


class UnitOrder(Trigger, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A unit.

    Attributes:
        name: Of the component that runs it.
        modules: What it runs; where nothing else orders them, in this order.
    """

    name: str
    modules: list[ModuleOrder]


class GivenKey(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A key whose values come from outside.

    Attributes:
        type: Class of the values, ``package.module:Class``.
        source: Where they are published.
    """

    type: str
    source: Source


def arranged(units: Sequence[UnitOrder], given: Mapping[str, GivenKey]) -> dict[str, UnitParameters]:
    """Return unit → parameters of the component that runs it.

    What another unit takes is published, and what no other module takes: it is there for others.

    Raises:
        WrongModule: A class path leads to no module.
        GraphRefused: The modules cannot be connected; it says everything at once.
    """
    members = {unit.name: [one.member(load_module_class(one.class_path)) for one in unit.modules] for unit in units}
    graph = Graph(members, {key: one.type for key, one in given.items()})
    every = [member for of in members.values() for member in of]
    found = {}
    for unit in units:
        final = {
            key
            for member in members[unit.name]
            for key, _port in member.keyed_outputs
            if not any(key == taken for other in every if other is not member for taken, _ in other.keyed_inputs)
        }
        sources = {
            key: Source(output_address(address(Subsystem.MISSION_CONTROL, producer), key))
            if producer
            else given[key].source
            for key, producer in graph.into(unit.name).items()
        }
        published = sorted({*graph.out_of(unit.name), *final})
        found[unit.name] = UnitParameters(
            frequency_hz=unit.frequency_hz,
            on_input=unit.on_input,
            modules=unit.modules,
            sources=sources,
            published=published,
        )
    return found
