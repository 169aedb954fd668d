"""The elements of a mission file, from the innermost to the mission; those of the world have a file of their own."""

from __future__ import annotations

from pydantic import Field

from backbone.authentication import HUB_PORT
from backbone.component_database.messages import Multiplicity as MultiplicityWord
from backbone.mission.declaration.module_elements import ModulesElement
from backbone.mission.declaration.parts import PROCESS, Declared, ParameterElement
from backbone.mission.declaration.values import (
    Address,
    Capacity,
    ClassPath,
    Driver,
    Duration,
    Flag,
    Multiplicity,
    Name,
    Names,
    Port,
    Priority,
    Seconds,
    Subsystem,
)
from backbone.mission.declaration.world_elements import WorldElement


class HostElement(Declared):
    """A machine that may run components."""

    name: Name = Field(description="Name of the machine within this file.")
    address: Address = Field(description="IP address or host name; 127.0.0.1 is the machine on which 'up' is typed.")
    tags: Names = Field(
        default=(), description="Abilities of the machine, as names separated by blanks; types can require them."
    )
    port: Port = Field(
        default=HUB_PORT,
        description=(
            "TCP port at which other machines reach the first host's hub, 1 to 65535; other hosts have none, and "
            "without other machines no port is open."
        ),
    )


class HostsElement(Declared):
    """The machines; the first one runs the core services. Left out: one host, base, on which 'up' is typed."""

    host: tuple[HostElement, ...] = ()


class ServiceElement(Declared):
    """A core service: nameserver, component_database, placer, dependency_database, rc_manager or creator."""

    type: Name = Field(description="Its component type.")
    host: Name = Field(default="", description="The host it runs on; left out: the first.")
    parameter: tuple[ParameterElement, ...] = ()


class CoreElement(Declared):
    """Settings of the core services.

    A core service that is left out runs, too: creator on every host, the others on the first.
    """

    service: tuple[ServiceElement, ...] = ()


class NeedsElement(Declared):
    """A kind of resource of which an ARC needs one."""

    type: Name = Field(description="The component type of that resource.")
    role: Name = Field(default="", description="Its role in the ARC; left out: named like the type.")


class TypeElement(Declared):
    """A component type; it replaces a shipped type of the same name.

    A type with needs inside is an ARC, a set of resources that is claimed and released as a whole.
    """

    name: Name = Field(description="Name of the type, used wherever this file says type or kind.")
    class_path: ClassPath = Field(
        alias="class", description="The Python class that runs it, written package.module:Class."
    )
    subsystem: Subsystem = Field(
        description="Subsystem of its components: backbone, resource_pool, mission_control or ui_console."
    )
    multiplicity: Multiplicity = Field(
        default=MultiplicityWord.MANY, description="How many may run at the same time: one or many."
    )
    core: Flag = Field(
        default=False, description="Whether it is a core service, true or false; only the six of the papers are."
    )
    tags: Names = Field(default=(), description="Tags a host must have to run it, as names separated by blanks.")
    restart: Flag = Field(
        default=True,
        description=(
            "Whether it is started again after any end, unless it was ordered to stop; false: its owner asks for "
            "another one."
        ),
    )
    uses: Names = Field(
        default=(), description="Types of resource: each resource of this type must name one of each by a uses element."
    )
    needs: tuple[NeedsElement, ...] = ()


class TypesElement(Declared):
    """The mission's own component types, in addition to the shipped ones."""

    type: tuple[TypeElement, ...] = ()


class UsesElement(Declared):
    """Another resource that this one needs to work; several of one type are alternatives."""

    type: Name = Field(description="Component type of the other resource.")
    name: Name = Field(description="Name of the other resource.")


class ResourceElement(Declared):
    """A physical resource."""

    type: Name = Field(description="Component type of its resource controller.")
    name: Name = Field(description="Name of the resource and of its controller.")
    host: Name = Field(default="", description="The host its hardware is wired to; left out: any.")
    sharable: Flag = Field(
        default=False, description="Whether several ARCs may hold it at once within its capacity, true or false."
    )
    capacity: Capacity = Field(
        default=1.0, description="Share of its time a sharable resource can give, above 0, at most 1."
    )
    connect_s: Seconds = Field(
        default=0.0,
        description=(
            "Settling time, from the order to connect until it can be used, tuning included; seconds, 0 or more, at "
            "most a day."
        ),
    )
    disconnect_s: Seconds = Field(
        default=0.0, description="Time from the order to disconnect until it is free, seconds, 0 to a day."
    )
    driver: Driver = Field(
        default="simulated",
        description=(
            "Name of the driver its controller uses, or its class, written package.module:Class; 'simulated' is played "
            "by the mission's world."
        ),
    )
    features: Names = Field(default=(), description="Its features (camera), as names separated by blanks, for wishes.")
    process: Name = PROCESS
    uses: tuple[UsesElement, ...] = ()
    parameter: tuple[ParameterElement, ...] = ()


class ResourcesElement(Declared):
    """The hardware; each resource is run by a resource controller of the same name."""

    resource: tuple[ResourceElement, ...] = ()


class WishElement(Declared):
    """The resource that an ARC should get for a role, by name, features, or both. A role without a wish gets any."""

    type: Name = Field(description="The role in the ARC: the type of resource, unless its needs element names a role.")
    name: Name = Field(default="", description="Name of the wanted resource.")
    features: Names = Field(default=(), description="Features it must have, as names separated by blanks.")


class ArcAttributes(Declared):
    """The attributes in the tag of an ARC."""

    kind: Name = Field(description="Component type of the ARC, one with needs.")
    minimum_runtime_s: Duration = Field(
        description="Shortest time in which the behavior can do something useful, seconds, above 0, at most a day."
    )
    maximum_runtime_s: Seconds = Field(
        default=0.0, description="Longest slice with all extensions, seconds, at least the minimum; 0: the minimum."
    )
    period_s: Duration = Field(
        default=0.05, description="Interval between its radio packets, seconds, above 0, at most a day."
    )
    packet_time_s: Duration = Field(
        default=0.002,
        description=(
            "Time one of its radio packets is on the air, seconds, above 0, at most a day; a longer one that the radio "
            "measures counts instead."
        ),
    )


class ArcElement(ArcAttributes):
    """The set of resources that a behavior claims, with its run times and its use of the radio."""

    wish: tuple[WishElement, ...] = ()


class BehaviorAttributes(Declared):
    """The attributes in the tag of a behavior."""

    type: Name = Field(description="Its component type, of subsystem mission_control.")
    name: Name = Field(description="Name of the behavior, unique in the mission.")
    priority: Priority = Field(description="Its priority among its siblings, a whole number; larger is higher.")
    process: Name = PROCESS


class BehaviorElement(BehaviorAttributes):
    """A node of the behavior tree; the behaviors inside it are its children."""

    parameter: tuple[ParameterElement, ...] = ()
    arc: ArcElement | None = None
    behavior: tuple[BehaviorElement, ...] = ()


class LastElement(Declared):
    """The last branch of the behavior tree; it starts when the mission is ordered to end.

    Then consoles and all other behaviors are stopped, the hardware stays up, and the branch runs until it has finished
    or its time is over.
    """

    within_s: Duration = Field(
        default=60.0,
        description="Longest run of the branch, seconds of the mission, above 0, at most a day; then the mission ends.",
    )
    behavior: BehaviorElement


class BehaviorsElement(Declared):
    """The behavior tree's roots, and the branch that runs at the end."""

    behavior: tuple[BehaviorElement, ...] = ()
    last: LastElement | None = None


class MissionElement(Declared):
    """A whole mission: machines, core services, component types, hardware, world, modules and behaviors."""

    name: Name = Field(description="Name of the mission; missions with different names can run side by side.")
    priority: Priority = Field(
        description="Priority of the whole mission among the consoles, a whole number; larger is higher."
    )
    hosts: HostsElement | None = None
    core: CoreElement | None = None
    types: TypesElement | None = None
    resources: ResourcesElement | None = None
    world: WorldElement | None = None
    modules: ModulesElement | None = None
    behaviors: BehaviorsElement | None = None
