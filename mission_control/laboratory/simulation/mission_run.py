"""Runs one mission from a seed, from bring-up to the last law; only hardware, placer and creators are simulated.

Source: FoundationDB tests a whole distributed system in one process on virtual time (Zhou et al., SIGMOD 2021, section
4).
"""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass

import msgspec

from backbone.addresses import LAUNCHER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus, Clock
from backbone.component.class_path import load_class
from backbone.component.launch import Launch
from backbone.creator.messages import ReviseSpawn, SpawnRevised
from backbone.dependency_database.service import DependencyDatabase
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem
from backbone.waiting import end_tasks
from backbone.wire import Envelope, Message
from mission_control.laboratory.simulation.audit import Audit, Happening, current_audit
from mission_control.laboratory.simulation.audited_pool import AuditedRcManager
from mission_control.laboratory.simulation.faults import (
    CALM_WEATHER,
    DrawnFates,
    Fates,
    Fault,
    GivenFates,
    Hang,
    KillFault,
    MessageFault,
    Moment,
    Weather,
    draw_moments,
    draw_weather,
)
from mission_control.laboratory.simulation.laws import Broken, first_broken
from mission_control.laboratory.simulation.operator_choices import (
    OPERATOR,
    OperatorChange,
    OtherRules,
    RobotStop,
    carry_out,
    draw_choices,
    draw_stops,
    stop_and_lift,
)
from mission_control.laboratory.simulation.played_hosts import PlayedHosts, PlayedRole
from mission_control.laboratory.simulation.shape import BRING_UP_S, MISSION, POOL_TYPES, RCS, MissionShape, draw_shape
from mission_control.laboratory.simulation.simulated_owner import SimulatedOwner
from mission_control.laboratory.simulation.supervision_faults import SupervisionFault
from mission_control.laboratory.simulation.unreliable_network import UnreliableNetwork
from mission_control.laboratory.simulation.whole_mission import WholePlacer


@dataclass(frozen=True, slots=True)
class MissionRun:
    """The result of one mission.

    Attributes:
        digest: Hash of all events.
        broken: The first broken law; None if all hold.
    """

    shape: MissionShape
    faults: tuple[Fault | SupervisionFault, ...]
    happenings: tuple[Happening, ...]
    digest: str
    broken: Broken | None


def run_mission(seed: int, *, chaos: bool, faults: Sequence[Fault] | None = None) -> MissionRun:
    """Run the mission of this seed to its end and judge it; the same arguments give the same bytes.

    Args:
        seed: Seed of the mission, its moods and its faults.
        faults: Only these faults, instead of the seed's.
    """
    shape = draw_shape(seed)
    weather = draw_weather(seed) if chaos else CALM_WEATHER
    moments: list[Moment]
    fates: Fates
    if faults is None:
        moments, fates = _draw_moments(shape, weather) if chaos else [], DrawnFates(seed, weather)
    else:
        moments, fates = [fault for fault in faults if not isinstance(fault, MessageFault)], GivenFates(faults)
    return run_virtual(_PoolMission(shape, moments, fates).run())


def _draw_moments(shape: MissionShape, weather: Weather) -> list[Moment]:
    nodes = [owner.name for owner in shape.owners if not owner.console]
    moments = [*draw_choices(shape, nodes), *draw_stops(shape), *draw_moments(shape, weather)]
    return sorted(moments, key=lambda moment: (moment.at_s, moment.target))


class _PoolMission:
    def __init__(self, shape: MissionShape, moments: list[Moment], fates: Fates) -> None:
        self._shape, self._moments = shape, moments
        self._audit = Audit()
        self._clock = VirtualClock()
        self._network = UnreliableNetwork(MISSION, fates, BRING_UP_S, shape.active_s)
        self._hosts = PlayedHosts(self._network, self._clock, self._audit)
        self._rules = next((moment for moment in moments if isinstance(moment, OtherRules)), OtherRules())
        self._calm_s = shape.calm_s + self._rules.grid_s * len(shape.owners)
        self._launcher, self._operator = (self._network.join(at, self._clock) for at in (LAUNCHER, OPERATOR))
        self._changes: list[asyncio.Task[None]] = []

    async def run(self) -> MissionRun:
        current_audit.set(self._audit)
        with tempfile.TemporaryDirectory() as folder:
            self._hosts.run_directory = folder
            await self._live()
        faults = (*self._network.suffered, *self._moments)
        happenings = tuple(self._audit.happenings)
        broken = first_broken(
            self._shape, happenings, all_arrived=not self._network.suffered, ages=self._rules.aging_s > 0
        )
        return MissionRun(self._shape, faults, happenings, self._audit.digest(), broken)

    async def _live(self) -> None:
        try:
            await self._bring_up()
            for fault in self._moments:
                await self._clock.sleep_until_s(fault.at_s)
                self._strike(fault)
            await self._clock.sleep_until_s(self._shape.active_s)
            self._audit.note("mission", "calm")
            await self._clock.sleep_until_s(self._shape.active_s + self._calm_s)
            self._audit.note("mission", "over")
        finally:
            await end_tasks(*self._changes)
            await self._hosts.stop_all()

    def _strike(self, fault: Moment) -> None:
        match fault:
            case KillFault(target=target, away_s=away_s):
                self._hosts.kill(target, away_s)
            case Hang(target=target, lasts_s=lasts_s):
                self._audit.note(target, "cut off", lasts_s=lasts_s)
                self._network.cut_off(self._address(target), self._clock.now_s() + lasts_s)
            case OperatorChange():
                work = carry_out(fault, self._operator, self._audit)
                self._changes.append(asyncio.create_task(work, name="operator"))
            case RobotStop():
                work = stop_and_lift(fault, self._operator, self._clock, self._audit)
                self._changes.append(asyncio.create_task(work, name="operator"))
            case OtherRules():
                pass  # in force since the bring-up

    async def _launch(self, asked: Envelope[Message]) -> Message:
        """Answer as the launcher."""
        assert isinstance(asked.body, ReviseSpawn)  # noqa: S101  it accepts nothing else
        self._hosts.revise(asked.body.name, asked.body.parameters)
        return SpawnRevised()

    def _address(self, name: str) -> str:
        if name == "rc_manager":
            return f"{Subsystem.BACKBONE}/{name}"
        owner = next((owner for owner in self._shape.owners if owner.name == name), None)
        subsystem = Subsystem.RESOURCE_POOL
        if owner is not None:
            subsystem = Subsystem.UI_CONSOLE if owner.console else Subsystem.MISSION_CONTROL
        return f"{subsystem}/{name}"

    # Bring-up is in the papers' order.
    async def _bring_up(self) -> None:
        shape = self._shape

        def placer(launch: Launch, bus: Bus, clock: Clock) -> WholePlacer:
            return WholePlacer(launch, bus, clock, hosts=self._hosts, types=POOL_TYPES, consoles={}, restarts=True)

        manager = {
            "mission": MISSION,
            "mission_priority": shape.priority,
            "grace_s": shape.grace_s,
            "policy": shape.policy,
            **self._rules.parameters(),
        }
        self._launcher.serve(LAUNCHER, ReviseSpawn, self._launch)
        core = Subsystem.BACKBONE
        await self._hosts.start(PlayedRole(Nameserver, core, "nameserver", "nameserver", {}))
        await self._hosts.start(PlayedRole(placer, core, "placer", "placer", {}))
        known = {"resources": [msgspec.to_builtins(resource) for resource in shape.resources]}
        await self._hosts.start(
            PlayedRole(DependencyDatabase, core, "dependency_database", "dependency_database", known)
        )
        await self._hosts.start(
            PlayedRole(AuditedRcManager, core, "rc_manager", "rc_manager", manager, requester=LAUNCHER)
        )
        for resource in shape.resources:
            if resource.name not in shape.asleep:
                role = PlayedRole(
                    load_class(RCS[resource.type]),
                    Subsystem.RESOURCE_POOL,
                    resource.name,
                    resource.type,
                    resource.rc_parameters(),
                )
                await self._hosts.start(role)
        for owner in shape.owners:
            subsystem = Subsystem.UI_CONSOLE if owner.console else Subsystem.MISSION_CONTROL
            await self._hosts.start(
                PlayedRole(SimulatedOwner, subsystem, owner.name, owner.name, shape.owner_parameters(owner))
            )
