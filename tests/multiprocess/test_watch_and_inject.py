"""What is said in a mission is watched, counted and injected by commands."""

from __future__ import annotations

import json
import subprocess
from collections.abc import Iterator
from typing import Any

import pytest
from examples import rest_thorough
from running_mission import MISSION_XML, RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

MIXED = MISSION_XML.parent / "docs" / "examples" / "mixed.xml"


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up(mission_xml=MIXED) as running:
        yield running


def printed(mission: RunningMission, *words: str) -> list[dict[str, Any]]:
    """Return what a command prints as JSON lines."""
    done = mission.command("scout-backbone", *words, "--json", "--mission", mission.name)
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.splitlines()]


@pytest.mark.thorough
def test_what_is_said_is_watched_live_with_questions_and_single_fields(mission: RunningMission) -> None:
    poses = printed(mission, "watch", "*/localizer/poses", "--most", "5", "--for", "20")
    assert len(poses) == 5
    assert {one["schema"].partition("/")[0] for one in poses} == {"Pose"}
    places = printed(mission, "watch", "*/localizer/poses", "--field", "x_m", "--most", "3", "--for", "20")
    assert all(isinstance(one["value"], float) for one in places)
    asked = printed(mission, "watch", "*/scout1/ask", "--for", "3")
    assert {"Move/1", "Applied/1"} <= {one["schema"] for one in asked}
    done = mission.command("scout-backbone", "watch", "nobody/*", "--for", "1", "--mission", mission.name)
    assert (done.returncode, done.stdout) == (0, "")


@pytest.mark.thorough
def test_the_busiest_keys_are_told_with_rates_and_sizes(mission: RunningMission) -> None:
    rows = printed(mission, "top", "--for", "3")
    sizes = [one["bytes_per_s"] for one in rows]
    assert sizes == sorted(sizes, reverse=True)
    [world] = [one for one in rows if one["key"].endswith("/world/bodies")]
    assert 15 < world["messages_per_s"] < 40
    assert world["bytes_per_s"] == pytest.approx(world["messages_per_s"] * world["mean_bytes"])
    lines = mission.command(
        "scout-backbone", "watch", "*/world/bodies", "--rate", "--for", "2.5", "--mission", mission.name
    )
    assert lines.stdout.count("world/bodies") >= 2, lines.stdout


def injected(mission: RunningMission, key: str, said: str) -> subprocess.CompletedProcess[str]:
    return mission.command("scout-backbone", "inject", key, said, "--mission", mission.name)


def test_a_message_is_injected_and_the_log_tells_who_did(mission: RunningMission) -> None:
    done = injected(mission, "resource_pool/scout1/ask", '{"schema": "AskState"}')
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["schema"].partition("/")[0], answer["address"]) == ("ComponentState", "resource_pool/scout1")
    log = mission.command("scout-backbone", "log", "--robot", "scout1", "--text", "injects", "--mission", mission.name)
    assert "AskState/1 at resource_pool/scout1/ask" in log.stdout
    told = '{"schema": "StoryEvent", "at_s": 1, "where": "x/y", "what": "hello", "subject": "rover1", "cause": ""}'
    assert injected(mission, "resource_pool/rover1/log", told).returncode == 0


@pytest.mark.parametrize(
    ("key", "said", "code", "told"),
    rest_thorough(
        [
            ("resource_pool/scout1/ask", '{"schema": "AskStory", "subjet": "x"}', 5, "did you mean 'subject'"),
            ("resource_pool/nobody/ask", '{"schema": "AskState"}', 4, "no component answered"),
            ("resource_pool/scout1", '{"schema": "AskState"}', 2, "no key"),
            ("resource_pool/*/ask", '{"schema": "AskState"}', 2, "no key"),
            ("resource_pool/scout1/asks", '{"schema": "AskState"}', 2, "did you mean 'ask'"),
            ("resource_pool/scout1/ask", "nonsense", 5, "no JSON"),
            ("resource_pool/scout1/ask", "[1]", 5, "no object"),
            ("resource_pool/scout1/ask", '{"schema": "AskStat"}', 5, "did you mean 'AskState'"),
            ("resource_pool/scout1/ask", '{"schema": "Move", "forward_m_s": 1e300, "turn_rad_s": 0}', 5, "Move/1"),
            ("resource_pool/scout1/ask", '{"schema": "SetParameter", "name": "x"}', 5, "no value"),
        ],
        quick=2,
    ),
)
def test_what_does_not_fit_is_not_injected(mission: RunningMission, key: str, said: str, code: int, told: str) -> None:
    done = injected(mission, key, said)
    assert (done.returncode, told in done.stderr) == (code, True), done.stderr
