"""What a console offers for a robot follows from what ARC and RCs declare, and from no name of a robot."""

from __future__ import annotations

import pytest

from backbone.component.abilities import Abilities, CommandForm, FieldForm, ValueKind
from backbone.component_database.messages import ComponentType
from backbone.dependency_database.messages import Resource
from backbone.naming import Subsystem
from resource_pool.arcs.drive import DriveArc
from resource_pool.arcs.skeleton import LitDriveArc
from resource_pool.rcs.scout import MOST_M_S, MOST_TURN_RAD_S, Scout
from resource_pool.rcs.skeleton import Lamp
from ui_console.model.arc_abilities import SLOW, ArcAbilities, KindChoice, Reach, arc_abilities


def of_class(name: str, cls: type[DriveArc] | type[Scout] | type[Lamp], needs: dict[str, str]) -> ComponentType:
    return ComponentType(name, "x:Y", Subsystem.RESOURCE_POOL, needs=needs, abilities=cls.abilities())


TYPES = [
    of_class("scout", Scout, {}),
    of_class("lamp", Lamp, {}),
    of_class("drive", DriveArc, DriveArc.kinds()),
    of_class("lit_drive", LitDriveArc, LitDriveArc.kinds()),
]


def made(kind: str, types: list[ComponentType]) -> ArcAbilities:
    found = arc_abilities(kind, types)
    assert found is not None
    return found


def number(name: str, most: float) -> FieldForm:
    return FieldForm(name, ValueKind.NUMBER, least=-most, most=most)


def test_a_body_reaches_what_its_rc_declares_and_is_moved_by_the_stick_alone() -> None:
    found = made("drive", TYPES)
    assert found.reach == Reach(MOST_M_S, MOST_TURN_RAD_S)
    assert found.can_halt
    assert [command.title for command in found.commands] == ["jump"]
    assert found.moves("jump")


def test_a_device_beside_the_body_brings_its_command_with_unit_and_limits() -> None:
    shine = made("lit_drive", TYPES).commands[-1]
    assert (shine.title, shine.role, shine.form.moves) == ("shine", "lamp", False)
    [field] = shine.form.fields
    assert (field.name, field.least, field.most, field.is_required) == ("brightness", 0.0, 1.0, True)
    assert not made("lit_drive", TYPES).moves("shine")


def test_the_kinds_that_an_operator_can_choose_name_what_comes_with_them() -> None:
    hardware = [Resource(f"{kind}1", kind) for kind in LitDriveArc.kinds().values()]
    found = arc_abilities("lit_drive", TYPES, hardware)
    assert found is not None
    assert found.kinds == [
        KindChoice("lit_drive", "lit drive: command radio, lamp, scout"),
        KindChoice("drive", "drive: command radio, scout"),
    ]
    assert made("lit_drive", TYPES).kinds == [], "without hardware there is no choice"


def test_two_devices_of_one_kind_have_a_command_each_with_the_limits_of_its_rc() -> None:
    def pan(most: float, *roles: str) -> CommandForm:
        return CommandForm("pan_to", [number("pan_rad", most)], roles=list(roles))

    types = [
        ComponentType(kind, "x:Y", Subsystem.RESOURCE_POOL, abilities=Abilities(commands=[pan(most)]))
        for kind, most in (("wide", 3.0), ("narrow", 1.0))
    ]
    arc = Abilities(commands=[pan(100.0, "left", "right")])
    needs = {"left": "wide", "right": "narrow"}
    types.append(ComponentType("eyes", "x:Y", Subsystem.RESOURCE_POOL, needs=needs, abilities=arc))
    found = made("eyes", types)
    assert [(one.title, one.form.fields[0].most) for one in found.commands] == [
        ("pan to (left)", 3.0),
        ("pan to (right)", 1.0),
    ]
    assert found.reach is None, "what has no body does not move"
    assert not found.can_halt


@pytest.mark.parametrize("with_rc", [True, False])
def test_a_body_whose_limits_are_not_declared_is_slow(with_rc: bool) -> None:
    move = CommandForm("move", [number("forward_m_s", 100.0), number("turn_rad_s", 1e3)], moves=True, roles=["body"])
    arc = Abilities(body="body", commands=[move])
    types = [ComponentType("walk", "x:Y", Subsystem.RESOURCE_POOL, needs={"body": "dog"}, abilities=arc)]
    if with_rc:
        types.append(ComponentType("dog", "x:Y", Subsystem.RESOURCE_POOL, abilities=Abilities(commands=[move])))
    assert made("walk", types).reach == SLOW


def test_what_a_person_cannot_be_asked_for_is_not_offered() -> None:
    odd, plain = FieldForm("path", ValueKind.OTHER, is_required=True), FieldForm("path", ValueKind.OTHER)
    commands = [
        CommandForm("follow", [odd], roles=["eye"]),
        CommandForm("look", [plain, number("pan", 1.0)], roles=["eye"]),
    ]
    arc = Abilities(commands=commands)
    [look] = made("eyes", [ComponentType("eyes", "x:Y", Subsystem.RESOURCE_POOL, abilities=arc)]).commands
    assert [field.name for field in look.form.fields] == ["pan"]
    assert look.labels == ["pan, -1 to 1"]


def test_an_undeclared_command_counts_as_one_that_moves() -> None:
    assert made("drive", TYPES).moves("somersault")


def test_a_kind_that_the_mission_lacks_is_unknown() -> None:
    assert arc_abilities("fly", TYPES) is None
