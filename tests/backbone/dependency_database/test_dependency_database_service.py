"""The static dependency database on the bus."""

from __future__ import annotations

from typing import Any

import msgspec
import pytest

from backbone.addresses import DEPENDENCY_DATABASE
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.component.messages import AskStatistics, AskStory, Statistics, Story
from backbone.dependency_database.messages import AskResources, FindRcs, NoSuchHardware, RcSets, Resource, Resources
from backbone.dependency_database.service import DependencyDatabase
from backbone.naming import Subsystem

HARDWARE = [
    Resource("scout1", "scout", features=["camera"], links={"command_radio": ["radio"]}),
    Resource("radio", "command_radio", sharable=True, capacity=0.5),
]


def test_hardware_survives_the_way_through_a_launch_order(local_mission: Any, beside: Any) -> None:
    async def main() -> None:
        address = (Subsystem.BACKBONE, "dependency_database", "dependency_database")
        parameters = {"resources": [msgspec.to_builtins(resource) for resource in HARDWARE]}
        sent = msgspec.msgpack.encode(Launch("local", *address, "x:Y", "a", "", 0.0, 1.0, parameters))
        launch = msgspec.msgpack.decode(sent, type=Launch)
        clock = VirtualClock()
        async with (
            local_mission() as network,
            beside(DependencyDatabase(launch, network.join(launch.address, clock), clock)),
        ):
            bus = network.join("ui_console/asker", clock)
            known = await bus.ask(DEPENDENCY_DATABASE, AskResources(), Resources, within_s=1)
            assert known.resources == sorted(HARDWARE, key=lambda resource: resource.name)
            found = await bus.ask(
                DEPENDENCY_DATABASE, FindRcs({"scout": "scout", "command_radio": "command_radio"}), RcSets, within_s=1
            )
            assert found.sets == [{"scout": "scout1", "command_radio": "radio"}]
            with pytest.raises(NoSuchHardware):
                await bus.ask(DEPENDENCY_DATABASE, FindRcs({"framegrabber": "framegrabber"}), RcSets, within_s=1)
            counted = await bus.ask(DEPENDENCY_DATABASE, AskStatistics(), Statistics, within_s=1)
            assert (counted.values["searches_found"], counted.values["searches_refused"]) == (1.0, 1.0)
            story = await bus.ask(DEPENDENCY_DATABASE, AskStory("ui_console/asker"), Story, within_s=1)
            assert [event.what for event in story.events] == [
                "found 1 set of scout, command_radio",
                "found no hardware: no 'framegrabber' exists",
            ]

    run_virtual(main())
