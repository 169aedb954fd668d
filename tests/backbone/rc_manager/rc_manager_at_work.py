"""An RC manager with plain RCs and ARCs on the local bus."""

from __future__ import annotations

from collections import Counter
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import AbstractAsyncContextManager, AsyncExitStack, asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.dependency_database.messages import Resource
from backbone.dependency_database.service import DependencyDatabase
from backbone.errors import Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.rc_manager.messages import (
    BEAT_WITHIN_S,
    AskRc,
    AskRequest,
    Beat,
    CloseGate,
    Connect,
    Connected,
    CurrentRequest,
    Disconnect,
    Disconnected,
    GateClosed,
    GateOpens,
    Held,
    OpenGate,
    RcState,
    StaleEpoch,
)
from backbone.rc_manager.service import RcManager
from backbone.scheduling.requests import (
    Holder,
    PathNode,
    RcUse,
    Scheduled,
    SchedulingRequest,
    UnknownRequest,
    Usage,
)
from backbone.wire import Envelope, Message
from resource_pool.drivers.interface import HardwareFault
from resource_pool.messages import SwappedOut

HARDWARE = [
    Resource("left", "scout"),
    Resource("right", "scout"),
    Resource("video", "video_frequency", connect_s=0.3),
    Resource("radio", "command_radio", sharable=True),
]


class PlainRc(Component[Any]):
    """An RC that keeps the rules to the letter and reports violations of others."""

    accepts = Connect | Disconnect | AskRc
    sharable = False

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.holders: dict[str, int] = {}
        self.last_epoch = 0
        self.log: list[tuple[str, str]] = []
        self.hangs = self.does_not_obey = self.is_broken = False
        self.loses: Counter[type[Message]] = Counter()
        self.confirms_after_s = 0.0
        self.tells: Callable[[RcState], RcState] = lambda state: state

    async def answer(self, asked: Envelope[Any]) -> Message:
        if self.loses[type(asked.body)]:
            self.loses[type(asked.body)] -= 1
            await self.clock.sleep_s(60.0)
        if self.hangs:
            await self.clock.sleep_s(60.0)
        match asked.body:
            case Connect() if self.is_broken:
                raise HardwareFault(f"{self.name} is broken")
            case Connect(arc=arc, epoch=epoch):
                if epoch <= self.last_epoch:
                    raise StaleEpoch(f"{epoch} after {self.last_epoch}")
                if self.holders and not self.sharable:
                    raise Held(f"{self.name} is held by {self.holders}")
                self.last_epoch = epoch
                self.holders[arc] = epoch
                self.log.append(("connect", arc))
                return Connected(epoch)
            case Disconnect() if self.does_not_obey:
                raise HardwareFault(f"{self.name} is not safe")
            case Disconnect(arc=arc):
                self.holders.pop(arc, None)
                self.log.append(("disconnect", arc))
                await self.clock.sleep_s(self.confirms_after_s)
                return Disconnected(self.last_epoch)
            case AskRc():
                holders = [Holder(arc, epoch, 0.0, 0.0) for arc, epoch in self.holders.items()]
                return self.tells(
                    RcState(self.name, self.launch.type, self.sharable, 1.0, holders, self.last_epoch, 0, 0)
                )
        return await super().answer(asked)


class PlainArc(Component[Any]):
    """An ARC that opens and closes on order."""

    accepts = OpenGate | CloseGate | AskRequest

    def __init__(self, *given: Any) -> None:
        super().__init__(*given)
        self.epochs: dict[str, int] = {}
        self.opening: dict[str, int] = {}
        self.granted_s = -1.0
        self.request: SchedulingRequest | None = None
        self.rcs: list[str] = []
        self.waits_since_s = 0.0
        self.log: list[tuple[str, str, float]] = []
        self.beats = True
        self.hangs = False
        self.cannot_open: Refusal | None = None

    async def serve(self) -> None:
        while True:
            if self.beats:
                self.bus.publish(self.address, Conversation.BEAT, Beat(self.name))
            await self.clock.sleep_s(BEAT_WITHIN_S)

    async def ask_for(self, request: SchedulingRequest) -> Scheduled:
        self.request, self.waits_since_s = request, self.clock.now_s()
        scheduled = await self.bus.ask(RC_MANAGER, request, Scheduled, within_s=30)
        self.rcs = scheduled.rcs
        return scheduled

    async def answer(self, asked: Envelope[Any]) -> Message:
        if self.hangs:
            await self.clock.sleep_s(60.0)
        match asked.body:
            case OpenGate() if self.cannot_open is not None:
                raise self.cannot_open
            case OpenGate(epochs=epochs, settled_s=settled_s):
                self.opening = epochs
                await self.clock.sleep_until_s(settled_s)
                if self.opening is not epochs:
                    raise SwappedOut(f"{self.name} was closed while it prepared")
                self.epochs, self.granted_s = epochs, self.clock.now_s()
                self.log.append(("open", "", self.clock.now_s()))
                return GateOpens()
            case CloseGate(reason=reason, by=by):
                self.epochs, self.granted_s, self.opening = {}, -1.0, {}
                self.waits_since_s = self.clock.now_s() if reason == "slice" else self.waits_since_s
                self.log.append((reason, by, self.clock.now_s()))
                return GateClosed()
            case AskRequest():
                if self.request is None:
                    raise UnknownRequest(f"{self.name} asked for nothing yet")
                return CurrentRequest(self.request, self.rcs, self.epochs, self.granted_s, self.waits_since_s)
        return await super().answer(asked)

    @property
    def is_open(self) -> bool:
        return bool(self.epochs)


@dataclass
class Pool:
    """A network with hardware, an RC manager that can be killed, and ARCs."""

    network: LocalNetwork
    clock: VirtualClock
    beside: Callable[[Component[Any]], AbstractAsyncContextManager[Component[Any]]]
    stack: AsyncExitStack
    trace: Path
    rcs: dict[str, PlainRc] = field(default_factory=dict)

    def launch(self, subsystem: Subsystem, name: str, kind: str, parameters: dict[str, Any] | None = None) -> Launch:
        return Launch("local", subsystem, name, kind, "x:Y", "here", "", 0.0, 1.0, parameters or {})

    async def arc(self, name: str) -> PlainArc:
        launch = self.launch(Subsystem.RESOURCE_POOL, name, "plain_arc")
        arc = PlainArc(launch, self.network.join(launch.address, self.clock), self.clock)
        await self.stack.enter_async_context(self.beside(arc))
        return arc

    async def rc(self, resource: Resource, loses: Iterable[type[Message]] = ()) -> PlainRc:
        launch = self.launch(Subsystem.RESOURCE_POOL, resource.name, resource.type)
        rc = PlainRc(launch, self.network.join(launch.address, self.clock), self.clock)
        rc.sharable = resource.sharable
        rc.loses.update(loses)
        await self.stack.enter_async_context(self.beside(rc))
        self.rcs[resource.name] = rc
        return rc

    def manager(self, host: str = "here", requester: str = "", **more: Any) -> RcManager:
        parameters = {"mission": "local", "mission_priority": 10, "trace": str(self.trace)} | more
        launch = self.launch(Subsystem.BACKBONE, "rc_manager", "rc_manager", parameters)
        launch = msgspec.structs.replace(launch, host=host, requester=requester)
        return RcManager(launch, self.network.join(launch.address, self.clock), self.clock)


def request(arc: str, *rcs: str, priority: int | None = None, minimum_runtime_s: float = 5.0) -> SchedulingRequest:
    """Ask as a behavior, or with a priority as a console."""
    uses = {rc: RcUse([Usage(0.05, 0.002)]) if rc == "radio" else RcUse() for rc in rcs}
    path = (
        [PathNode("local", 10), PathNode(f"owner-{arc}", 1)]
        if priority is None
        else [PathNode(f"console-{arc}", priority)]
    )
    return SchedulingRequest(arc, f"mission_control/owner-{arc}", path, priority is not None, [uses], minimum_runtime_s)


@asynccontextmanager
async def a_pool(local_mission: Any, beside: Any, trace: Path) -> AsyncIterator[Pool]:
    clock = VirtualClock()
    async with local_mission() as network, AsyncExitStack() as stack:
        pool = Pool(network, clock, beside, stack, trace)
        resources = [msgspec.to_builtins(resource) for resource in HARDWARE]
        launch = pool.launch(Subsystem.BACKBONE, "dependency_database", "dependency_database", {"resources": resources})
        await stack.enter_async_context(beside(DependencyDatabase(launch, network.join(launch.address, clock), clock)))
        for resource in HARDWARE:
            await pool.rc(resource)
        yield pool
