"""An operator at one mission, with the command line alone.

First they find out who moved a robot, why it waits, and how a name is spelled; then they change what runs.
"""

from __future__ import annotations

import json
import re
import signal
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from examples import rest_thorough
from running_mission import BIN, RunningMission, asked, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

LONG_NUMBER = re.compile(r"\d\.\d{7}")
DRIVE = '{"at_s":0.1,"left_rad_s":3,"right_rad_s":3}\n{"at_s":0.5,"release":true}\n'


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        words = ("scout-console", "attach", "scout2", "--mission", running.name, "--user", "Anna B.", "--script", "-")
        done = running.command(*words, stdin=DRIVE)
        assert done.returncode == 0, done.stdout + done.stderr + running.story()
        yield running


def test_who_moved_a_robot_is_found_after_the_console_has_gone(mission: RunningMission) -> None:
    done = asked(mission, "log", "--robot", "scout2", "--person", "anna b.", "--since", "10m", "--json")
    assert done.returncode == 0, done.stderr
    events = json.loads(done.stdout)["events"]
    assert [event["person"] for event in events if "is driven by" in event["what"]] == ["Anna B."]
    assert all(event["level"] in ("alarm", "warning", "notice", "info") for event in events)
    shown = asked(mission, "log", "--text", "DRIVEN BY").stdout
    assert "scout2" in shown
    assert "Anna B." in shown


def test_a_story_is_one_object_and_calls_nobody_by_a_number(mission: RunningMission) -> None:
    done = asked(mission, "story", "scout2", "--json")
    told = json.loads(done.stdout)
    assert told["name"] == "scout2"
    assert {"at_s", "level", "subject", "what", "person", "where", "cause"} == told["events"][0].keys()
    shown = asked(mission, "story", "scout2").stdout
    assert "Anna B.: connected under epoch" in shown
    assert not re.search(r"console-\d+-drive", shown)


def test_why_knows_machines_alarms_and_events(mission: RunningMission) -> None:
    assert "base is a machine of the mission" in asked(mission, "why", "base").stdout
    assert "scout1 is ready on base" in asked(mission, "why", "rc_down:scout1").stdout
    causes = [event["cause"] for event in json.loads(asked(mission, "story", "scout2", "--json").stdout)["events"]]
    cause = next(each for each in reversed(causes) if each.startswith("backbone/rc_manager#"))
    told = asked(mission, "why", cause.removeprefix("backbone/")).stdout
    assert "this message led to:" in told


def test_a_robot_that_is_misspelled_is_one_sentence(mission: RunningMission) -> None:
    words = ("scout-console", "attach", "scuot1", "--mission", mission.name, "--script", "-")
    done = mission.command(*words, stdin=DRIVE)
    assert done.returncode == 5
    refused = json.loads(done.stdout.splitlines()[0])
    assert refused["detail"].startswith("no robot is named 'scuot1' (did you mean 'scout1'?)")
    assert "Traceback" not in done.stdout + done.stderr
    assert "\n" not in refused["detail"]


@pytest.mark.parametrize("words", [("status",), ("why", "scout2"), ("story", "scout2"), ("log",), ("set", "radio")])
def test_numbers_are_for_people(mission: RunningMission, words: tuple[str, ...]) -> None:
    done = asked(mission, *words)
    assert done.returncode == 0, done.stderr
    assert not LONG_NUMBER.search(done.stdout), done.stdout


def completed(mission: RunningMission, program: str, typed: str, shell: str) -> list[str]:
    """Return what a shell offers where the typed words end."""
    words = typed.split(" ")
    asked = {
        f"_{program.upper().replace('-', '_')}_COMPLETE": f"complete_{shell}",
        "COMP_WORDS": typed,
        "COMP_CWORD": str(len(words) - 1),
        "_TYPER_COMPLETE_ARGS": typed,
    }
    done = subprocess.run(
        [str(BIN / program)], env=mission.environment | asked, capture_output=True, text=True, timeout=30, check=False
    )
    assert "Traceback" not in done.stderr, done.stderr
    return re.findall(r"[a-z0-9_-]+", done.stdout)


@pytest.mark.parametrize("shell", rest_thorough(["bash", "zsh"]))
@pytest.mark.parametrize(
    ("program", "typed", "offered"),
    [
        ("scout-backbone", "scout-backbone why scout", {"scout1", "scout2", "scout3"}),
        ("scout-backbone", "scout-backbone story watch-", {"watch-scout1", "watch-scout1-capture"}),
        ("scout-backbone", "scout-backbone log --robot ra", {"radio"}),
        ("scout-console", "scout-console attach ", {"scout1", "scout2", "scout3"}),
    ],
)
def test_names_are_completed_from_the_mission_that_is_up(
    mission: RunningMission, shell: str, program: str, typed: str, offered: set[str]
) -> None:
    found = completed(mission, program, typed, shell)
    assert offered <= set(found)


def test_missions_that_are_up_are_completed(mission: RunningMission, tmp_path: Path) -> None:
    assert mission.name in completed(mission, "scout-backbone", "scout-backbone status --mission ", "bash")


def test_top_ends_when_its_time_is_over_though_nobody_reads_it(full_pipe: int, mission: RunningMission) -> None:
    words = [str(BIN / "scout-backbone"), "top", "--for", "0.5", "--mission", mission.name]
    done = subprocess.run(
        words, env=mission.environment, stdout=full_pipe, stderr=subprocess.PIPE, text=True, timeout=60, check=False
    )
    assert done.returncode == 1
    assert "came faster than they were read" in done.stderr


def test_a_message_is_injected_and_the_log_tells_who_did(mission: RunningMission) -> None:
    done = asked(mission, "inject", "resource_pool/scout1/ask", '{"schema": "AskState"}')
    assert done.returncode == 0, done.stderr
    answer = json.loads(done.stdout)
    assert (answer["schema"].partition("/")[0], answer["address"]) == ("ComponentState", "resource_pool/scout1")
    log = asked(mission, "log", "--robot", "scout1", "--text", "injects")
    assert "AskState/1 at resource_pool/scout1/ask" in log.stdout
    told = '{"schema": "StoryEvent", "at_s": 1, "where": "x/y", "what": "hello", "subject": "rover1", "cause": ""}'
    assert asked(mission, "inject", "resource_pool/rover1/log", told).returncode == 0


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
    done = asked(mission, "inject", key, said)
    assert (done.returncode, told in done.stderr) == (code, True), done.stderr


def test_an_unknown_name_is_refused_with_its_likeliest_spelling(mission: RunningMission) -> None:
    done = asked(mission, "why", "scuot1")
    assert done.returncode == 5
    assert "scout1" in done.stderr


def test_a_parameter_of_a_running_behavior_is_set(mission: RunningMission) -> None:
    done = asked(mission, "set", "watch-scout1", "again_after_s", "2.5")
    assert done.returncode == 0, done.stderr
    wrong = asked(mission, "set", "watch-scout1", "again_after_s", "soon")
    assert wrong.returncode == 5
    assert "again_after_s" in wrong.stderr


@pytest.mark.thorough
def test_what_a_behavior_asks_for_is_shown_and_changed(mission: RunningMission) -> None:
    def set_(*words: str) -> subprocess.CompletedProcess[str]:
        return asked(mission, "set", *words)

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
    stopped = asked(mission, "stop", "scout3")
    assert stopped.returncode == 0, stopped.stderr
    script = '{"at_s":0.1,"left_rad_s":2,"right_rad_s":2}\n{"at_s":0.3,"release":true}\n'
    words = ("scout-console", "attach", "scout3", "--priority", "100", "--mission", mission.name, "--script", "-")
    done = mission.command(*words, stdin=script)
    assert done.returncode == 0, done.stdout + done.stderr + mission.story()
    assert mission.component("scout3")["requester"] == "backbone/rc_manager"


def test_an_rc_started_by_hand_comes_up_as_the_mission_file_says(mission: RunningMission) -> None:
    for words in (("stop", "scout2"), ("start", "scout", "--name", "scout2")):
        done = asked(mission, *words)
        assert done.returncode == 0, done.stderr
    shown = asked(mission, "set", "scout2", "network_id")
    assert "2" in shown.stdout, shown.stdout + shown.stderr
    assert mission.component("scout2")["pid"] == mission.component("scout1")["pid"]


@pytest.mark.thorough
def test_a_behavior_started_by_hand_has_its_place_in_the_tree(mission: RunningMission) -> None:
    for words in (("stop", "surveillance"), ("start", "surveillance", "--name", "surveillance")):
        done = asked(mission, *words)
        assert done.returncode == 0, done.stderr
    wait_for(lambda: {"watch-scout1", "watch-scout2"} <= names(mission), "its children run again", mission)
    other = asked(mission, "start", "wait", "--name", "surveillance")
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
        wait_for(lambda: "creator-field" in names(mission), "the creator is there", mission)
        done = asked(mission, "start", "video_frequency", "--name", "video7", "--host", "field")
        assert done.returncode == 0, done.stderr
        assert mission.component("video7")["host"] == "field"
    finally:
        offered.send_signal(signal.SIGINT)
        _, said = offered.communicate(timeout=20)
    assert offered.returncode == 0, said
    wait_for(lambda: not {"creator-field", "video7"} & names(mission), "what ran there is gone", mission)
    assert asked(mission, "stop", "video7").returncode == 0


def names(mission: RunningMission) -> set[str]:
    return {component["name"] for component in mission.status()["components"]}


def wait_for(holds: Callable[[], bool], what: str, mission: RunningMission) -> None:
    deadline = time.monotonic() + 15.0
    while not holds():
        assert time.monotonic() < deadline, f"not within 15 s: {what}\n{mission.story()}"
        time.sleep(0.05)
