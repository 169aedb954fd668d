"""A parameter that names a component, body or unit that the mission does not have is refused."""

from __future__ import annotations

from pathlib import Path

import pytest
from mission_files import MISSION_XML, faults_in, read_text

MISSION = MISSION_XML.read_text()
ARC = '<arc kind="drive" minimum-runtime-s="5"/>'


def mission(kind: str, arc: str = ARC, **parameters: str) -> str:
    given = "".join(f'<parameter name="{name}" value="{value}"/>' for name, value in parameters.items())
    return MISSION.replace(
        "</behaviors>", f'<behavior type="{kind}" name="own" priority="1">{given}{arc}</behavior></behaviors>'
    )


def go_to(localizer: str) -> str:
    return mission("go_to", x_m="1", y_m="1", localizer=localizer)


def motion_of(source: str) -> str:
    return mission("condition", arc="", message="MotionSeen", source=source)


def follow(target: str, localizer: str = "world") -> str:
    return mission("follow", target=target, localizer=localizer)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (go_to("radio"), "no localizer is named 'radio'"),
        (go_to("resource_pool/watch-scout1-capture"), "no localizer is named 'resource_pool/watch-scout1-capture'"),
        (go_to("localiser"), "no localizer is named 'localiser' (did you mean 'localizer'?)"),
        (go_to("watch-scout1"), "no localizer is named 'watch-scout1'"),
        (go_to("elsewhere/localizer"), "no localizer is named 'elsewhere/localizer' (did you mean 'localizer'?)"),
        (go_to("../.."), "no localizer is named '../..'"),
        (
            go_to("resource_pool/localiser"),
            "no localizer is named 'resource_pool/localiser' (did you mean 'localizer'?)",
        ),
        (motion_of("watch-scuot1"), "no component is named 'watch-scuot1' (did you mean 'watch-scout1'?)"),
        (
            motion_of("mission_control/scout1"),
            "no component is named 'mission_control/scout1' (did you mean 'watch-scout1'?)",
        ),
        (follow("poineer"), "no body is named 'poineer' (did you mean 'pioneer'?)"),
    ],
)
def test_a_name_that_nothing_has_is_refused(tmp_path: Path, text: str, message: str) -> None:
    [fault] = faults_in(tmp_path, text)
    assert fault.message.startswith(message)
    assert fault.remedy.startswith("There is: ")
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith("value=")


@pytest.mark.parametrize(
    "text",
    [
        go_to("world"),
        go_to("resource_pool/localizer"),
        go_to("ui_console/console-9"),
        motion_of("*"),
        motion_of("watch-scout2"),
        motion_of("creator-base"),
        motion_of("resource_pool/watch-scout1-capture"),
        follow("scout2", "localizer"),
        follow("pioneer"),
    ],
)
def test_a_name_of_something_or_of_what_the_file_does_not_show_passes(tmp_path: Path, text: str) -> None:
    read_text(tmp_path, text)
