"""A place outside the mission's room, to which a behavior would go, is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from mission_files import MISSION_XML, faults_in, read_text

MISSION = MISSION_XML.read_text()
LOCALIZER = '<resource type="localizer" name="localizer" process="hardware"/>'
HALL = LOCALIZER.replace("/>", '><parameter name="width_m" value="30"/></resource>')


def go_to(x_m: str, y_m: str, localizer: str = "localizer") -> str:
    given = {"x_m": x_m, "y_m": y_m, "localizer": localizer}
    parameters = "".join(f'<parameter name="{name}" value="{value}"/>' for name, value in given.items())
    arc = '<arc kind="drive" minimum-runtime-s="5"/>'
    return MISSION.replace(
        "</behaviors>", f'<behavior type="go_to" name="go" priority="1">{parameters}{arc}</behavior></behaviors>'
    )


@pytest.mark.parametrize("localizer", ["localizer", "resource_pool/localizer", "world"])
@pytest.mark.parametrize(
    ("x_m", "y_m", "message", "remedy"),
    [
        ("30", "2", "x at 30 m", "The room goes from 0 to 9 m along x"),
        ("-0.1", "2", "x at -0.1 m", "The room goes from 0 to 9 m along x"),
        ("2", "6.5", "y at 6.5 m", "The room goes from 0 to 6 m along y"),
    ],
)
def test_one_that_is_outside(tmp_path: Path, x_m: str, y_m: str, message: str, remedy: str, localizer: str) -> None:
    text = go_to(x_m, y_m, localizer)
    [fault] = faults_in(tmp_path, text)
    assert (fault.message, fault.remedy) == (f"go would go outside the room: {message}", remedy)
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith(f'value="{x_m if "x" in message else y_m}"')


@pytest.mark.parametrize(
    "text",
    [
        go_to("0", "6"),
        go_to("9", "0"),
        go_to("30", "2").replace(LOCALIZER, HALL),
        go_to("30", "2", "ui_console/console-9"),
    ],
)
def test_one_that_is_inside_or_in_a_room_that_the_file_does_not_show_passes(tmp_path: Path, text: str) -> None:
    read_text(tmp_path, text)
