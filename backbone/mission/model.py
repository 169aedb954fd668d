"""What a checked mission file says. Immutable; made by ``reader.read_mission`` only."""

from __future__ import annotations

import ipaddress
from typing import Any

from pydantic import BaseModel, ConfigDict

from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource

HUB_PORT = 7447  # Zenoh's own


def is_loopback(address: str) -> bool:
    """Say whether this IP address or name means the machine itself."""
    try:
        return ipaddress.ip_address(address).is_loopback
    except ValueError:
        return address == "localhost"


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class Host(_Part):
    """A machine that may run components.

    Attributes:
        name: Name used elsewhere in the file.
        address: IP address or name the hub is reached at; ``127.0.0.1`` for this machine.
        tags: What it has (``gl``, ``serial``), for placement.
        port: TCP port of the hub for other machines; of the first host only.
    """

    name: str
    address: str
    tags: tuple[str, ...] = ()
    port: int = HUB_PORT

    @property
    def is_loopback(self) -> bool:
        """True if the address means the machine 'up' is typed on, whatever machine that is."""
        return is_loopback(self.address)


class CoreService(_Part):
    """A core service and where it runs.

    Attributes:
        type: Component type.
        host: Where.
        parameters: What the file sets of its parameters.
    """

    type: str
    host: str
    parameters: dict[str, Any] = {}


class Component(_Part):
    """A component the mission starts at its beginning, besides RCs and behaviors (the simulated world).

    Attributes:
        type: Component type.
        name: Its name.
        host: Where; empty: the placer decides.
        parameters: Values for the class's parameters.
        process: Name of the process it shares with others; empty: a process of its own.
    """

    type: str
    name: str
    host: str = ""
    parameters: dict[str, Any] = {}
    process: str = ""


class ArcWish(_Part):
    """The ARC a behavior needs.

    Attributes:
        kind: Component type of the ARC.
        wish: Kind of RC → name.
        features: Kind of RC → features.
        minimum_runtime_s: Shortest useful time, seconds.
        maximum_runtime_s: End of extensions, 0: the minimum.
        period_s: Interval between radio packets, seconds.
        packet_time_s: Air time of one packet, seconds.
    """

    kind: str
    wish: dict[str, str] = {}
    features: dict[str, tuple[str, ...]] = {}
    minimum_runtime_s: float
    maximum_runtime_s: float = 0.0
    period_s: float
    packet_time_s: float


class Behavior(_Part):
    """A node of the behavior tree.

    Attributes:
        type: Component type.
        name: Name of the node and of its component.
        priority: Among its siblings; larger is higher.
        parameters: Values for the class's parameters.
        arc: The ARC it needs, if any.
        children: Nodes its parent starts.
        process: Name of the process it shares with others; empty: a process of its own.
    """

    type: str
    name: str
    priority: int
    parameters: dict[str, Any] = {}
    arc: ArcWish | None = None
    children: tuple[Behavior, ...] = ()
    process: str = ""


class MissionDescription(_Part):
    """A whole mission.

    Attributes:
        name: Name of the mission; the default key of its run.
        priority: Of the behavior tree's root among the consoles; larger is higher.
        hosts: Machines; the first runs the nameserver.
        core: Core services in the papers' order of start.
        types: Component types.
        resources: Hardware.
        components: Further components to start, in this order, before the behaviors.
        behaviors: Roots of the behavior tree, children of the mission's own node.
        source: Path of the file.
    """

    name: str
    priority: int
    hosts: tuple[Host, ...]
    core: tuple[CoreService, ...]
    types: tuple[ComponentType, ...]
    resources: tuple[Resource, ...]
    components: tuple[Component, ...]
    behaviors: tuple[Behavior, ...]
    source: str

    @property
    def other_hosts(self) -> tuple[Host, ...]:
        """Machines besides the one that runs the nameserver; each offers itself by a command typed there."""
        return tuple(host for host in self.hosts[1:] if not host.is_loopback)

    def core_parameters(self, service: str) -> dict[str, Any]:
        """Return what the file sets of a core service's parameters, of the first of this type."""
        return next((dict(core.parameters) for core in self.core if core.type == service), {})
