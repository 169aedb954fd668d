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


def test_an_rc_that_no_arc_can_hold_is_remarked_on() -> None:
    assert "no ARC can hold it" in complete(Start("scout", "scout9"), [SCOUT1])[1]


def test_other_components_are_started_as_ordered() -> None:
    order = Start("watch_for_motion", "watch9", {"weight": 1})
    assert complete(order, [SCOUT1]) == (order, "")


def test_the_name_of_a_resource_is_refused_for_another_type() -> None:
    with pytest.raises(OtherType, match="scout1 is a scout"):
        complete(Start("command_radio", "scout1"), [SCOUT1])
