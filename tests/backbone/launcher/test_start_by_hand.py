"""A component of the mission that is started by hand comes up as the mission declares it."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from typing import Any

import pytest

from backbone.addresses import DEPENDENCY_DATABASE, LAUNCHER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.interface import Bus
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.launcher.start_by_hand import OtherType, complete, completed
from backbone.placer.messages import AskDeclared, DeclaredOrder, Start
from backbone.wire import Envelope

DAY = Start("surveillance", "day", {"path": [["m", 10], ["day", 3]], "children": []}, host="base")
SCOUT1 = Resource("scout1", "scout", host="base", parameters={"network_id": 1, "world": "world"}, process="hardware")


def test_a_resource_of_the_mission_file_gets_its_parameters_host_and_process() -> None:
    whole, remark = complete(Start("scout", "scout1"), [SCOUT1])
    assert (whole.host, whole.process, remark) == ("base", "hardware", "")
    assert whole.parameters == SCOUT1.rc_parameters()


def test_what_the_operator_says_goes_before_the_mission_file() -> None:
    whole, _ = complete(Start("scout", "scout1", {"network_id": 7}, host="field", process="alone"), [SCOUT1])
    assert (whole.host, whole.process, whole.parameters["network_id"]) == ("field", "alone", 7)


def test_an_rc_that_the_mission_file_does_not_have_is_like_another_but_for_its_own_parameters() -> None:
    radios = [Resource("radio1", "command_radio", sharable=True, capacity=0.8, parameters={"port": "/dev/ttyUSB0"})]
    whole, remark = complete(Start("command_radio", "radio2", {"capacity": 0.5, "port": "/dev/ttyUSB1"}), radios)
    assert whole.parameters == {
        "driver": "simulated", "sharable": True, "capacity": 0.5, "links": {}, "port": "/dev/ttyUSB1"
    }  # fmt: skip
    assert remark == "radio2 is not in the mission file: it is like radio1, and can be claimed until it is stopped"
    assert "port" not in complete(Start("command_radio", "radio2"), radios)[0].parameters


def test_other_components_are_started_as_ordered() -> None:
    order = Start("watch_for_motion", "watch9", {"weight": 1})
    assert complete(order, [SCOUT1]) == (order, "")


def test_the_name_of_a_resource_is_refused_for_another_type() -> None:
    with pytest.raises(OtherType, match="scout1 is a scout"):
        complete(Start("command_radio", "scout1"), [SCOUT1])


Asked = Callable[[Callable[[Bus], Awaitable[None]]], None]


@pytest.fixture
def asked(local_mission: Any) -> Asked:
    """Return a function that runs a scene with a bus to a mission that declares ``SCOUT1`` and ``DAY``."""

    async def answer(question: Envelope[Any]) -> Any:
        match question.body:
            case AskDeclared(name=name):
                return DeclaredOrder(DAY if name == DAY.name else None)
            case _:
                return Resources([SCOUT1])

    def run(scene: Callable[[Bus], Awaitable[None]]) -> None:
        async def main() -> None:
            async with local_mission() as network:
                clock = VirtualClock()
                for served, questions in ((LAUNCHER, AskDeclared), (DEPENDENCY_DATABASE, AskResources)):
                    network.join(served, clock).serve(served, questions, answer)
                await scene(network.join("ui_console/cli-1", clock))

        run_virtual(main())

    return run


def test_a_behavior_of_the_tree_gets_its_place_and_any_other_name_nothing(asked: Asked) -> None:
    async def scene(bus: Bus) -> None:
        whole, remark = await completed(bus, Start("surveillance", "day", {"seconds": 1}))
        assert (whole.parameters, whole.host, remark) == ({**DAY.parameters, "seconds": 1}, "base", "")
        with pytest.raises(OtherType, match="day is a surveillance"):
            await completed(bus, Start("wait", "day"))
        for order in (Start("surveillance", "night"), Start("surveillance")):
            assert await completed(bus, order) == (order, "")

    asked(scene)
