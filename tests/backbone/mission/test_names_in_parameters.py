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


def progress_of(source: str, equals: str = "success") -> str:
    given = {"message": "BehaviorState", "source": source, "field": "status", "equals": equals}
    parameters = "".join(f'<parameter name="{one}" value="{value}"/>' for one, value in given.items())
    first = '<behavior type="wait" name="first" priority="1"><parameter name="seconds" value="1"/></behavior>'
    condition = f'<behavior type="condition" name="own" priority="1">{parameters}</behavior>'
    attempts = '<parameter name="num_attempts" value="2"/>'
    inner = f'<behavior type="retry" name="inner" priority="1">{attempts}{condition}</behavior>'
    outer = f'<behavior type="sequence" name="outer" priority="1">{first}{inner}</behavior>'
    return MISSION.replace("</behaviors>", f"{outer}</behaviors>")


@pytest.mark.parametrize("equals", ["success", "failure"])
@pytest.mark.parametrize("source", ["outer", "mission_control/inner", "own"])
def test_a_condition_on_the_end_of_its_own_branch_is_refused(tmp_path: Path, source: str, equals: str) -> None:
    text = progress_of(source, equals)
    [fault] = faults_in(tmp_path, text)
    name = source.rpartition("/")[2]
    assert fault.message == f"own asks whether {name} has ended with {equals}, and is part of it"
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith(f'value="{source}"')


@pytest.mark.parametrize("text", [progress_of("first"), progress_of("watch-scout1"), progress_of("outer", "running")])
def test_a_condition_on_another_branch_or_its_present_progress_passes(tmp_path: Path, text: str) -> None:
    read_text(tmp_path, text)
