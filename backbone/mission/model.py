"""Content of a checked mission file, independent of its notation. Immutable."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import msgspec

from backbone.authentication import HUB_PORT, is_loopback
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.mission.behavior_nodes import BehaviorNode

EXECUTION_UNIT = "execution_unit"  # the shipped type that runs modules


class Host(msgspec.Struct, frozen=True, kw_only=True):
    """A machine that may run components.

    Attributes:
        name: Name of the machine within the mission.
        address: IP address or host name.
        tags: Abilities of the machine, which types can require.
        port: TCP port at which other machines reach the first host's hub.
    """

    name: str
    address: str
    tags: tuple[str, ...] = ()
    port: int = HUB_PORT

    @property
    def is_loopback(self) -> bool:
        """True if the address means the machine on which 'up' is typed, without its name."""
        return is_loopback(self.address)


class CoreServiceDescription(msgspec.Struct, frozen=True, kw_only=True):
    """A core service and where it runs.

    Attributes:
        parameters: Its parameters from the file.
    """

    type: str
    host: str
    parameters: dict[str, Any] = {}


class ComponentDescription(msgspec.Struct, frozen=True, kw_only=True):
    """A component that the mission starts at its beginning, except RCs and behaviors: the world, an execution unit.

    Attributes:
        host: Its host; empty: the placer decides.
        parameters: Values for the class's parameters.
        process: Name of the process it shares with others; empty: a process of its own.
    """

    type: str
    name: str
    host: str = ""
    parameters: dict[str, Any] = {}
    process: str = ""


class LastBranchDescription(msgspec.Struct, frozen=True, kw_only=True):
    """The branch of the behavior tree that runs when the mission is ordered to end.

    Attributes:
        behavior: Its root.
        within_s: Its time from its start, seconds of the mission, above 0.
    """

    behavior: BehaviorNode
    within_s: float


class MissionDescription(msgspec.Struct, frozen=True, kw_only=True):
    """A whole mission.

    Attributes:
        name: Name of the mission; the default key of its run.
        priority: Priority of the behavior tree's root among the consoles; larger is higher.
        hosts: Machines; the first runs the nameserver.
        core: Core services in the papers' order of start.
        types: Component types.
        components: Further components to start, in this order, before the behaviors.
        units: Execution units, started after the hardware and before the behaviors.
        behaviors: Roots of the behavior tree, children of the mission's own node.
        source: Path of the file.
        last: The branch that runs at the end, instead of the other behaviors; None: none.
    """

    name: str
    priority: int
    hosts: tuple[Host, ...]
    core: tuple[CoreServiceDescription, ...]
    types: tuple[ComponentType, ...]
    resources: tuple[Resource, ...]
    components: tuple[ComponentDescription, ...]
    behaviors: tuple[BehaviorNode, ...]
    source: str
    last: LastBranchDescription | None = None
    units: tuple[ComponentDescription, ...] = ()

    @property
    def other_hosts(self) -> tuple[Host, ...]:
        """Machines except the one that runs the nameserver; a command typed on each offers it to the mission."""
        return tuple(host for host in self.hosts[1:] if not host.is_loopback)

    @property
    def at_the_end(self) -> MissionDescription | None:
        """The mission while its last branch runs, which is then its only behavior; None: there is no last branch."""
        if self.last is None:
            return None
        return msgspec.structs.replace(self, behaviors=(self.last.behavior,), last=None)

    def core_parameters(self, service: str) -> dict[str, object]:
        """Return the parameters that the file sets of a core service, of the first one of this type."""
        return next((dict(core.parameters) for core in self.core if core.type == service), {})

    def placed_types(self) -> Iterator[str]:
        """Yield the type of each component, resource, unit and behavior in the file, but not of ARCs."""
        yield from (resource.type for resource in self.resources)
        yield from (one.type for one in (*self.components, *self.units))
        waiting = [*self.behaviors]
        while waiting:
            behavior = waiting.pop()
            yield behavior.type
            waiting += behavior.children
