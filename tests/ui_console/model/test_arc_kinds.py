"""The kind of ARC that a console claims depends on the robot and on what its operator is to see, on no name."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.abilities import Abilities
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.naming import Subsystem
from ui_console.model.arc_kinds import NoArcKind, arc_kind, kinds_beside
from ui_console.model.profile import Sight


def arc(name: str, *needs: str, pictures: bool = False) -> ComponentType:
    """Return a kind of ARC whose body is the first of its needs."""
    abilities = Abilities(gives_pictures=pictures, body=needs[0])
    return ComponentType(
        name, "x:Y", Subsystem.RESOURCE_POOL, needs={kind: kind for kind in needs}, abilities=abilities
    )


TYPES = [
    ComponentType("scout", "x:Y", Subsystem.RESOURCE_POOL),
    arc("capture", "scout", "radio", "video", "grabber", pictures=True),
    arc("drive", "scout", "radio"),
    arc("lit_drive", "scout", "radio", "lamp"),
    arc("rover_drive", "rover", "radio"),
    arc("video_drive", "scout", "radio", "video"),
]
HARDWARE = [
    Resource("scout1", "scout", is_robot=True),
    Resource("rover1", "rover", is_robot=True),
    *(Resource(f"{kind}1", kind) for kind in ("radio", "video", "grabber")),
]


@pytest.mark.parametrize(
    ("robot", "sight", "kind"),
    [
        ("scout1", Sight.PICTURES, "capture"),
        ("scout1", Sight.BROADCAST, "video_drive"),
        ("scout1", Sight.NOTHING, "drive"),
        ("rover1", Sight.PICTURES, "rover_drive"),
        ("rover1", Sight.NOTHING, "rover_drive"),
        ("", Sight.PICTURES, "capture"),
    ],
)
def test_the_kind_suits_robot_and_sight(robot: str, sight: Sight, kind: str) -> None:
    assert arc_kind(robot, sight, TYPES, HARDWARE) == kind


def test_a_kind_whose_hardware_is_missing_gives_way_to_a_smaller_one() -> None:
    without_grabber = [one for one in HARDWARE if one.type != "grabber"]
    assert arc_kind("scout1", Sight.PICTURES, TYPES, without_grabber) == "video_drive"


def test_a_device_is_claimed_by_its_name_and_never_as_any_robot() -> None:
    types = [*TYPES, arc("light", "lamp")]
    hardware = [*HARDWARE, Resource("lamp1", "lamp")]
    assert arc_kind("lamp1", Sight.PICTURES, types, hardware) == "light"
    with pytest.raises(NoArcKind):
        arc_kind("", Sight.PICTURES, [arc("light", "lamp")], [Resource("lamp1", "lamp")])


@pytest.mark.parametrize(
    ("robot", "told"),
    [
        ("radio1", "radio1 is a radio, which no kind of ARC has as its body; the robots are rover1, scout1"),
        ("scuot1", r"no robot is named 'scuot1' \(did you mean 'scout1'\?\); there is rover1, scout1"),
    ],
)
def test_without_a_kind_for_the_robot_the_claim_is_refused(robot: str, told: str) -> None:
    with pytest.raises(NoArcKind, match=told):
        arc_kind(robot, Sight.PICTURES, TYPES, HARDWARE)


def test_a_robot_that_no_kind_drives_is_named_by_its_kind() -> None:
    with pytest.raises(NoArcKind, match="no kind of ARC has a body of kind rover"):
        arc_kind("rover1", Sight.NOTHING, TYPES[:3], HARDWARE)


@pytest.mark.parametrize(
    ("kind", "others"),
    [("drive", ["capture", "video_drive"]), ("rover_drive", []), ("scout", [])],
)
def test_other_kinds_have_a_body_of_the_same_type_and_all_their_hardware_is_there(kind: str, others: list[str]) -> None:
    [taken] = [one for one in TYPES if one.name == kind]
    assert kinds_beside(taken, TYPES, HARDWARE) == others
    assert kinds_beside(taken, TYPES, []) == []


@given(st.permutations(TYPES), st.permutations(HARDWARE), st.sampled_from(Sight), st.sampled_from(["scout1", "rover1"]))
def test_the_choice_depends_on_no_order(
    types: list[ComponentType], resources: list[Resource], sight: Sight, robot: str
) -> None:
    assert arc_kind(robot, sight, types, resources) == arc_kind(robot, sight, TYPES, HARDWARE)
