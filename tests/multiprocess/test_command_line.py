"""The command line as scripts use it: exit codes, data on stdout, talk on stderr."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest
from running_mission import MARK, MISSION_XML, RunningMission, marked, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

BIN = Path(sys.executable).parent
BROKEN = Path(__file__).parents[1] / "backbone" / "mission" / "broken"


def command(*words: str, folder: Path, mark: str = "cli") -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(folder), MARK: mark}
    return subprocess.run(
        [str(BIN / words[0]), *words[1:]], env=environment, capture_output=True, text=True, timeout=90, check=False
    )


def test_a_good_mission_file_is_fine(tmp_path: Path) -> None:
    done = command("scout-backbone", "check", str(MISSION_XML), folder=tmp_path)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("words", [("check",), ("up",), ("up", "--headless", "--detach")])
def test_a_broken_mission_file_is_refused_and_nothing_is_started(words: tuple[str, ...], tmp_path: Path) -> None:
    file = sorted(BROKEN.glob("*.xml"))[0]
    done = command("scout-backbone", *words, str(file), folder=tmp_path, mark=str(tmp_path))
    assert done.returncode == 3, done.stderr
    assert f"{file}:" in done.stdout
    assert not marked(str(tmp_path))
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ("scout-backbone", "status"),
        ("scout-backbone", "components"),
        ("scout-backbone", "resources"),
        ("scout-backbone", "why", "scout1"),
        ("scout-backbone", "story", "scout1"),
        ("scout-backbone", "start", "scout"),
        ("scout-backbone", "stop", "scout1"),
        ("scout-backbone", "down"),
        ("scout-console", "attach", "scout1", "--script", "-"),
    ],
    ids=" ".join,
)
def test_without_a_mission_a_command_says_so_and_exits_with_4(words: tuple[str, ...], tmp_path: Path) -> None:
    done = command(*words, folder=tmp_path)
    assert done.returncode == 4, done.stdout + done.stderr
    assert "no mission is up" in done.stdout + done.stderr


@pytest.mark.parametrize("words", [("up",), ("up", str(MISSION_XML), "--speed", "0"), ("nothing",)], ids=" ".join)
def test_wrong_usage_exits_with_2(words: tuple[str, ...], tmp_path: Path) -> None:
    assert command("scout-backbone", *words, folder=tmp_path).returncode == 2


def test_a_detached_mission_goes_on_until_it_is_told_to_end(tmp_path: Path) -> None:
    mark = f"detached-{os.getpid()}"
    up = command("scout-backbone", "up", str(MISSION_XML), "--detach", folder=tmp_path, mark=mark)
    try:
        assert up.returncode == 0, up.stderr
        status = command("scout-backbone", "status", "--json", folder=tmp_path)
        assert json.loads(status.stdout)["mission"] == "iros2001"
    finally:
        down = command("scout-backbone", "down", folder=tmp_path)
    assert down.returncode == 0, down.stderr
    assert "asking was enough" in down.stderr
    assert not marked(mark)
    assert not list((tmp_path / "scout-backbone").iterdir())


@pytest.fixture(scope="module")
def mission() -> RunningMission:
    with mission_up() as running:
        yield running


def test_an_unknown_name_is_refused_with_its_likeliest_spelling(mission: RunningMission) -> None:
    done = mission.command("scout-backbone", "why", "scuot1", "--mission", mission.name)
    assert done.returncode == 5
    assert "scout1" in done.stderr


def test_a_parameter_of_a_running_behavior_is_set(mission: RunningMission) -> None:
    words = ("scout-backbone", "set", "watch-scout1", "again_after_s", "2.5", "--mission", mission.name)
    done = mission.command(*words)
    assert done.returncode == 0, done.stderr
    wrong = mission.command(*words[:4], "soon", "--mission", mission.name)
    assert wrong.returncode == 5
    assert "again_after_s" in wrong.stderr


@pytest.mark.thorough
def test_what_a_behavior_asks_for_is_shown_and_changed(mission: RunningMission) -> None:
    def set_(*words: str) -> subprocess.CompletedProcess[str]:
        return mission.command("scout-backbone", "set", "--mission", mission.name, *words)

    assert set_("watch-scout1", "minimum_runtime_s", "4").returncode == 0
    assert set_("watch-scout1", "priority", "-3").stdout.splitlines()[0] == "watch-scout1: priority is -3"
    moved = set_("watch-scout1", "parent", mission.name)
    assert moved.returncode == 0, moved.stderr
    [request] = json.loads(set_("watch-scout1", "--json").stdout)["requests"]
    assert [node["name"] for node in request["path"]] == [mission.name, "watch-scout1"]
    assert (request["path"][-1]["priority"], request["minimum_runtime_s"]) == (-3, 4.0)
    assert "parent             surveillance" in set_("watch-scout2").stdout
    refused = set_("surveillance", "parent", "watch-scout2")
    assert (refused.returncode, "scheduling.not_movable" in refused.stderr) == (5, True)
    assert set_("watch-scout1", "parent", "surveillance").returncode == 0
    assert set_("watch-scout1", "priority", "1").returncode == 0
    assert set_("watch-scout1", "minimum_runtime_s", "5").returncode == 0


def test_a_stopped_rc_is_started_again_when_it_is_claimed(mission: RunningMission) -> None:
    """RAM 2002: the RC manager checks that the RCs requested are running and starts them if they are not."""
    stopped = mission.command("scout-backbone", "stop", "scout3", "--mission", mission.name)
    assert stopped.returncode == 0, stopped.stderr
    script = '{"at_s":0.1,"left_rad_s":2,"right_rad_s":2}\n{"at_s":0.3,"release":true}\n'
    words = ("scout-console", "attach", "scout3", "--priority", "100", "--mission", mission.name, "--script", "-")
    done = mission.command(*words, stdin=script)
    assert done.returncode == 0, done.stdout + done.stderr + mission.story()
    assert mission.component("scout3")["requester"] == "backbone/rc_manager"


def test_an_rc_started_by_hand_comes_up_as_the_mission_file_says(mission: RunningMission) -> None:
    for words in (("stop", "scout2"), ("start", "scout", "--name", "scout2")):
        done = mission.command("scout-backbone", *words, "--mission", mission.name)
        assert done.returncode == 0, done.stderr
    shown = mission.command("scout-backbone", "set", "scout2", "network_id", "--mission", mission.name)
    assert "2" in shown.stdout, shown.stdout + shown.stderr
    assert mission.component("scout2")["pid"] == mission.component("scout1")["pid"]


@pytest.mark.thorough
def test_a_behavior_started_by_hand_has_its_place_in_the_tree(mission: RunningMission) -> None:
    for words in (("stop", "surveillance"), ("start", "surveillance", "--name", "surveillance")):
        done = mission.command("scout-backbone", *words, "--mission", mission.name)
        assert done.returncode == 0, done.stderr
    wait_for(lambda: {"watch-scout1", "watch-scout2"} <= names(mission), "its children run again", mission)
    other = mission.command("scout-backbone", "start", "wait", "--name", "surveillance", "--mission", mission.name)
    assert (other.returncode, "start.other_type" in other.stderr) == (5, True), other.stderr


@pytest.mark.thorough
def test_a_machine_that_is_offered_takes_components_and_leaves_nothing_when_it_is_withdrawn(
    mission: RunningMission,
) -> None:
    words = (
        "creator",
        "--host",
        "field",
        "--connect",
        mission.endpoint,
        "--mission",
        mission.name,
        "--tag",
        "outdoors",
    )
    offered = subprocess.Popen([str(BIN / "scout-backbone"), *words], env=mission.environment, stderr=subprocess.PIPE)
    try:
        wait_for(lambda: "creator-field" in names(mission), "the creator is ready", mission)
        start = ("scout-backbone", "start", "video_frequency", "--name", "video7", "--host", "field")
        done = mission.command(*start, "--mission", mission.name)
        assert done.returncode == 0, done.stderr
        assert mission.component("video7")["host"] == "field"
    finally:
        offered.send_signal(signal.SIGINT)
        _, said = offered.communicate(timeout=20)
    assert offered.returncode == 0, said
    wait_for(lambda: not {"creator-field", "video7"} & names(mission), "what ran there is gone", mission)
    assert mission.command("scout-backbone", "stop", "video7", "--mission", mission.name).returncode == 0


def names(mission: RunningMission) -> set[str]:
    return {component["name"] for component in mission.status()["components"]}


def wait_for(holds: Callable[[], bool], what: str, mission: RunningMission) -> None:
    deadline = time.monotonic() + 15.0
    while not holds():
        assert time.monotonic() < deadline, f"not within 15 s: {what}\n{mission.story()}"


@pytest.mark.slow
@pytest.mark.timeout(400)
def test_twenty_starts_in_a_row_show_the_papers_order(tmp_path: Path) -> None:
    order = ["nameserver", "component_database", "placer", "creator-base", "dependency_database", "rc_manager"]
    for _ in range(20):
        with mission_up("--for", "0") as running:
            assert running.launcher.wait(30) == 0, running.story()
        steps = [line.split()[1] for line in running.lines if "✓" in line]
        assert steps[: len(order)] == order
