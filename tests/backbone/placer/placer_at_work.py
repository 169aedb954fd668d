"""A placer among a nameserver, a component database and creators that run their components in this process."""

from __future__ import annotations

import asyncio
import tempfile
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import msgspec

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import (
    Absence,
    AskState,
    AskStory,
    ComponentState,
    Story,
)
from backbone.component_database.messages import ComponentType, Multiplicity
from backbone.component_database.service import ComponentDatabase
from backbone.creator.messages import (
    CreatorQuestion,
    EndedBy,
    EndProcess,
    HostLoad,
    ListProcesses,
    NotHere,
    ProcessEnded,
    Processes,
    ProcessState,
    ReviseSpawn,
    Spawn,
    Spawned,
    SpawnRevised,
    StartFailed,
)
from backbone.keys import Conversation
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem, claim_address
from backbone.placer.messages import (
    Ended,
    ListPlacements,
    Placements,
    Start,
    Started,
    StopComponent,
)
from backbone.placer.service import Placer
from backbone.wire import Envelope, Message

TYPES = [
    ComponentType("watcher", "x:Y", Subsystem.MISSION_CONTROL),
    ComponentType("scout", "x:Y", Subsystem.RESOURCE_POOL, tags=["serial"]),
    ComponentType("world", "x:Y", Subsystem.RESOURCE_POOL, Multiplicity.ONE),
    ComponentType("arc", "x:Y", Subsystem.RESOURCE_POOL, restart=False),
]


class Child(Component[NoParameters]):
    """What the creators of these tests start."""


class FakeCreator(Component[NoParameters]):
    """Runs components in this process; what it does wrong is set from outside."""

    accepts = CreatorQuestion

    def __init__(self, launch: Launch, bus: LocalBus, clock: VirtualClock, tags: list[str]) -> None:
        super().__init__(launch, bus, clock)
        self.network, self.tags = bus.network, tags
        self.spawn_s, self.end_s, self.drain_s = 0.1, 0.0, 0.0
        self.answers_spawn = self.answers_list = True
        self.fails: list[str] = []
        self.spawns: list[str] = []
        self.lives: dict[str, tuple[Spawn, Child, asyncio.Task[None]]] = {}

    async def answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case Spawn() as order:
                return await self.spawn(order)
            case ReviseSpawn(name=name) as revised:
                order, *life = self.lives[name]
                given = {"parameters": revised.parameters, "class_path": revised.class_path}
                self.lives[name] = (msgspec.structs.replace(order, **given, declared=revised.declared), *life)
                return SpawnRevised()
            case EndProcess(name=name):
                if name not in self.lives:
                    raise NotHere(f"no {name} here")
                await self.clock.sleep_s(self.end_s)
                await self.kill_child(name)
                return ProcessEnded(name, EndedBy.ASKING, 0)
            case ListProcesses() if self.answers_list:
                listed = [ProcessState(order, 7, 0, "") for order, _, _ in self.lives.values()]
                return Processes(self.launch.host, self.tags, listed)
            case _:
                await asyncio.Event().wait()
                raise AssertionError("waits for ever")

    async def spawn(self, order: Spawn) -> Spawned:
        self.spawns.append(order.name)
        await self.clock.sleep_s(self.spawn_s)
        if order.name in self.fails:
            self.fails.remove(order.name)
            raise StartFailed(f"{order.name} did not become ready")
        launch = Launch(
            "local", order.subsystem, order.name, order.type, "x:Y", self.launch.host, "", 0.0, 1.0, {}, order.requester
        )
        child = Child(launch, self.network.join(launch.address, VirtualClock()), VirtualClock())
        self.lives[order.name] = (order, child, asyncio.create_task(child.run(), name=f"life of {order.name}"))
        await self.clock.sleep_s(0.01)
        if not self.answers_spawn:
            await asyncio.Event().wait()
        return Spawned(launch.address, 7)

    async def kill_child(self, name: str) -> None:
        _, child, life = self.lives.pop(name)
        child.end("killed")
        await life

    def tell_load(self, cpu: float = 0.0, cores: int = 2) -> None:
        load = HostLoad(self.launch.host, self.tags, cpu, 0.1, cores, len(self.lives))
        self.bus.publish(self.address, Conversation.TELEMETRY, load)

    async def drain(self) -> None:
        await self.clock.sleep_s(self.drain_s)
        for name in list(self.lives):
            await self.kill_child(name)


class Mission:
    """Core services and creators on one network, each of which can be killed and begun again."""

    def __init__(self, run_directory: str) -> None:
        self._run_directory = run_directory
        self.network = LocalNetwork()
        self.clock = VirtualClock()
        self.bus = self.network.join("backbone/boss", self.clock)
        self.creators: dict[str, FakeCreator] = {}
        self._lives: dict[str, tuple[Component[Any], asyncio.Task[None]]] = {}

    async def begin(self, kind: type[Component[Any]], name: str, host: str = "a", **more: Any) -> Component[Any]:
        type_name = "creator" if issubclass(kind, FakeCreator) else name
        parameters = more.pop("parameters", {})
        launch = Launch("local", Subsystem.BACKBONE, name, type_name, "x:Y", host, "", 0.0, 1.0, parameters)
        if kind is Placer:
            launch = msgspec.structs.replace(launch, run_directory=self._run_directory)
        component = kind(launch, self.network.join(launch.address, self.clock), self.clock, **more)
        self._lives[name] = (component, asyncio.create_task(component.run(), name=f"life of {name}"))
        await self.clock.sleep_s(0.01)
        return component

    async def begin_creator(self, host: str, *tags: str) -> FakeCreator:
        creator = await self.begin(FakeCreator, f"creator-{host}", host, tags=list(tags))
        assert isinstance(creator, FakeCreator)
        self.creators[host] = creator
        return creator

    async def kill(self, name: str) -> None:
        component, life = self._lives.pop(name)
        component.end("killed")
        await life

    async def crash(self, name: str) -> None:
        """End it as SIGKILL would: its tokens fall before anything else happens."""
        await self._lives[name][0].leave_bus()
        await self.kill(name)

    def cut_off(self, host: str) -> None:
        """Let the host's tokens fall, as a cut link does; the creator and what it runs live on."""
        for _, address in self._tokens_on(host):
            for token in list(self.network.tokens.get(address, ())):
                token.close()

    def reconnect(self, host: str) -> None:
        """Let the tokens rise again."""
        for component, address in self._tokens_on(host):
            component.bus.declare_alive(address)

    def _tokens_on(self, host: str) -> Iterator[tuple[Component[NoParameters], str]]:
        creator = self.creators[host]
        for component in (creator, *(child for _, child, _ in creator.lives.values())):
            yield component, component.address
            yield component, claim_address(component.address, component.component_state().incarnation)

    async def kill_all(self) -> None:
        for name in ["placer", *[f"creator-{host}" for host in self.creators], "component_database", "nameserver"]:
            if name in self._lives:
                await self.kill(name)
        await self.bus.close()

    async def start(self, kind: str, name: str = "", host: str = "", within_s: float = 600.0, **more: Any) -> Started:
        return await self.bus.ask(PLACER, Start(kind, name, host=host, **more), Started, within_s=within_s)

    async def stop(self, name: str) -> Ended:
        return await self.bus.ask(PLACER, StopComponent(name), Ended, within_s=30.0)

    async def placements(self) -> dict[str, str]:
        listed = await self.bus.ask(PLACER, ListPlacements(), Placements, within_s=1.0)
        return {placement.name: placement.host for placement in listed.placements}

    async def absent(self) -> list[Absence]:
        return (await self.bus.ask(PLACER, AskState(), ComponentState, within_s=1.0)).absent

    async def story(self, name: str) -> list[str]:
        return [event.what for event in (await self.bus.ask(PLACER, AskStory(name), Story, within_s=1.0)).events]


@asynccontextmanager
async def mission(*hosts: str) -> AsyncIterator[Mission]:
    async with AsyncExitStack() as ends:
        one = Mission(ends.enter_context(tempfile.TemporaryDirectory(prefix="s-")))
        ends.push_async_callback(one.kill_all)
        await one.begin(Nameserver, "nameserver")
        types = [msgspec.to_builtins(component_type) for component_type in TYPES]
        await one.begin(ComponentDatabase, "component_database", parameters={"types": types})
        await one.begin(Placer, "placer")
        for host in hosts:
            await one.begin_creator(host, "serial")
        await one.clock.sleep_s(1.5)
        yield one


def on(*hosts: str) -> Callable[[Callable[[Mission], Awaitable[None]]], Callable[[], None]]:
    """Run the test in a mission with these hosts, on virtual time."""

    def wrap(test: Callable[[Mission], Awaitable[None]]) -> Callable[[], None]:
        def test_on_virtual_time() -> None:
            async def main() -> None:
                async with mission(*hosts) as one:
                    await test(one)

            run_virtual(main())

        test_on_virtual_time.__name__ = test.__name__
        return test_on_virtual_time

    return wrap
