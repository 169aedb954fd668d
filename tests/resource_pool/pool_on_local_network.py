"""The real resource pool in one process, on virtual time: RC manager, RCs, ARCs, world; only hardware is fake."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Callable, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from typing import Any, ClassVar, TypeVar

import msgspec

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.creator.messages import ReviseSpawn, SpawnRevised
from backbone.dependency_database.messages import Resource
from backbone.dependency_database.service import DependencyDatabase
from backbone.naming import Subsystem, address, component_of
from backbone.rc_manager.service import RcManager
from backbone.scheduling.requests import PathNode
from backbone.wire import Envelope, Message
from resource_pool.aggregate_resource_controller import AggregateResourceController
from resource_pool.arc_client import ArcClient, claim_parameters
from resource_pool.arcs.capture import CaptureArc
from resource_pool.arcs.drive import DriveArc
from resource_pool.arcs.skeleton import LitDriveArc
from resource_pool.arcs.video_drive import VideoDriveArc
from resource_pool.drivers.interface import DriverSite, HardwareFault, Picture
from resource_pool.drivers.simulated import SimulatedRadio
from resource_pool.localization import AskPose, Pose
from resource_pool.messages import ArcNotice, AskBeat, Resumed, Suspended, Suspending
from resource_pool.rcs.command_radio import CommandRadio
from resource_pool.rcs.framegrabber import Framegrabber
from resource_pool.rcs.scout import Scout
from resource_pool.rcs.skeleton import Lamp, Shine
from resource_pool.rcs.video_frequency import VideoFrequency
from resource_pool.simulated_world import SimulatedWorld
from scout_model.description import RobotPlace, WorldDescription

C = TypeVar("C", bound=Component[Any])

WORLD = WorldDescription(
    6.0, 6.0, robots=[RobotPlace("scout1", 1, 2.0, 2.0, 0.0), RobotPlace("scout2", 2, 4.0, 4.0, 0.0)]
)
HERE = "pool_on_local_network"
HARDWARE = [
    Resource("scout1", "scout", parameters={"network_id": 1}, links={"command_radio": ["radio"]}, features=["camera"]),
    Resource("scout2", "scout", parameters={"network_id": 2}, links={"command_radio": ["radio"]}, features=["camera"]),
    Resource("radio", "command_radio", sharable=True, driver=f"{HERE}:WiretappedRadio"),
    Resource("video", "video_frequency", connect_s=0.1),
    Resource("grabber", "framegrabber", driver=f"{HERE}:HandOperatedGrabber", links={"video_frequency": ["video"]}),
    Resource("lamp1", "lamp", driver="resource_pool.rcs.skeleton:PaintedLamp", parameters={"color": "green"}),
    Resource("lamp2", "lamp", driver="resource_pool.rcs.skeleton:PaintedLamp", parameters={"color": "red"}),
]
RC_CLASSES: dict[str, type[Component[Any]]] = {
    "scout": Scout,
    "command_radio": CommandRadio,
    "video_frequency": VideoFrequency,
    "framegrabber": Framegrabber,
    "lamp": Lamp,
}


class TwoLampsArc(DriveArc):
    """A robot with two lamps, which obey the same command."""

    roles = {"scout": "scout", "command_radio": "command_radio", "left": "lamp", "right": "lamp"}
    commands = {**DriveArc.commands, Shine: ("left", "right")}


ARC_CLASSES: dict[str, type[AggregateResourceController]] = {
    "drive": DriveArc,
    "video_drive": VideoDriveArc,
    "capture": CaptureArc,
    "lit_drive": LitDriveArc,
    "two_lamps": TwoLampsArc,
}


@dataclass(frozen=True)
class OnAir:
    """A packet that was heard."""

    at_s: float
    network_id: int
    payload: bytes
    arc: str
    robot_epoch: int


class WiretappedRadio(SimulatedRadio):
    """Keeps what it sent; breaks or hangs when the test says so."""

    built: ClassVar[list[WiretappedRadio]] = []

    def __init__(self, site: DriverSite) -> None:
        super().__init__(site)
        self.clock = site.clock
        self.heard: list[OnAir] = []
        self.breaks = self.hangs = False
        self.slow_s: float | None = None
        self.opened = self.closed = 0
        self.built.append(self)

    async def open(self) -> None:
        self.opened += 1

    async def transmit(
        self, network_id: int, payload: bytes, *, arc: str, robot_epoch: int, robot_stop: int = 0
    ) -> float | None:
        if self.breaks:
            raise HardwareFault("the antenna fell off")
        if self.hangs:
            await asyncio.Event().wait()
        self.heard.append(OnAir(self.clock.now_s(), network_id, payload, arc, robot_epoch))
        took_s = await super().transmit(network_id, payload, arc=arc, robot_epoch=robot_epoch, robot_stop=robot_stop)
        return took_s if self.slow_s is None else self.slow_s

    async def close(self) -> None:
        self.closed += 1

    def heard_by(self, network_id: int) -> list[OnAir]:
        return [packet for packet in self.heard if packet.network_id == network_id]


class HandOperatedGrabber:
    """Delivers when the test says so, also when it should not."""

    built: ClassVar[list[HandOperatedGrabber]] = []

    def __init__(self, site: DriverSite) -> None:
        self.clock = site.clock
        self.frequency = ""
        self.stops = 0
        self.deliver: Callable[[Picture], None] | None = None
        self.built.append(self)

    async def open(self) -> None:
        pass

    def tune(self, frequency: str, deliver: Callable[[Picture], None]) -> None:
        self.frequency, self.deliver = frequency, deliver

    def stop(self) -> None:
        self.frequency = ""
        self.stops += 1

    async def close(self) -> None:
        pass

    def picture(self, transmitters: int = 1) -> Picture:
        return Picture(self.clock.now_s(), memoryview(bytes(4)), 2, 2, transmitters, "scout1")


class Owner(Component[Any]):
    """A decision process that keeps its notices."""

    accepts = ArcNotice

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.arcs: dict[str, ArcClient] = {}
        self.notices: list[Resumed | Suspending | Suspended] = []
        self.hangs = False
        self.slow_s = 0.0

    def know(self, arc: str) -> ArcClient:
        self.arcs[arc] = ArcClient(self.bus, arc, self)
        return self.arcs[arc]

    def heard(self) -> list[str]:
        return [type(notice).__name__ for notice in self.notices]

    async def answer(self, asked: Envelope[Any]) -> Message:
        if self.hangs:
            await asyncio.Event().wait()
        notice = asked.body
        if not isinstance(notice, AskBeat):
            if self.slow_s:
                slow_s, self.slow_s = self.slow_s, self.slow_s / 4
                await self.clock.sleep_s(slow_s)
            self.notices.append(notice)
        return await self.arcs[component_of(asked.source)].answer(asked)

    async def arc_resumed(self, notice: Resumed) -> None:
        pass

    async def arc_suspending(self, notice: Suspending) -> None:
        pass

    async def arc_suspended(self, notice: Suspended) -> None:
        pass


MANAGER_OWNER = "backbone/manager_owner"


@dataclass
class Pool:
    """A running pool. Components are started, ended and killed by name."""

    network: LocalNetwork
    clock: VirtualClock
    hardware: list[Resource]
    rc_classes: Mapping[str, type[Component[Any]]] = field(default_factory=lambda: RC_CLASSES)
    arc_classes: Mapping[str, type[AggregateResourceController]] = field(default_factory=lambda: ARC_CLASSES)
    running: dict[str, Component[Any]] = field(default_factory=dict)
    lives: dict[str, asyncio.Task[None]] = field(default_factory=dict)
    voices: dict[str, Bus] = field(default_factory=dict)
    kept_tree: dict[str, Any] = field(default_factory=dict)

    @property
    def radio_driver(self) -> WiretappedRadio:
        return WiretappedRadio.built[-1]

    @property
    def grabber_driver(self) -> HandOperatedGrabber:
        return HandOperatedGrabber.built[-1]

    async def start(
        self,
        component: type[C],
        name: str,
        parameters: dict[str, Any] | None = None,
        subsystem: Subsystem = Subsystem.RESOURCE_POOL,
        kind: str = "",
        requester: str = "",
    ) -> C:
        """Return the component when it is ready."""
        mission, given = self.network.mission, parameters or {}
        launch = Launch(mission, subsystem, name, kind or name, "x:Y", "local", "", 0.0, 1.0, given, requester)
        made = component(launch, self.network.join(launch.address, self.clock), self.clock)
        ready = asyncio.Event()
        watching = made.bus.watch_alive(launch.address, lambda _address, alive: ready.set() if alive else None)
        life = asyncio.create_task(made.run(), name=f"life of {name}")
        waiting = asyncio.create_task(ready.wait())
        await asyncio.wait({life, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        watching.close()
        if life.done():
            await life
            raise AssertionError(f"{name} ended before it was ready")
        self.running[name], self.lives[name] = made, life
        return made

    async def rc(self, name: str, **changed: Any) -> Any:
        resource = next(resource for resource in self.hardware if resource.name == name)
        parameters = resource.rc_parameters() | changed
        return await self.start(self.rc_classes[resource.type], name, parameters, kind=resource.type)

    async def manager(self, **rules: Any) -> RcManager:
        """Start the RC manager as the launcher does: with the tree that the one before sent."""
        if MANAGER_OWNER not in self.voices:
            self.voice_of(MANAGER_OWNER).serve(MANAGER_OWNER, ReviseSpawn, self._keep_tree)
        parameters = {"mission": "local", "mission_priority": 10} | self.kept_tree | rules
        return await self.start(RcManager, "rc_manager", parameters, Subsystem.BACKBONE, requester=MANAGER_OWNER)

    async def _keep_tree(self, asked: Envelope[Message]) -> Message:
        assert isinstance(asked.body, ReviseSpawn)
        self.kept_tree = {"tree": asked.body.parameters["tree"]}
        return SpawnRevised()

    async def owner(self, name: str) -> Owner:
        return await self.start(Owner, name, None, Subsystem.MISSION_CONTROL)

    async def arc(self, owner: Owner, kind: str, robot: str, **more: Any) -> ArcClient:
        """Start an ARC for this robot and return the owner's hold on it."""
        name = f"{owner.name}-{kind}"
        client = owner.know(name)
        path = [PathNode("local", 10), PathNode(owner.name, 1)]
        given = {"minimum_runtime_s": 5.0, "path": path, "wish": {self.arc_classes[kind].body: robot}} | more
        parameters = claim_parameters(owner.address, **given)
        await self.start(self.arc_classes[kind], name, msgspec.to_builtins(parameters), kind=kind)
        return client

    async def console(
        self, name: str, kind: str, robot: str, priority: int = 100, **more: Any
    ) -> tuple[Owner, ArcClient]:
        owner = await self.owner(name)
        path = [PathNode(name, priority)]
        more = {"console": True, "minimum_runtime_s": 0.1} | more
        return owner, await self.arc(owner, kind, robot, path=path, **more)

    async def end(self, name: str) -> None:
        """Let it leave in good order."""
        self.running.pop(name).end("the test ends it")
        await self.lives.pop(name)

    async def kill(self, name: str) -> None:
        """End it as SIGKILL does."""
        del self.running[name]
        life = self.lives.pop(name)
        life.cancel()
        await asyncio.wait({life})

    async def outcome(self, name: str) -> BaseException | None:
        """Return what ended it, when it has ended by itself; None for a good end."""
        life = self.lives.pop(name)
        del self.running[name]
        await asyncio.wait({life})
        return life.exception()

    def is_alive(self, name: str) -> bool:
        return not self.lives[name].done()

    async def pose(self, body: str) -> tuple[float, float]:
        found = await self.ear.ask(address(Subsystem.RESOURCE_POOL, "world"), AskPose(body), Pose, within_s=1)
        return found.x_m, found.y_m

    @property
    def ear(self) -> Bus:
        return self.running["world"].bus

    def voice(self, component: str) -> Bus:
        """Return a bus on which the test acts as this component of the resource pool."""
        return self.voice_of(address(Subsystem.RESOURCE_POOL, component))

    @property
    def manager_voice(self) -> Bus:
        """A bus on which the test speaks as the RC manager."""
        return self.voice_of(RC_MANAGER)

    def voice_of(self, source: str) -> Bus:
        """Return a bus on which the test speaks as this component."""
        if source not in self.voices:
            self.voices[source] = self.network.join(source, self.clock)
        return self.voices[source]

    @property
    def audit(self) -> dict[str, float]:
        return self.running["world"].statistics()

    async def close(self) -> None:
        for name in list(reversed(self.lives)):
            if name in self.lives:
                await self.end(name)
        for voice in self.voices.values():
            await voice.close()


@asynccontextmanager
async def a_pool(
    mission: Any,
    rcs: list[str],
    *,
    manager: bool = True,
    world: WorldDescription = WORLD,
    hardware: Sequence[Resource] = (),
    rc_classes: Mapping[str, type[Component[Any]]] | None = None,
    arc_classes: Mapping[str, type[AggregateResourceController]] | None = None,
) -> AsyncIterator[Pool]:
    """Give a pool with these RCs running; hardware and classes are added to those of this file."""
    clock = VirtualClock()
    WiretappedRadio.built.clear()
    HandOperatedGrabber.built.clear()
    async with mission(clock=clock) as network, AsyncExitStack() as stack:
        all_hardware = [*HARDWARE, *hardware]
        pool = Pool(network, clock, all_hardware, RC_CLASSES | (rc_classes or {}), ARC_CLASSES | (arc_classes or {}))
        stack.push_async_callback(pool.close)
        resources = [msgspec.to_builtins(resource) for resource in all_hardware if resource.name in rcs]
        await pool.start(DependencyDatabase, "dependency_database", {"resources": resources}, Subsystem.BACKBONE)
        await pool.start(SimulatedWorld, "world", {"world": msgspec.to_builtins(world)})
        for name in rcs:
            await pool.rc(name)
        if manager:
            await pool.manager()
        yield pool
