"""The component database asks the nameserver who runs."""

from __future__ import annotations

import asyncio
from typing import Any

import msgspec
import pytest

from backbone.addresses import COMPONENT_DATABASE
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import Component, NoParameters
from backbone.component.launch import Launch
from backbone.component.messages import AskStory, Story
from backbone.component_database.messages import (
    Admit,
    Admitted,
    ComponentType,
    CoreService,
    ListTypes,
    Multiplicity,
    MultiplicityExceeded,
    RunningUnknown,
    Types,
    UnknownType,
)
from backbone.component_database.service import ComponentDatabase
from backbone.nameserver.service import Nameserver
from backbone.naming import Subsystem

TYPES = [
    ComponentType("watcher", "x:Y", Subsystem.MISSION_CONTROL, tags=["gl"]),
    ComponentType("world", "x:Y", Subsystem.RESOURCE_POOL, Multiplicity.ONE),
    ComponentType("rc_manager", "x:Y", Subsystem.BACKBONE, Multiplicity.ONE, core=True),
    ComponentType("component_database", "x:Y", Subsystem.BACKBONE, Multiplicity.ONE, core=True),
]


class Probe(Component[NoParameters]):
    """Any component."""


def order(subsystem: Subsystem, name: str, kind: str, **parameters: Any) -> Launch:
    return Launch("local", subsystem, name, kind, "x:Y", "a", "", 0.0, 1.0, parameters)


def begin(kind: type[Component[Any]], network: LocalNetwork, launch: Launch) -> Component[Any]:
    clock = VirtualClock()
    return kind(launch, network.join(launch.address, clock), clock)


def database(network: LocalNetwork) -> Component[Any]:
    types = [msgspec.to_builtins(component_type) for component_type in TYPES]
    sent = msgspec.msgpack.encode(order(Subsystem.BACKBONE, "component_database", "component_database", types=types))
    return begin(ComponentDatabase, network, msgspec.msgpack.decode(sent, type=Launch))


async def admit(network: LocalNetwork, kind: str, name: str) -> ComponentType:
    bus = network.join("ui_console/asker", VirtualClock())
    return (await bus.ask(COMPONENT_DATABASE, Admit(kind, name), Admitted, within_s=10)).component_type


def test_types_survive_the_way_through_a_launch_order(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        async with local_mission() as network, beside(database(network)):
            assert await admit(network, "watcher", "left") == TYPES[0]
            with pytest.raises(UnknownType):
                await admit(network, "wather", "left")
            bus = network.join("ui_console/asker", VirtualClock())
            counted = await bus.ask(COMPONENT_DATABASE, ListTypes(), Types, within_s=1)
            assert {count.component_type.name: count.running for count in counted.types} == {
                "watcher": 0,
                "world": 0,
                "rc_manager": 0,
                "component_database": 1,
            }
            told = [
                event.what for event in (await bus.ask(COMPONENT_DATABASE, AskStory("left"), Story, within_s=1)).events
            ]
            assert told[0] == "was admitted as watcher"
            assert told[1].startswith("was not admitted: no component type 'wather'")

    run_virtual(main())


def test_a_second_of_a_kind_of_one_is_told_who_runs_and_where(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        async with local_mission() as network, beside(database(network)):
            assert (await admit(network, "world", "room")).name == "world"
            async with beside(begin(Probe, network, order(Subsystem.RESOURCE_POOL, "room", "world"))):
                with pytest.raises(MultiplicityExceeded) as exceeded:
                    await admit(network, "world", "second")
                assert (exceeded.value.facts["name"], exceeded.value.facts["host"]) == ("room", "a")
            assert (await admit(network, "world", "second")).name == "world"

    run_virtual(main())


def test_core_services_are_started_by_nobody_else(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        async with local_mission() as network, beside(database(network)):
            with pytest.raises(CoreService):
                await admit(network, "rc_manager", "mine")
            async with beside(begin(Probe, network, order(Subsystem.BACKBONE, "rc_manager", "rc_manager"))):
                with pytest.raises(MultiplicityExceeded, match="rc_manager runs on a"):
                    await admit(network, "rc_manager", "mine")

    run_virtual(main())


def test_after_a_hubs_restart_a_kind_of_one_waits_until_absence_means_something(beside: Any) -> None:
    async def main() -> None:
        network = LocalNetwork()
        hub = order(Subsystem.BACKBONE, "nameserver", "nameserver")
        async with beside(begin(Nameserver, network, hub)), beside(database(network)):
            clock = VirtualClock()
            assert (await admit(network, "watcher", "left")).name == "watcher"
            assert clock.now_s() < 0.5
            assert (await admit(network, "world", "room")).name == "world"
            assert clock.now_s() >= 1.0

    run_virtual(main())


def test_without_a_nameserver_the_answer_is_a_refusal_that_says_so(beside: Any) -> None:
    async def main() -> None:
        network = LocalNetwork()
        hub = begin(Nameserver, network, order(Subsystem.BACKBONE, "nameserver", "nameserver"))
        life = asyncio.create_task(hub.run())
        async with beside(database(network)):
            hub.end("killed")
            await life
            with pytest.raises(RunningUnknown):
                await admit(network, "world", "room")

    run_virtual(main())
