"""Played hosts: placer, creators and hosts in one process; they start, watch, kill and restart components by name.

They replace the real placer and creators. The real ones handle processes; here a component is a task.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

from backbone.bus.interface import Bus, Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import AnyComponent
from backbone.component.launch import Launch
from backbone.component.messages import NameTaken
from backbone.creator.messages import EndedBy
from backbone.errors import BackboneError
from backbone.naming import Subsystem
from backbone.placer.messages import NotPlaced
from backbone.waiting import end_tasks
from mission_control.laboratory.simulation.audit import Audit

HOST = "host"  # chosen: all components are on one host
PID = 1  # chosen: all components share one process; its real pid would make two runs of one seed differ
FALLEN_AWAY_S = 0.3  # chosen: a creator's first back-off is of this order
STOP_WITHIN_S = 3.0  # chosen: longer than an ARC waits for the RC manager when it withdraws its request


@dataclass(frozen=True, slots=True)
class PlayedRole:
    """The data needed to start a component repeatedly.

    Attributes:
        component: Its class, or a factory.
        is_restarted: True if its creator restarts it after a crash.
        requester: Address of its owner; empty: it has none.
    """

    component: Callable[[Launch, Bus, Clock], AnyComponent]
    subsystem: Subsystem
    name: str
    kind: str
    parameters: Mapping[str, object]
    is_restarted: bool = True
    requester: str = ""


@dataclass
class _Life:
    role: PlayedRole
    component: AnyComponent | None = None
    task: asyncio.Task[None] | None = None
    ready: asyncio.Event = field(default_factory=asyncio.Event)
    away_s: float = FALLEN_AWAY_S


class PlayedHosts:
    """All hosts of a mission, in this process.

    Attributes:
        run_directory: Folder of the mission's files; empty: there is none.
    """

    def __init__(self, network: LocalNetwork, clock: Clock, audit: Audit) -> None:
        self.run_directory = ""
        self._network, self._clock, self._audit = network, clock, audit
        self._lives: dict[str, _Life] = {}
        self._watching: dict[str, asyncio.Task[None]] = {}

    def begin(self, role: PlayedRole) -> None:
        """Start the component; restart it after a crash, if its role requires that.

        Raises:
            NameTaken: A component of this name runs or is being restarted.
        """
        if role.name in self._lives:
            raise NameTaken(f"{role.name} is placed already", name=role.name)
        life = self._lives[role.name] = _Life(role)
        self._watching[role.name] = asyncio.create_task(self._watch(life), name=f"creator of {role.name}")

    async def start(self, role: PlayedRole) -> bool:
        """Start the component; return when it is ready (True) or has ended before (False).

        Raises:
            NameTaken: As ``begin``.
        """
        self.begin(role)
        return await self.wait_ready(role.name)

    async def wait_ready(self, name: str) -> bool:
        """Wait until the component of this name is ready (True) or has ended for good (False)."""
        life, watching = self._lives[name], self._watching[name]
        waiting = asyncio.create_task(life.ready.wait(), name=f"readiness of {name}")
        try:
            await asyncio.wait({waiting, watching}, return_when=asyncio.FIRST_COMPLETED)
        finally:
            waiting.cancel()
            await asyncio.wait({waiting})
        return life.ready.is_set()

    def knows(self, name: str) -> bool:
        """Return whether a component of this name runs or is being restarted."""
        return name in self._lives

    def running(self, name: str) -> AnyComponent | None:
        """Return the running component of this name, or None."""
        life = self._lives.get(name)
        return life.component if life is not None else None

    def revise(self, name: str, parameters: Mapping[str, object]) -> None:
        """Start the component of this name with these parameters from its next start on."""
        life = self._lives[name]
        life.role = replace(life.role, parameters=parameters)

    def kill(self, name: str, away_s: float) -> None:
        """End the component as SIGKILL does; a restart follows after ``away_s``, if at all."""
        life = self._lives.get(name)
        if life is None or life.component is None or life.task is None:
            return
        life.away_s = away_s
        self._audit.note(name, "killed")
        life.component = None
        life.ready.clear()
        life.task.cancel()

    async def stop(self, name: str, reason: str) -> EndedBy:
        """End the component for good: ask it to end, and kill it if that takes too long.

        Raises:
            NotPlaced: No component has this name.
        """
        life = self._lives.get(name)
        if life is None:
            raise NotPlaced(f"{name} was never placed", name=name)
        watching = self._watching[name]
        life.role = replace(life.role, is_restarted=False)
        if life.component is None:
            watching.cancel()
        else:
            life.component.end(reason)
        _, late = await asyncio.wait({watching}, timeout=STOP_WITHIN_S)
        if late:
            self.kill(name, 0.0)
            await asyncio.wait({watching})
        return EndedBy.SIGKILL if late else EndedBy.ASKING

    async def stop_all(self) -> None:
        """End all components at once as SIGKILL does; return when they have ended."""
        await end_tasks(*self._watching.values())

    async def _watch(self, life: _Life) -> None:
        """Run the component; after a crash run it again after a pause, if its role requires that."""
        name = life.role.name
        try:
            while True:
                life.away_s = FALLEN_AWAY_S
                await self._live(life)
                if not life.role.is_restarted:
                    return
                await self._clock.sleep_s(life.away_s)
        finally:
            if self._lives.get(name) is life:
                del self._lives[name], self._watching[name]

    async def _live(self, life: _Life) -> None:
        """Run the component once, to its end."""
        role = life.role
        launch = Launch(
            self._network.mission,
            role.subsystem,
            role.name,
            role.kind,
            "",
            HOST,
            "",
            0.0,
            1.0,
            dict(role.parameters),
            role.requester,
            self.run_directory,
        )
        bus = self._network.join(launch.address, self._clock)
        try:
            component = role.component(launch, bus, self._clock)
        except BackboneError as refusal:
            await bus.close()
            self._audit.note(role.name, "gives up", error=f"{type(refusal).__name__}: {refusal}")
            return
        component.pid = component.start_number = PID
        life.component = component
        self._audit.note(role.name, "begins")
        watching = bus.watch_alive(launch.address, lambda _, alive: life.ready.set() if alive else life.ready.clear())
        life.task = asyncio.create_task(component.run(), name=f"life of {role.name}")
        try:
            await asyncio.wait({life.task})
        finally:
            watching.close()
            life.task.cancel()
            await asyncio.wait({life.task})
            life.component = None
            life.ready.clear()
        if life.task.cancelled():
            return
        error = life.task.exception()
        if error is None:
            self._audit.note(role.name, "ends")
        elif isinstance(error, BackboneError):
            self._audit.note(role.name, "gives up", error=f"{type(error).__name__}: {error}")
        else:
            self._audit.note(role.name, "fails", error=f"{type(error).__name__}: {error}")
