"""A resource that is started by hand comes up as the mission file says."""

from __future__ import annotations

import pytest

from backbone.dependency_database.messages import Resource
from backbone.launcher.start_by_hand import OtherType, complete
from backbone.placer.messages import Start

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
