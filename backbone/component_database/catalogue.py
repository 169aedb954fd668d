"""Catalogue: the component types of a mission, and admission control by multiplicity.

Rules:

* A type of multiplicity ONE may run once, all other types any number of times (RAM 2002, "Backbone").
* Core services are never admitted; the refusal contains name and host of the running one.
* The nameserver knows the running components; here they are an argument.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from backbone.component.messages import ComponentState
from backbone.component_database.messages import (
    ComponentType,
    CoreService,
    Multiplicity,
    MultiplicityExceeded,
    TypeCount,
    UnknownType,
)
from backbone.naming import component_of, did_you_mean


class Catalogue:
    """All component types of one mission.

    Args:
        types: Component types with unique names.
    """

    def __init__(self, types: Iterable[ComponentType]) -> None:
        self._types = {component_type.name: component_type for component_type in types}

    def find(self, type_name: str) -> ComponentType:
        """Return the type of this name.

        Raises:
            UnknownType: The mission has no type of this name.
        """
        found = self._types.get(type_name)
        if found is None:
            raise UnknownType(
                f"no component type {type_name!r} exists{did_you_mean(type_name, self._types)}", type=type_name
            )
        return found

    def depends_on_what_runs(self, type_name: str) -> bool:
        """Return whether admission of this type depends on the running components.

        Raises:
            UnknownType: The mission has no type of this name.
        """
        component_type = self.find(type_name)
        return component_type.core or component_type.multiplicity is Multiplicity.ONE

    def admit(self, type_name: str, name: str, running: Sequence[ComponentState]) -> ComponentType:
        """Return the type if one more component of it may start under this name.

        Args:
            running: All registered components.

        Raises:
            UnknownType: The mission has no type of this name.
            MultiplicityExceeded: One runs already; facts: its ``name``, ``host``, ``pid``.
            CoreService: It is a core service that does not run now.
        """
        component_type = self.find(type_name)
        one = component_type.core or component_type.multiplicity is Multiplicity.ONE
        for state in running:
            if one and state.type == type_name:
                holder = component_of(state.address)
                raise MultiplicityExceeded(
                    f"{name}: only one {type_name} may run, and {holder} runs on {state.host}, pid {state.pid}",
                    name=holder,
                    host=state.host,
                    pid=state.pid,
                )
        if component_type.core:
            raise CoreService(f"{name}: {type_name} is a core service", type=type_name)
        return component_type

    def counts(self, running: Iterable[ComponentState]) -> list[TypeCount]:
        """Return every type with the number of its running components, sorted by name."""
        many = Counter(state.type for state in running)
        return [TypeCount(self._types[name], many[name]) for name in sorted(self._types)]
