"""A placer and ARCs that speak the protocol and decide nothing: what decision processes are tested against."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping
from typing import Any

from backbone.addresses import PLACER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus, Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import NameTaken, Stop, Stopping
from backbone.creator.messages import EndedBy, ProcessFell
from backbone.errors import BackboneError, Refusal
from backbone.keys import Conversation
from backbone.naming import Subsystem, address, component_of
from backbone.placer.messages import (
    AskMemory,
    AskPlacement,
    Ended,
    KeepMemory,
    ListPlacements,
    Memory,
    MemoryKept,
    NotPlaced,
    Placement,
    Placements,
    PlacerQuestion,
    ReviseStart,
    Start,
    Started,
    StartRevised,
    StopComponent,
)
from backbone.wire import Envelope, Message
from resource_pool.arc_request import ROBOT
from resource_pool.commands import Command, Drive, Halt, Jump, Move
from resource_pool.messages import (
    Accepted,
    Applied,
    ArcQuestion,
    ArcState,
    AskArc,
    AskBeat,
    Frame,
    GiveCommand,
    Noted,
    Release,
    Resumed,
    Suspended,
    Suspending,
    SwappedOut,
    WantIdle,
)

WITHIN_S = 5.0


class FakeArc:
    """An ARC whose grants come and go when the test says so. Holds one scout and one framegrabber."""

    def __init__(self, bus: Bus, clock: Clock, name: str, parameters: dict[str, Any]) -> None:
        self.bus, self.clock, self.name, self.parameters = bus, clock, name, parameters
        self.address = address(Subsystem.RESOURCE_POOL, name)
        self.epoch, self.granted = 0, False
        self.commands: list[tuple[float, int, Message]] = []
        self.refusal: BackboneError | None = None
        self.release_refusal: Refusal | None = None
        self.require: Callable[[Any], None] = lambda command: None  # raises what its robot would
        self.released = ""
        self.is_idle = self.stays = False  # stays: holds on to its RCs although it is told to rest
        self.wishes: list[Message] = []
        wish = parameters["wish"]
        self.rcs = {"scout": wish.get(ROBOT) or wish.get("scout", "scout3"), "framegrabber": "grabber1"}
        bus.serve(self.address, ArcQuestion | Move | Drive | Halt | Jump | Stop, self._answer)
        bus.declare_alive(self.address)

    @property
    def state(self) -> ArcState:
        epochs = self.epochs if self.granted else {}
        owner, robot = self.parameters["owner"], self.rcs["scout"]
        return ArcState(self.name, "fake", owner, self.rcs, self.granted, epochs, "slice", "other", -1.0, robot)

    @property
    def epochs(self) -> dict[str, int]:
        return dict.fromkeys(self.rcs.values(), self.epoch)

    async def grant(self) -> None:
        self.epoch, self.granted = self.epoch + 1, True
        await self._tell(Resumed(self.name, self.rcs, self.epochs, self.clock.now_s() + 5.0, self.rcs["scout"]))

    async def suspend(self, reason: str = "slice", by: str = "other", deadline_s: float = 0.1) -> None:
        if deadline_s > 0:
            await self._tell(Suspending(self.name, reason, by, deadline_s))
        self.granted = False
        await self._tell(Suspended(self.name, reason, by, -1.0))

    async def beat(self) -> None:
        await self._tell(AskBeat(self.state))

    def publish(self, pixels: bytes, width_px: int, height_px: int, number: int = 0) -> None:
        frame = Frame(
            self.rcs["framegrabber"],
            self.name,
            self.epoch,
            self.rcs["scout"],
            number,
            self.clock.now_s(),
            width_px,
            height_px,
            memoryview(pixels),
        )
        self.bus.publish(self.address, Conversation.FRAMES, frame)

    async def _tell(self, notice: Message) -> None:
        await self.bus.ask(self.parameters["owner"], notice, Noted, within_s=WITHIN_S)

    async def _answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case Release() if self.release_refusal is not None:
                raise self.release_refusal
            case Release(reason=reason):
                self.granted, self.released = False, reason
                return Accepted()
            case WantIdle(idle=idle):
                self.is_idle = idle
                if idle and self.granted and not self.stays:
                    self.bus.start(self.suspend("self", "", deadline_s=0.0))
                return Accepted()
            case Stop():
                return Stopping()
            case AskArc():
                return self.state
            case Command() | GiveCommand() as command:
                return self._command(command)
            case wish:
                self.wishes.append(wish)
                return Accepted()

    def _command(self, command: Command | GiveCommand) -> Applied:
        if not self.granted:
            raise SwappedOut(f"{self.name} holds nothing", reason="slice", by="other", expected_start_s=-1.0)
        if self.refusal is not None:
            raise self.refusal
        if not isinstance(command, Halt):
            self.require(command)
        self.commands.append((self.clock.now_s(), self.epoch, command))
        word, values = command.word if isinstance(command, GiveCommand) else command.word(), {}
        match command:
            case Drive(left_rad_s=left, right_rad_s=right):
                values = {"left_rad_s": left, "right_rad_s": right}
            case Move(forward_m_s=forward, turn_rad_s=turn):
                values = {"forward_m_s": forward, "turn_rad_s": turn}
            case GiveCommand(values=given):
                values = {name: float(value) for name, value in given.items() if isinstance(value, int | float)}
        return Applied(self.rcs["scout"], self.epoch, self.clock.now_s(), word, values)


class FakePlacer:
    """Runs components in this process: ARCs are fakes, other types are looked up in ``classes``."""

    def __init__(self, network: LocalNetwork, clock: Clock, classes: Mapping[str, type[Component[Any]]]) -> None:
        self.network, self.clock, self.classes = network, clock, classes
        self.arcs: dict[str, FakeArc] = {}
        self.components: dict[str, Component[Any]] = {}
        self.started: list[str] = []
        self.ended: list[str] = []
        self.refusals: dict[str, Refusal] = {}
        self.placed: dict[str, Start] = {}
        self.requesters: dict[str, str] = {}
        self.revised: list[ReviseStart] = []
        self.stopped: set[str] = set()
        self.stop_takes_s: dict[str, float] = {}
        self.on_arc: Callable[[FakeArc], None] = lambda arc: None
        self.run_directory = ""
        self.memories: dict[str, bytes] = {}
        self._order_ids: dict[str, str] = {}
        self._lives: dict[str, asyncio.Task[None]] = {}
        self.bus = network.join(PLACER, clock)
        self.creator = network.join("backbone/creator-local", clock)
        self._declared = [self.bus.serve(PLACER, PlacerQuestion, self._answer), self.bus.declare_alive(PLACER)]

    def silence(self) -> None:
        """Answer nothing, as a placer that is being restarted."""
        for declared in self._declared:
            declared.close()

    def speak(self) -> None:
        """Answer again."""
        self._declared = [self.bus.serve(PLACER, PlacerQuestion, self._answer), self.bus.declare_alive(PLACER)]

    async def close(self) -> None:
        for name in list(self.components):
            await self.kill(name)
        for name in list(self.arcs):
            await self.kill(name)
        await self.creator.close()
        await self.bus.close()

    async def launch(self, order: Start, requester: str = "backbone/launcher") -> Any:
        """Run what the order says, as a creator would; return it when it is ready."""
        if order.name in self.arcs or order.name in self.components:
            raise NameTaken(f"{order.name} runs")
        if order.type in self.refusals:
            raise self.refusals[order.type]
        self._order_ids[order.name] = order.order_id or f"1.{len(self.started)}"
        return await self._launch(order, requester)

    async def _launch(self, order: Start, requester: str) -> Any:
        self.started.append(order.name)
        self.placed[order.name], self.requesters[order.name] = order, requester
        self.stopped.discard(order.name)
        if order.type in self.classes:
            await self._run(order, requester)
            made: Any = self.components[order.name]
        else:
            bus = self.network.join(address(Subsystem.RESOURCE_POOL, order.name), self.clock)
            made = self.arcs[order.name] = FakeArc(bus, self.clock, order.name, order.parameters)
            self.on_arc(made)
        return made

    async def restart(self, name: str) -> Any:
        """What a creator does after a death: the same order again."""
        return await self._launch(self.placed[name], self.requesters[name])

    async def kill(self, name: str) -> None:
        """End it as a SIGKILL does: nothing is drained, its token falls."""
        if name in self.arcs:
            await self.arcs.pop(name).bus.close()
            return
        life = self._lives[name]
        life.cancel()
        await asyncio.wait({life})

    def lose(self, name: str) -> None:
        """Forget it, as a placer does that died together with the component's creator."""
        del self.placed[name]

    def fall(self, name: str, how: str = "signal 9", *, often: bool = False) -> None:
        """Say what a creator says of a component that fell and is restarted, or that fell too often."""
        fell = ProcessFell(name, how, 10.0 if often else 0.1, [], failing=often)
        self.creator.publish("backbone/creator-local", Conversation.EVENTS, fell)

    async def wait(self, condition: Callable[[], Any], within_s: float = 90.0) -> None:
        """Return when the condition holds; it is looked at every hundredth of a (virtual) second."""
        async with asyncio.timeout(within_s):
            while not condition():
                await self.clock.sleep_s(0.01)

    async def _run(self, order: Start, requester: str) -> None:
        launch = Launch(
            self.network.mission,
            Subsystem.MISSION_CONTROL,
            order.name,
            order.type,
            "in this process",
            "local",
            "",
            0.0,
            1.0,
            order.parameters,
            requester,
            run_directory=self.run_directory,
            order_id=self._order_ids[order.name],
        )
        bus = self.network.join(launch.address, self.clock)
        component = self.classes[order.type](launch, bus, self.clock)
        ready = asyncio.Event()
        watching = self.bus.watch_alive(launch.address, lambda _address, alive: ready.set() if alive else None)
        life = asyncio.create_task(component.run(), name=f"life of {order.name}")
        self.components[order.name], self._lives[order.name] = component, life
        life.add_done_callback(lambda _life: self._forget(order.name, component))
        waiting = asyncio.create_task(ready.wait())
        await asyncio.wait({life, waiting}, return_when=asyncio.FIRST_COMPLETED)
        waiting.cancel()
        watching.close()
        if life.done():
            await life

    def _forget(self, name: str, component: Component[Any]) -> None:
        if self.components.get(name) is component:
            del self.components[name]

    async def _answer(self, asked: Envelope[Any]) -> Message:
        match asked.body:
            case Start() as order:
                await self.launch(order, asked.source)
                subsystem = Subsystem.MISSION_CONTROL if order.type in self.classes else Subsystem.RESOURCE_POOL
                return Started(address(subsystem, order.name), "local", 1, [])
            case StopComponent(name=name):
                await self.clock.sleep_s(self.stop_takes_s.get(name, 0.0))
                return await self._stop(name)
            case ReviseStart() as revised:
                self.revised.append(revised)
                return StartRevised()
            case KeepMemory(content=content):
                self.memories[component_of(asked.source)] = content
                return MemoryKept()
            case AskMemory():
                return Memory(self.memories.get(component_of(asked.source), b""))
            case AskPlacement(name=name):
                if name not in self.placed:
                    raise NotPlaced(f"{name} is not placed", stopped=name in self.stopped)
                return self._placement(name)
            case ListPlacements():
                return Placements([self._placement(name) for name in sorted(self.placed)])
            case _:
                raise NotPlaced("not in this fake")

    def _placement(self, name: str) -> Placement:
        return Placement(name, self.placed[name].type, "local", self.requesters[name], 0.0, [])

    async def _stop(self, name: str) -> Ended:
        if name not in self.placed:
            raise NotPlaced(f"{name} was never placed")
        del self.placed[name]
        self.ended.append(name)
        self.stopped.add(name)
        if name in self.arcs:
            await self.arcs.pop(name).bus.close()
        elif name in self.components:
            self.components[name].end("the placer ends it")
            await asyncio.wait({self._lives[name]})
        owner = address(Subsystem.MISSION_CONTROL, name)
        for owned in [each for each, requester in self.requesters.items() if requester == owner]:
            if owned in self.placed:
                await self._stop(owned)
        return Ended(name, EndedBy.ASKING)


Run = Callable[[Callable[[FakePlacer], Awaitable[None]]], None]
"""Runs a scene with a placer."""


def with_placer(local_mission: Any, classes: Mapping[str, type[Component[Any]]]) -> Run:
    """Return what runs a scene on virtual time with a placer of these classes on a fresh network.

    Args:
        local_mission: The fixture.
    """

    def run(scene: Callable[[FakePlacer], Awaitable[None]]) -> None:
        async def main() -> None:
            async with local_mission("iros2001") as network:
                placer = FakePlacer(network, VirtualClock(), classes)
                try:
                    await scene(placer)
                finally:
                    await placer.close()

        run_virtual(main())

    return run
