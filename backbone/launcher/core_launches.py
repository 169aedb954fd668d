"""Launches of a mission's core services: class, parameters and host of each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import msgspec

from backbone.addresses import LAUNCHER
from backbone.bus.clock import MissionClock
from backbone.component.launch import Launch
from backbone.creator.messages import RestartPolicy, creator_name
from backbone.creator.preload import preloaded_modules
from backbone.mission.model import Host, MissionDescription
from backbone.naming import Subsystem

CORE_POLICY = RestartPolicy(
    back_off_s=0.02, back_off_most_s=0.5, limit=40, window_s=60.0
)  # chosen: a dead hub stops all components, and leases outlast a restart of the RC manager only if its pause is short
CORE_PACK = "packed--core"
"""Process of the core services if the components are packed; no mission file can name it."""


@dataclass(frozen=True)
class UpOptions:
    """Options of ``scout-backbone up``.

    Attributes:
        speed: Mission seconds per second of the machine.
        trace: File for the schedule trace, or None.
        for_s: Mission seconds from readiness to the end; None: until an order ends it.
        text: Content of the mission file, in which changes of the tree are made. Empty: the tree cannot be changed.
        record: File of the recording, or None.
        pack: Number of processes of a host into which the placer packs components; the core services share one more. 0:
            a process for each component; None: types with many components share processes.
    """

    speed: float = 1.0
    trace: Path | None = None
    for_s: float | None = None
    text: bytes = b""
    record: Path | None = None
    pack: int | None = None


def core_launches(description: MissionDescription, own: Launch, options: UpOptions) -> list[Launch]:
    """Return the launches of the core services after the nameserver, in the papers' order.

    On other machines a person or service manager starts the creator (``scout-backbone creator``).
    """
    types = [msgspec.to_builtins(component_type) for component_type in description.types]
    resources = [msgspec.to_builtins(resource) for resource in description.resources]
    kinds = sorted({kind for component_type in description.types for kind in component_type.needs.values()})
    trace = str(options.trace.absolute()) if options.trace else ""
    parameters: dict[str, Callable[[Host], dict[str, object]]] = {
        "component_database": lambda _: {"types": types},
        "placer": lambda _: {"packs": options.pack},
        "creator": lambda host: {
            "tags": list(host.tags),
            "preload": preloaded_modules(description.types, description.placed_types()),
            "types": types,
        },
        "dependency_database": lambda _: {"resources": resources, "kinds": kinds},
        "rc_manager": lambda _: {
            **description.core_parameters("rc_manager"),
            "mission": description.name,
            "mission_priority": description.priority,
            "trace": trace,
        },
    }
    hosts = {host.name: host for host in description.hosts}
    types_by_name = {component_type.name: component_type for component_type in description.types}
    launches = []
    for service in description.core:
        here = hosts[service.host].is_loopback or service.host == own.host
        if service.type == "nameserver" or not here:
            continue
        name = creator_name(service.host) if service.type == "creator" else service.type
        given = parameters[service.type](hosts[service.host])
        launch = service_launch(own, service.type, name, description, given)
        process = CORE_PACK if options.pack and types_by_name[service.type].shares_process else ""
        launches.append(msgspec.structs.replace(launch, host=service.host, process=process))
    return launches


def launcher_launch(description: MissionDescription, endpoint: str, clock: MissionClock, directory: Path) -> Launch:
    """Return the launch of the launcher, from which the launches of the core services are made."""
    return Launch(
        mission=description.name,
        subsystem=Subsystem.BACKBONE,
        name="launcher",
        type="launcher",
        class_path="",
        host=description.hosts[0].name,
        endpoint=endpoint,
        clock_origin_monotonic_s=clock.origin_monotonic_s,
        clock_rate=clock.rate,
        requester=LAUNCHER,
        run_directory=str(directory),
    )


def service_launch(
    own: Launch, component_type: str, name: str, description: MissionDescription, parameters: dict[str, object]
) -> Launch:
    """Return the launch of a core service on the launcher's host."""
    class_path = next(t.class_path for t in description.types if t.name == component_type)
    return msgspec.structs.replace(own, name=name, type=component_type, class_path=class_path, parameters=parameters)
