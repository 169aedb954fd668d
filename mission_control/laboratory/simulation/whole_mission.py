"""A mission file's whole mission in one process on a virtual clock; only placer and creators are simulated.

Nameserver, databases, RC manager, world, RCs, ARCs, behaviors and all other components are the classes that the mission
file names. They use a ``LocalNetwork`` and a ``VirtualClock``, so the mission runs as fast as the machine can, and the
same mission gives the same run to the byte.

Rule of this file: it brings the mission up; it contains no decisions and no laws.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable, Mapping
from contextlib import asynccontextmanager
from dataclasses import dataclass, field

import msgspec

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Bus, Clock
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.class_path import load_class
from backbone.component.component import AnyComponent, Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import AskStatistics, Statistics
from backbone.component_database.messages import ComponentType, UnknownType
from backbone.component_database.service import ComponentDatabase
from backbone.dependency_database.service import DependencyDatabase
from backbone.errors import BackboneError
from backbone.keys import Conversation
from backbone.mission.behavior_orders import behavior_orders
from backbone.mission.model import MissionDescription
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem, address, component_of
from backbone.placer.messages import (
    AskPlacement,
    Ended,
    ListPlacements,
    NotPlaced,
    Placement,
    Placements,
    PlacerQuestion,
    Start,
    Started,
    StopComponent,
    StoppedMeanwhile,
)
from backbone.rc_manager.messages import TraceLine
from backbone.rc_manager.service import RcManager
from backbone.scheduling.trace import Line
from backbone.wire import Envelope, Message
from mission_control.laboratory.simulation.audit import Audit, Happening
from mission_control.laboratory.simulation.played_hosts import HOST, PlayedHosts, PlayedRole
from resource_pool.rcs.framegrabber import Framegrabber

START_TIME_S = 60.0  # chosen: virtual time; only settling and back-offs take virtual time
REPLY_TIME_S = 5.0  # chosen: virtual time; an answer takes no virtual time
MEETING_AT = "backbone/launcher"
SIMULATED = "simulated"
FELL = frozenset({"fails", "gives up"})


class MissionFell(BackboneError):
    """A component of a mission in one process crashed; the text names the first such component and the reason."""


@dataclass(slots=True)
class RunningMission:
    """A mission that is up, in this process.

    Attributes:
        network: Its network; ``network.join(source, clock)`` gives one more bus.
        bus: A bus with the launcher's address.
        clock: The mission's clock, which shows the event loop's time.
        hosts: All its components by name.
        trace: Lines of the schedule trace until now; the first is ``meta``.
        placer: Address of the placer.
    """

    description: MissionDescription
    network: LocalNetwork
    bus: LocalBus
    clock: Clock
    hosts: PlayedHosts
    trace: list[Line] = field(default_factory=list)
    placer: str = PLACER

    async def start(self, order: Start) -> Started:
        """Ask the placer to start a component; return when it is ready.

        Raises:
            Refusal: The placer refused.
        """
        return await self.bus.ask(PLACER, order, Started, within_s=START_TIME_S)

    async def stop(self, name: str, reason: str = "no longer needed") -> Ended:
        """Ask the placer to end a component; return when it has ended.

        Raises:
            NotPlaced: No component has this name.
        """
        return await self.bus.ask(PLACER, StopComponent(name, reason), Ended, within_s=START_TIME_S)

    def component(self, name: str) -> AnyComponent:
        """Return the component of this name.

        Raises:
            NotPlaced: No running component has this name.
        """
        found = self.hosts.running(name)
        if found is None:
            raise NotPlaced(f"{name} does not run", name=name)
        return found

    async def statistics(self, name: str) -> dict[str, float]:
        """Return a component's counters, as an answer over the bus.

        Raises:
            NotPlaced: No running component has this name.
        """
        at = self.component(name).address
        return (await self.bus.ask(at, AskStatistics(), Statistics, within_s=REPLY_TIME_S)).values


@asynccontextmanager
async def mission_in_one_process(
    description: MissionDescription,
    *,
    trace: Callable[[Line], None] | None = None,
    consoles: Mapping[str, Callable[[Launch, Bus, Clock], AnyComponent]] | None = None,
    on: Callable[[str], LocalNetwork] = LocalNetwork,
) -> AsyncIterator[RunningMission]:
    """Yield the mission when it is ready, on the running loop's time; end all components at the end of the block.

    Run it under ``run_virtual``. At the end hardware is closed in good order; all other components end as by SIGKILL.

    Args:
        description: A checked mission; hosts and shared processes are ignored.
        trace: Also called with each line of the schedule trace, in order.
        consoles: Component type → factory of its consoles; a mission file has no consoles.
        on: Makes the network of a mission of this name.

    Raises:
        MissionFell: A component crashed; raised at the end of the block, also in place of an exception that the crash
            caused.
        Refusal: A component could not be started.

    Example:
        >>> from backbone.bus.clock import run_virtual
        >>> from backbone.mission.reader import read_mission
        >>> async def minute(path: str) -> int:
        ...     async with mission_in_one_process(read_mission(path)) as running:
        ...         await running.clock.sleep_s(60.0)
        ...         return sum(line["ev"] == "grant" for line in running.trace)
        >>> grants = run_virtual(minute("mission.xml"))  # doctest: +SKIP
    """
    clock = VirtualClock()
    network = on(description.name)
    audit = Audit()
    hosts = PlayedHosts(network, clock, audit)
    bus = network.join(MEETING_AT, clock)
    running = RunningMission(_painted(description), network, bus, clock, hosts)

    def decided(envelope: Envelope[TraceLine]) -> None:
        running.trace.append(envelope.body.line)
        if trace is not None:
            trace(envelope.body.line)

    bus.subscribe(RC_MANAGER, Conversation.EVENTS, TraceLine, decided)
    try:
        await _bring_up(running, consoles or {})
        yield running
    except BackboneError as error:
        fell = _first_fall(audit.happenings)
        if fell is None:
            raise
        raise MissionFell(fell) from error
    finally:
        hardware = [resource.name for resource in description.resources]
        hardware += [component.name for component in description.components]
        await asyncio.gather(*(hosts.stop(name, "the mission ends") for name in hardware if hosts.knows(name)))
        await hosts.stop_all()
        await bus.close()
    fell = _first_fall(audit.happenings)
    if fell is not None:
        raise MissionFell(fell)


def _painted(mission: MissionDescription) -> MissionDescription:
    """Return the mission with the painter for each simulated receiver: its pictures are the same everywhere."""
    used = {resource.type for resource in mission.resources}  # other drivers are not imported
    types = {kind.name: kind.class_path for kind in mission.types if kind.name in used}
    receivers = {name for name, class_path in types.items() if issubclass(load_class(class_path), Framegrabber)}
    resources = tuple(
        msgspec.structs.replace(resource, parameters={**resource.parameters, "camera": "paint"})
        if resource.type in receivers and resource.driver == SIMULATED
        else resource
        for resource in mission.resources
    )
    return msgspec.structs.replace(mission, resources=resources)


def _first_fall(happenings: list[Happening]) -> str | None:
    for happening in happenings:
        if happening.what in FELL:
            return f"at {happening.at_s:.3f} s {happening.who} fell: {happening.values['error']}"
    return None


# Bring-up is in the papers' order.
async def _bring_up(running: RunningMission, consoles: Mapping[str, Callable[..., AnyComponent]]) -> None:
    mission, hosts = running.description, running.hosts
    resources = [msgspec.to_builtins(resource) for resource in mission.resources]
    types = [msgspec.to_builtins(component_type) for component_type in mission.types]
    manager = {
        **mission.core_parameters("rc_manager"),
        "mission": mission.name,
        "mission_priority": mission.priority,
    }

    def placer(launch: Launch, bus: Bus, clock: Clock) -> WholePlacer:
        return WholePlacer(launch, bus, clock, hosts=hosts, types=mission.types, consoles=consoles)

    core: list[tuple[Callable[..., AnyComponent], str, dict[str, object]]] = [
        (Nameserver, "nameserver", {}),
        (ComponentDatabase, "component_database", {"types": types}),
        (placer, "placer", {}),
        (DependencyDatabase, "dependency_database", {"resources": resources}),
        (RcManager, "rc_manager", manager),
    ]
    for component, name, parameters in core:
        if not await hosts.start(PlayedRole(component, Subsystem.BACKBONE, name, name, parameters, is_restarted=False)):
            raise MissionFell(f"{name} ended before it was ready")
    hardware = [Start(part.type, part.name, part.parameters) for part in mission.components]
    hardware += [Start(part.type, part.name, part.rc_parameters()) for part in mission.resources]
    units = [Start(part.type, part.name, part.parameters) for part in mission.units]
    for orders in (hardware, units, behavior_orders(mission)):
        await asyncio.gather(*(running.start(order) for order in orders))


class WholePlacer(Component[NoParameters]):
    """Starts and stops all components except core services, in this process, with the real placer's messages.

    With ``restarts``, components of the types that creators restart are restarted after a crash.
    """

    accepts = PlacerQuestion

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        *,
        hosts: PlayedHosts,
        types: tuple[ComponentType, ...],
        consoles: Mapping[str, Callable[[Launch, Bus, Clock], AnyComponent]],
        restarts: bool = False,
    ) -> None:
        super().__init__(launch, bus, clock)
        self._hosts = hosts
        self._types = {one.name: one for one in types}
        self._consoles, self._restarts = consoles, restarts
        self._numbers = Counter[str]()
        self._placements: dict[str, Placement] = {}

    async def answer(self, asked: Envelope[Message]) -> Message:
        """Answer ``Start``, ``StopComponent`` and ``AskPlacement``."""
        match asked.body:
            case Start() as order:
                return await self._start(order, asked.source)
            case StopComponent(name=name, reason=reason):
                ended = Ended(name, await self._hosts.stop(component_of(name), reason))
                self._placements.pop(name, None)
                return ended
            case AskPlacement(name=name):
                if name not in self._placements or not self._hosts.knows(name):
                    raise NotPlaced(f"{name} was never placed or has ended", name=name)
                return self._placements[name]
            case ListPlacements():
                there = [placed for name, placed in sorted(self._placements.items()) if self._hosts.knows(name)]
                return Placements(there)
            case _:
                return await super().answer(asked)

    async def _start(self, order: Start, requester: str) -> Started:
        name = order.name
        if not name:
            self._numbers[order.type] += 1
            name = f"{order.type}-{self._numbers[order.type]}"
        role = self._role(order, name)
        subsystem = role.subsystem
        self._placements[name] = Placement(name, order.type, HOST, requester, self.clock.now_s(), [])
        if not await self._hosts.start(role):
            raise StoppedMeanwhile(f"{name} ended before it was ready", name=name)
        return Started(address(subsystem, name), HOST, 0, [])

    def _role(self, order: Start, name: str) -> PlayedRole:
        console, known = self._consoles.get(order.type), self._types.get(order.type)
        if console is not None:
            return PlayedRole(console, Subsystem.UI_CONSOLE, name, order.type, order.parameters, is_restarted=False)
        if known is None:
            raise UnknownType(f"{order.type} is no component type of this mission", type=order.type)
        made = load_class(known.class_path)
        return PlayedRole(made, known.subsystem, name, order.type, order.parameters, known.restart and self._restarts)
