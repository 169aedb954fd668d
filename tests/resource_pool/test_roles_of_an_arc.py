"""Roles of an ARC's class that do not fit each other, or its RCs, are refused before anything starts."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar

import pytest

from backbone.mission.class_probe import facts_of
from backbone.mission.reader import MissionInvalid, read_mission
from resource_pool.aggregate_resource_controller import AggregateResourceController
from resource_pool.arc_commands import ArcCommands, WrongRoles
from resource_pool.commands import Jump
from resource_pool.rcs.skeleton import Shine


class LampArc(AggregateResourceController):
    roles: ClassVar[Any] = ("lamp",)
    commands: ClassVar[Any] = {Shine: "lamp"}
    body = "lamp"


class OneText(LampArc):
    roles = "lamp"


class Misspelt(LampArc):
    commands = {Shine: ["lamp", "lmap"]}


class OtherBody(LampArc):
    body = "scout"


class JumpingLamp(LampArc):
    commands = {Jump: "lamp"}


class WithoutRoles(LampArc):
    commands = (Jump,)  # type: ignore[assignment]


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        (WithoutRoles, "WithoutRoles: commands has no roles; write a mapping: {Command: 'role'}"),
        (OneText, "OneText: roles is a text; write a tuple, with a comma: ('lamp',)"),
        (Misspelt, "Misspelt: Shine names the role 'lmap'; its roles are: lamp"),
        (OtherBody, "OtherBody: body names the role 'scout'; its roles are: lamp"),
    ],
)
def test_roles_that_do_not_fit_each_other_are_refused_by_check_and_at_the_start(
    kind: type[AggregateResourceController], told: str
) -> None:
    assert facts_of(f"{__name__}:{kind.__name__}").failure == told
    with pytest.raises(WrongRoles):
        ArcCommands("own", kind.commands, kind.roles, kind.body)


def test_a_command_that_no_rc_of_its_role_obeys_is_refused_by_check(tmp_path: Path) -> None:
    file = tmp_path / "m.xml"
    file.write_text(
        '<mission name="m" priority="1"><types>'
        '<type name="lamp" class="resource_pool.rcs.skeleton:Lamp" subsystem="resource_pool"/>'
        f'<type name="own" class="{__name__}:JumpingLamp" subsystem="resource_pool"><needs type="lamp"/></type>'
        '</types><resources><resource type="lamp" name="lamp1" driver="resource_pool.rcs.skeleton:PaintedLamp">'
        '<parameter name="color" value="red"/></resource></resources></mission>'
    )
    with pytest.raises(MissionInvalid) as caught:
        read_mission(file)
    [fault] = caught.value.faults
    assert fault.message == "own passes jump on to its lamp, and no lamp obeys it"
    assert fault.remedy == "Declare it in commands of the class of lamp, which obeys: shine"


@pytest.mark.parametrize(
    ("needs", "told"),
    [
        ('<needs type="scout"/>', "needs scout"),
        ('<needs type="lamp"/><needs type="scout"/>', "needs lamp, scout"),
        ('<needs role="light" type="lamp"/>', "needs light (lamp)"),
    ],
)
def test_needs_that_are_not_the_roles_of_the_class_are_refused(tmp_path: Path, needs: str, told: str) -> None:
    """The class decides which RCs the ARC gets; placement and rehearsal went by the file."""
    file = tmp_path / "m.xml"
    text = (
        '<mission name="m" priority="1"><types>\n'
        '<type name="lamp" class="resource_pool.rcs.skeleton:Lamp" subsystem="resource_pool"/>\n'
        f'<type name="own" class="{__name__}:LampArc" subsystem="resource_pool">{needs}</type>\n'
        '</types><resources><resource type="lamp" name="lamp1" driver="resource_pool.rcs.skeleton:PaintedLamp">'
        '<parameter name="color" value="red"/></resource></resources></mission>'
    )
    file.write_text(text)
    with pytest.raises(MissionInvalid) as caught:
        read_mission(file)
    [fault] = caught.value.faults
    assert fault.message == f"type own {told}, and its class lamp"
    assert fault.remedy == 'Write <needs type="lamp"/>, or change roles of the class'
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith("class=")


@pytest.mark.parametrize(
    "class_path",
    ["resource_pool.rcs.skeleton:Lamp", "mission_control.behaviors.wait:Wait"],
    ids=["an RC", "a behavior"],
)
def test_a_type_with_needs_whose_class_is_no_arc_is_refused_by_check(tmp_path: Path, class_path: str) -> None:
    file = tmp_path / "m.xml"
    file.write_text(
        '<mission name="m" priority="1"><types>\n'
        f'<type name="own" class="{class_path}" subsystem="resource_pool"><needs type="scout"/></type>\n'
        "</types></mission>"
    )
    with pytest.raises(MissionInvalid) as caught:
        read_mission(file)
    [fault] = caught.value.faults
    assert fault.message == "type own needs scout, and its class nothing"
    assert fault.remedy == "Remove <needs>, or name the class of an ARC; its roles are what it needs"
    assert (fault.line, fault.column) == (2, 18)
