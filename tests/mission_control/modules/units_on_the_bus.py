"""Units of sample modules on a local bus, in three arrangements."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import msgspec

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.bus.local_bus import LocalNetwork
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.naming import Subsystem
from backbone.wire import Message
from mission_control.modules.arrangement import GivenKey, UnitOrder
from mission_control.modules.orders import ModuleOrder, Source, UnitParameters
from mission_control.modules.unit_component import UnitComponent

TESTER = "ui_console/tester"
NUMBERS = {"number": GivenKey("sample_modules:Number", Source(TESTER, Conversation.EVENTS))}
MODULES = {
    name: ModuleOrder(name, f"sample_modules:{name.capitalize()}") for name in ("doubler", "summing", "follower")
}
ARRANGEMENTS = [
    {"all": ["follower", "doubler", "summing"]},
    {"first": ["doubler"], "rest": ["summing", "follower"]},
    {"c": ["follower"], "b": ["summing"], "a": ["doubler"]},
]


def orders(units: Mapping[str, Sequence[str]], own_thread: bool = False) -> list[UnitOrder]:
    return [
        UnitOrder(name=name, modules=[MODULES[one] for one in of], own_thread=own_thread) for name, of in units.items()
    ]


def launch_of(name: str, parameters: UnitParameters) -> Launch:
    class_path = "mission_control.modules.unit_component:UnitComponent"
    given = msgspec.to_builtins(parameters)
    return Launch("local", Subsystem.MISSION_CONTROL, name, "execution_unit", class_path, "local", "", 0.0, 1.0, given)


def unit_on(network: LocalNetwork, name: str, parameters: UnitParameters) -> UnitComponent:
    launch, clock = launch_of(name, parameters), VirtualClock()
    return UnitComponent(launch, network.join(launch.address, clock), clock)


def play(
    local_mission: Any,
    beside: Any,
    units: Mapping[str, UnitParameters],
    scene: Callable[[Bus, dict[str, UnitComponent]], Awaitable[None]],
) -> None:
    """Run the scene beside these units, on virtual time."""

    @asynccontextmanager
    async def running() -> AsyncIterator[tuple[Bus, dict[str, UnitComponent]]]:
        async with AsyncExitStack() as stack:
            network = await stack.enter_async_context(local_mission())
            started = {name: unit_on(network, name, one) for name, one in units.items()}
            for unit in started.values():
                await stack.enter_async_context(beside(unit))
            bus = network.join(TESTER, VirtualClock())
            stack.push_async_callback(bus.close)
            yield bus, started

    async def main() -> None:
        async with running() as (bus, started):
            await scene(bus, started)

    run_virtual(main())


def listen(bus: Bus, address: str, kind: type[Message], heard: list[Any]) -> None:
    bus.subscribe(address, Conversation.OUTPUTS, kind, lambda envelope: heard.append(envelope.body))
