"""The mission of IROS 2001, figure 2, as real processes, and those that look at it from beside."""

from __future__ import annotations

import json
import math
import re
import subprocess
import time
import urllib.request
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from free_ports import free_port
from prometheus_client.parser import text_string_to_metric_families
from running_mission import BIN, RunningMission, asked, mission_up, status_when_settled
from tool_at_a_port import tool_at

from resource_pool.localization import AskPose, Pose

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

RCS = {"scout1", "scout2", "scout3", "radio", "video1", "grabber", "localizer"}
SEEN_WITHIN_S = 30.0
CORE_ORDER = ["nameserver", "component_database", "placer", "creator-base", "dependency_database", "rc_manager"]


def trace_of(file: Path) -> list[dict[str, object]]:
    """Return the finished lines of a trace."""
    return [json.loads(line) for line in file.read_text().rpartition("\n")[0].splitlines()]


@pytest.fixture(scope="module")
def mission() -> RunningMission:
    with mission_up() as running:
        running.wait_for_components("watch-scout1", "watch-scout2")
        yield running


def test_core_services_become_ready_in_the_papers_order(mission: RunningMission) -> None:
    """RAM 2002: nameserver, component database, placer, creators, static dependency database, RC manager."""
    said = [re.sub(r"\s+\d+ ms$", "", line).strip("✓ ") for line in mission.lines if "✓" in line]
    assert said[: len(CORE_ORDER)] == CORE_ORDER


def test_status_lists_every_component_under_one_of_four_subsystems(mission: RunningMission) -> None:
    status = status_when_settled(mission)
    by_name = {component["name"]: component for component in status["components"]}
    assert set(CORE_ORDER) <= set(by_name)
    assert {by_name[rc]["subsystem"] for rc in RCS} == {"resource_pool"}
    assert by_name["watch-scout1"]["subsystem"] == "mission_control"
    assert {rc["rc"] for rc in status["rcs"]} == RCS


def test_a_whole_mission_is_ok(mission: RunningMission) -> None:
    status_when_settled(mission)
    done = mission.command("scout-backbone", "status", "--json", "--mission", mission.name)
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(done.stdout)
    assert found["health"] == "ok"
    assert found["absent"] == found["problems"] == found["stops"] == []
    text = asked(mission, "status").stdout
    assert text.splitlines()[0].endswith("health ok")


def test_a_monitor_without_a_screen_tells_the_same_as_json_lines(mission: RunningMission) -> None:
    command = [str(BIN / "scout-console"), "monitor", "--json", "--mission", mission.name]
    with subprocess.Popen(command, env=mission.environment, stdout=subprocess.PIPE, text=True) as watching:
        assert watching.stdout is not None
        words = {json.loads(watching.stdout.readline())["event"] for _line in range(5)}
        watching.terminate()
    assert "schedule" in words


def test_a_script_is_told_once_all_that_screens_show(mission: RunningMission) -> None:
    done = mission.command("scout-console", "monitor", "--once", "--mission", mission.name)
    assert done.returncode == 0, done.stderr + mission.story()
    view = json.loads(done.stdout)
    assert view["mission"] == mission.name
    assert [robot["robot"] for robot in view["robots"]] == ["scout1", "scout2", "scout3"]
    assert [node["name"] for node in view["tree"]] == ["surveillance", "watch-scout1", "watch-scout2"]
    assert [row["rc"] for row in view["timeline"]["rows"]]
    assert not view["own"]["is_asked"]


def counters(port: int) -> dict[tuple[str, ...], float]:
    with urllib.request.urlopen(f"http://127.0.0.1:{port}/metrics", timeout=10) as page:
        families = text_string_to_metric_families(page.read().decode())
        counted = [sample for family in families if family.type == "counter" for sample in family.samples]
    return {(one.name, *(value for _name, value in sorted(one.labels.items()))): one.value for one in counted}


def held_s(found: dict[tuple[str, ...], float], rc: str) -> float:
    """Return for how long the RC was held."""
    return sum(value for (name, *of), value in found.items() if name == "scout_rc_held_seconds_total" and rc in of)


def test_prometheus_reads_who_held_what_and_no_counter_falls(mission: RunningMission) -> None:
    port = free_port()
    with tool_at(mission, "metrics", port):
        before, until_s = counters(port), time.monotonic() + SEEN_WITHIN_S
        while not (held_s(before, "video1") and any(name == "scout_rc_grants_total" for name, *_ in before)):
            assert time.monotonic() < until_s, before
            time.sleep(0.2)
            after = counters(port)
            assert all(after[name] >= value for name, value in before.items())
            before = after
    assert held_s(before, "video1") <= before["scout_watched_seconds_total",]


def test_a_port_that_is_taken_is_refused(mission: RunningMission) -> None:
    port = free_port()
    with tool_at(mission, "metrics", port):
        for command in ("bridge", "metrics"):
            done = mission.command("scout-backbone", command, "--port", str(port), "--mission", mission.name)
            assert (done.returncode, "--port" in done.stderr) == (2, True), done.stderr


def test_why_names_the_blocker_of_the_waiting_watcher(mission: RunningMission) -> None:
    done = asked(mission, "why", "watch-scout1", "--json")
    assert done.returncode == 0, done.stderr
    why = json.loads(done.stdout)["why"]
    assert why["state"] in ("running", "connecting", "waiting", "revoking")
    if why["state"] == "waiting":
        is_next = why["lines"][0].endswith("it is next, its RCs are coming free")
        assert why["blockers"] == ([] if is_next else ["watch-scout2-capture"])


def test_story_of_the_radio_tells_of_its_connections(mission: RunningMission) -> None:
    done = asked(mission, "story", "radio")
    assert done.returncode == 0, done.stderr
    assert "connected under epoch" in done.stdout


def test_a_second_core_service_is_refused_and_told_who_runs(mission: RunningMission) -> None:
    done = asked(mission, "start", "rc_manager")
    assert done.returncode == 5, done.stdout + done.stderr
    assert "rc_manager" in done.stderr
    assert "base" in done.stderr


def test_a_second_mission_of_the_same_name_is_refused(mission: RunningMission) -> None:
    file = Path(mission.environment["XDG_RUNTIME_DIR"]) / "mission.xml"
    done = mission.command("scout-backbone", "up", str(file), "--headless")
    assert done.returncode == 4
    assert "is up" in done.stderr


@pytest.mark.thorough
def test_components_are_started_and_stopped_while_the_others_keep_their_processes(mission: RunningMission) -> None:
    before = {c["name"]: c["pid"] for c in mission.status()["components"] if "-capture" not in c["name"]}
    started = asked(mission, "start", "video_frequency", "--name", "video9")
    assert started.returncode == 0, started.stderr
    assert mission.component("video9")["state"] == "ready"
    stopped = asked(mission, "stop", "video9")
    assert stopped.returncode == 0, stopped.stderr
    after = {c["name"]: c["pid"] for c in mission.status()["components"]}
    assert "video9" not in after
    assert {name: after.get(name) for name in before if not name.startswith("cli-")} == {
        name: pid for name, pid in before.items() if not name.startswith("cli-")
    }


@pytest.mark.thorough
def test_who_shares_a_process_is_stopped_alone_and_started_in_it_again(mission: RunningMission) -> None:
    """Which components share a process is a line in mission.xml."""

    def pids() -> dict[str, int]:
        return {c["name"]: c["pid"] for c in mission.status()["components"] if c["name"] in RCS}

    before = pids()
    assert len({before[rc] for rc in RCS - {"grabber"}}) == 1
    assert before["grabber"] not in {before[rc] for rc in RCS - {"grabber"}}
    stopped = asked(mission, "stop", "scout3")
    assert stopped.returncode == 0, stopped.stderr
    assert pids() == {rc: pid for rc, pid in before.items() if rc != "scout3"}
    words = ("scout-console", "attach", "scout3", "--profile", "pendant", "--mission", mission.name, "--script", "-")
    done = mission.command(*words, stdin='{"at_s":0.1,"release":true}\n')
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}\n{mission.story()}"
    assert pids() == before


async def test_a_console_drives_a_robot_and_its_behavior_goes_on_afterwards(mission: RunningMission) -> None:
    watcher = mission.component("watch-scout1")["pid"]
    async with mission.bus() as bus:
        before = await bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=2)
        script = '{"at_s":0.2,"left_rad_s":6,"right_rad_s":-6}\n{"at_s":1.2,"release":true}\n'
        words = ("scout-console", "attach", "scout1", "--priority", "100", "--mission", mission.name, "--script", "-")
        done = mission.command(*words, stdin=script)
        after = await bus.ask("resource_pool/world", AskPose("scout1"), Pose, within_s=2)
    events = [json.loads(line) for line in done.stdout.splitlines()]
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}\n{mission.story()}"
    kinds = [event["event"] for event in events]
    assert kinds[0] == "granted"
    assert "applied" in kinds
    assert kinds[-1] == "released"
    turned = math.remainder(after.heading_rad - before.heading_rad, math.tau)
    assert abs(turned) > 0.5, f"turned {turned:.2f} rad\n{mission.story()}"
    assert mission.component("watch-scout1")["pid"] == watcher


def test_an_unknown_robot_is_refused_with_a_remedy(mission: RunningMission) -> None:
    done = mission.command("scout-console", "attach", "scout7", "--mission", mission.name, "--script", "-", stdin="")
    assert done.returncode == 5, done.stdout + done.stderr
    refused = json.loads(done.stdout.splitlines()[-1])
    assert refused["event"] == "refused"
    assert refused["remedy"]


@pytest.mark.thorough
def test_equal_watchers_take_turns_and_the_judge_agrees(tmp_path: Path, judged) -> None:
    """IROS 2001, section 5.1: round robin; two seconds each here, whole minutes of five are among the long tests."""
    trace = tmp_path / "run.jsonl"

    def grants() -> list[tuple[object, Any]]:
        return [(line["arc"], line["t"]) for line in trace_of(trace) if line["ev"] == "grant"]

    with mission_up("--trace", str(trace), change={'runtime-s="5"': 'runtime-s="2"'}) as running:
        deadline = time.monotonic() + SEEN_WITHIN_S
        while len(grants()) < 5:
            assert time.monotonic() < deadline, running.story()
            time.sleep(0.2)
        assert running.down() == 0, running.story()
    arcs = [arc for arc, _ in grants()]
    assert all(first != second for first, second in pairwise(arcs))
    starts = [at for _, at in grants()]
    assert all(later - earlier >= 2.3 for earlier, later in pairwise(starts)), starts  # 2 s, then the picture settles
    judged(trace)


@pytest.mark.thorough
def test_two_missions_run_side_by_side() -> None:
    with mission_up() as one, mission_up() as other:
        ones, others = one.status(), other.status()
        assert ones["mission"] != others["mission"]
        assert not {c["pid"] for c in ones["components"]} & {c["pid"] for c in others["components"]}
