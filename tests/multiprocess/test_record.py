"""A mission is recorded from beside it, and looked into without it."""

from __future__ import annotations

import asyncio
import json
import os
import random
import shutil
import signal
import subprocess
import tempfile
import time
from asyncio.subprocess import PIPE
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import psutil
import pytest
from running_mission import BIN, MISSION_XML, RunningMission, mission_up
from tutorial_commands import run_all

from backbone.addresses import RC_MANAGER
from backbone.bus.host_copies import HostCopies
from backbone.bus.zenoh_settings import HOST_LEASE_MS
from backbone.component.messages import StoryEvent
from backbone.keys import Conversation
from backbone.keys import key as key_of
from backbone.rc_manager.messages import AskSchedule, AskWhy
from backbone.recording.decisions import decided_anew
from backbone.recording.missing_numbers import missing_numbers
from backbone.recording.reader import Recorded, Recording
from backbone.recording.reasons import reasons_at
from backbone.scheduling.requests import UnknownRequest
from backbone.scheduling.views import Schedule, Why
from backbone.wire import WIRE_VERSION, Envelope, write

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

GUIDE = MISSION_XML.parent / "docs" / "how-to" / "record-a-mission.md"
MIXED = Path(__file__).parents[2] / "docs" / "examples" / "mixed.xml"
LOST_AT_MOST_S = 0.5
ASKED = 200
KILLS, QUICK_KILLS = 100, 3
HALT = '{"schema": "Halt", "epoch": 1}'
UNANSWERED = 4  # an ARC that ends is asked once more by creator, placer and RC manager
AWAITED = MIXED.read_text().count('process="hardware"')  # each minute a creator asks each member when it will end
CUT_SHORT = 3  # of a recorder: a console ends after the first of its three questions, and the end cancels one more


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up(mission_xml=MIXED) as running:
        yield running


@contextmanager
def recording_to(mission: RunningMission, path: Path, *options: str) -> Iterator[subprocess.Popen[str]]:
    """Record; the recorder has begun when this is entered."""
    words = [str(BIN / "scout-backbone"), "record", "--to", str(path), "--mission", mission.name, *options]
    recorder = subprocess.Popen(words, env=mission.environment, stderr=subprocess.PIPE, text=True)
    assert recorder.stderr is not None
    try:
        said = recorder.stderr.readline()
        assert said.startswith("records to"), said + recorder.stderr.read()
        yield recorder
    finally:
        recorder.kill()
        recorder.wait(10)
        recorder.stderr.close()


def ended(recorder: subprocess.Popen[str], by: signal.Signals = signal.SIGINT) -> str:
    recorder.send_signal(by)
    _none, said = recorder.communicate(timeout=20)
    assert recorder.returncode == 0, said
    return said


def unexplained(missing: Mapping[str, int]) -> int:
    """Return how many numbers are missing, without the open questions of a creator to its members and of a recorder."""
    recorder = sum(count for source, count in missing.items() if source.startswith("backbone/recorder-"))
    return sum(missing.values()) - min(missing.get("backbone/creator-base", 0), AWAITED) - min(recorder, CUT_SHORT)


def looked_into(mission: RunningMission, *words: str) -> list[dict[str, Any]]:
    """Return what ``scout-backbone recording … --json`` prints."""
    done = mission.command("scout-backbone", "recording", *words, "--json")
    assert done.returncode == 0, done.stderr + done.stdout
    return [json.loads(line) for line in done.stdout.splitlines()]


def messages(path: Path) -> list[Recorded]:
    with path.open("rb") as file:
        return [*Recording(file).messages()]


@pytest.mark.thorough
def test_every_command_of_the_guide_works() -> None:
    with tempfile.TemporaryDirectory(prefix="scout-record-") as name:
        shutil.copy(MISSION_XML, Path(name) / "mission.xml")
        run_all(GUIDE, Path(name))
        assert messages(Path(name) / "night.mcap")


@pytest.mark.thorough
def test_a_recording_has_all_messages_and_tells_what_the_mission_told(mission: RunningMission, tmp_path: Path) -> None:
    path = tmp_path / "it.mcap"
    with recording_to(mission, path) as recorder:
        time.sleep(3.0)
        done = mission.command(
            "scout-console",
            *("attach", "scout1", "--kind", "drive", "--script", "-", "--user", "anna", "--mission", mission.name),
            stdin='{"at_s": 0.1, "forward_m_s": 0.1, "turn_rad_s": 0}\n{"at_s": 1, "halt": true}\n',
        )
        assert done.returncode == 0, done.stderr
        time.sleep(1.0)
        said = ended(recorder)
    assert "incomplete" not in said
    found = messages(path)
    [info] = looked_into(mission, "info", str(path))
    assert (info["mission"], info["messages"]) == (mission.name, len(found))
    [checked] = looked_into(mission, "check", str(path))
    assert unexplained(checked["missing"]) <= UNANSWERED, checked
    for source in {one.source for one in found if one.source}:  # nobody sends that somebody is there or gone
        of_source = [one.sequence for one in found if one.source == source]
        assert of_source == sorted(of_source), f"{source}: in the order of sending"
        assert len(of_source) == len(set(of_source)), f"{source}: each once"
    schemas = {one.schema.partition("/")[0] for one in found}
    assert {"WorldState", "Pose", "Leases", "Schedule", "Applied", "RadioPacket", "Parameters", "Story"} <= schemas
    assert {"Move", "Admit", "Connect", "Disconnect", "TraceLine", "OperatorActed"} <= schemas, sorted(schemas)
    story = looked_into(mission, "story", str(path), "scout1")
    assert any("anna" in event["what"] for event in story), story
    shown = mission.command("scout-backbone", "recording", "mission", str(path))
    assert "<mission" in shown.stdout


@pytest.mark.thorough
@pytest.mark.alone  # half a second is measured on the machine
@pytest.mark.parametrize(
    "seed", [pytest.param(seed, marks=() if seed < QUICK_KILLS else pytest.mark.slow) for seed in range(KILLS)]
)
def test_of_a_killed_recorder_at_most_half_a_second_is_lost(mission: RunningMission, tmp_path: Path, seed: int) -> None:
    path, whole = tmp_path / "killed.mcap", tmp_path / "whole.mcap"
    with recording_to(mission, path) as recorder:
        begun_s = mission.clock.now_s()
        time.sleep(random.Random(seed).uniform(1.5, 3.0))
        killed_s = mission.clock.now_s()
        recorder.kill()
        recorder.wait(10)
    refused = mission.command("scout-backbone", "recording", "info", str(path))
    assert refused.returncode == 5
    assert "record recover" in refused.stderr
    done = mission.command("scout-backbone", "record", "recover", str(path), str(whole))
    assert done.returncode == 0, done.stderr
    found = messages(whole)
    assert found[-1].at_s > killed_s - LOST_AT_MOST_S
    # A question of a minute ago may be answered meanwhile; between it and the begin of the recording all is missing.
    before = [one for one in found if begun_s <= one.at_s <= killed_s - LOST_AT_MOST_S]
    missing = missing_numbers(before)
    assert unexplained(missing) <= UNANSWERED, f"of what was said before, nothing is lost in between: {missing}"
    again = mission.command("scout-backbone", "record", "recover", str(path), str(whole))
    assert (again.returncode, "exists" in again.stderr) == (2, True)


@pytest.mark.thorough
async def test_reasons_of_any_instant_are_those_that_were_given_then(tmp_path: Path) -> None:
    path = tmp_path / "it.mcap"
    drawn, given = random.Random(1), []
    with mission_up() as mission, recording_to(mission, path) as recorder:
        async with mission.bus() as bus:
            await asyncio.sleep(1.0)
            schedule = await bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=2.0)
            names = [*(one.arc for one in schedule.requests), *(one.rc for one in schedule.rcs)]
            for _question in range(ASKED):
                with suppress(UnknownRequest):  # on a busy machine an ARC may be silent so long that its request ends
                    given.append(await bus.ask(RC_MANAGER, AskWhy(drawn.choice(names)), Why, within_s=2.0))
                await asyncio.sleep(drawn.uniform(0.0, 0.1))
        await asyncio.to_thread(ended, recorder)
    assert len(given) > ASKED / 2
    assert len({why.state for why in given}) > 1
    with path.open("rb") as file:
        recording = Recording(file)
        known_s = min(one.at_s for one in recording.messages() if one.schema.startswith("ScheduleSnapshot/"))
        known = [why for why in given if why.at_s >= known_s]  # a busy machine may record its first snapshot late
        for why in drawn.sample(known, 40):
            assert reasons_at(recording, why.name, why.at_s).why == why
        found = decided_anew(recording)
    assert (found.difference, found.missing) == (None, 0)
    assert found.decisions > 5


def test_a_mission_that_was_brought_up_with_a_recording_has_it_from_the_first_decision_on(tmp_path: Path) -> None:
    path = tmp_path / "it.mcap"
    with mission_up("--record", str(path)) as mission:
        time.sleep(2.0)
        assert mission.down() == 0, mission.story()
    with path.open("rb") as file:
        recording = Recording(file)
        assert decided_anew(recording, policy="strict").decisions > 5
        for alive in (True, False):
            seen = {one.key.split("/")[3] for one in recording.messages(("*/alive",)) if one.body["alive"] is alive}
            assert seen >= {"rc_manager", "placer", "scout1", "watch-scout1"}, alive
        assert "<mission" in recording.mission_xml()


@pytest.mark.thorough
def test_a_recorder_that_is_killed_is_absent_until_the_recording_goes_on(tmp_path: Path) -> None:
    path = tmp_path / "it.mcap"
    with mission_up("--record", str(path)) as mission:
        [recorder] = [one for one in psutil.Process(mission.launcher.pid).children() if "record" in one.cmdline()]
        recorder.kill()
        wait_for(lambda: "recorder" in {one["name"] for one in mission.status()["absent"]}, mission)
        wait_for(lambda: mission.status()["health"] == "ok", mission)
        assert mission.down() == 0, mission.story()
    assert path.with_stem("it-2").stat().st_size > 0
    assert messages(path.with_stem("it-2"))


@pytest.mark.thorough
def test_a_recorder_that_hangs_is_absent_with_a_remedy_until_it_responds(tmp_path: Path) -> None:
    path = tmp_path / "it.mcap"
    with mission_up("--record", str(path)) as mission:
        [recorder] = [one for one in psutil.Process(mission.launcher.pid).children() if "record" in one.cmdline()]
        recorder.suspend()
        wait_for(lambda: "recorder" in {one["name"] for one in mission.status()["absent"]}, mission)
        [absent] = [one for one in mission.status()["absent"] if one["name"] == "recorder"]
        assert "respond" in absent["cause"]
        assert f"kill -CONT {recorder.pid}" in absent["remedy"]
        hangs_s = absent["since_s"]
        recorder.resume()
        wait_for(lambda: mission.status()["health"] == "ok", mission)
        recorder.suspend()
        assert mission.down() == 0, mission.story()
    assert not path.with_stem("it-2").exists()
    found = messages(path)
    assert any(hangs_s - 1.0 < one.at_s < hangs_s for one in found), "what was said meanwhile waited at its senders"
    assert "resource_pool/scout1" not in missing_numbers(found)


@pytest.mark.thorough
async def test_the_recorder_of_a_host_writes_its_copies_alone_and_ends_with_the_process_that_started_it(
    mission: RunningMission, tmp_path: Path
) -> None:
    path = tmp_path / "far.mcap"
    with tempfile.TemporaryDirectory(prefix="s-") as folder:
        words = ["record", "--to", str(path), "--mission", mission.name, "--host-folder", folder, "--host-only"]
        recorder = await asyncio.create_subprocess_exec(
            *(str(BIN / "scout-backbone"), *words), env=mission.environment, stdin=PIPE, stderr=PIPE
        )
        assert recorder.stdin is not None
        assert recorder.stderr is not None
        async with asyncio.timeout(30.0):
            await recorder.stderr.readline()
            copies = HostCopies(Path(folder))
            story = StoryEvent(1.0, "resource_pool/far", "it is far", "far", "")
            envelope = Envelope(WIRE_VERSION, "resource_pool/far", 1, mission.clock.now_s(), "", story)
            copies.send(key_of(mission.name, "resource_pool/far", Conversation.LOG), write(envelope))
            await asyncio.sleep(1.0)
            copies.close()
            recorder.stdin.close()
            assert await recorder.wait() == 0
    [found] = messages(path)
    assert (found.id, found.body["what"]) == ("resource_pool/far#1", "it is far")


def test_a_recording_that_exists_is_refused_before_anything_runs(tmp_path: Path) -> None:
    path = tmp_path / "it.mcap"
    path.write_bytes(b"another")
    words = [str(BIN / "scout-backbone"), "up", str(MIXED), "--headless", "--record", str(path)]
    done = subprocess.run(words, capture_output=True, text=True, timeout=60, check=False)
    assert (done.returncode, done.stdout) == (4, "")
    assert "exists" in done.stderr
    assert path.read_bytes() == b"another"


@pytest.mark.thorough
def test_a_recording_is_played_as_a_mission_that_takes_no_commands(tmp_path: Path) -> None:
    path = tmp_path / "it.mcap"
    with mission_up("--record", str(path)) as mission:
        time.sleep(2.0)
        assert mission.down() == 0, mission.story()
        name = f"replay-{mission.name}"
        [info] = looked_into(mission, "info", str(path))
        before_its_end = ["--from", str(info["end_s"] - 1.5), "--speed", "0.01"]
        words = [str(BIN / "scout-backbone"), "replay", str(path), *before_its_end, "--mission", name]
        with subprocess.Popen(words, env=mission.environment, stderr=subprocess.PIPE, text=True) as player:
            assert player.stderr is not None
            assert player.stderr.readline().startswith("plays "), player.stderr.read()
            shown = mission.command("scout-backbone", "status", "--json", "--mission", name)
            lit = mission.command("scout-backbone", "inject", "resource_pool/scout1/ask", HALT, "--mission", name)
            down = mission.command("scout-backbone", "down", "--mission", name)
        late = mission.command("scout-backbone", "replay", str(path), "--from", "1e9")
    assert (late.returncode, "recording ends at" in late.stderr) == (5, True)
    assert player.returncode == down.returncode == 0
    assert {rc["rc"] for rc in json.loads(shown.stdout)["rcs"]} >= {"radio", "scout1", "scout2", "video1"}
    assert lit.returncode == 5, lit.stdout
    assert "is a recording" in lit.stderr


def wait_for(holds: Callable[[], bool], mission: RunningMission) -> None:
    until_s = time.monotonic() + 15.0
    while not holds():
        assert time.monotonic() < until_s, mission.story()
        time.sleep(0.05)


@pytest.mark.thorough
def test_a_recorder_that_hangs_delays_nobody(mission: RunningMission, tmp_path: Path) -> None:
    with recording_to(mission, tmp_path / "hangs.mcap") as recorder:
        time.sleep(1.0)
        recorder.send_signal(signal.SIGSTOP)
        try:
            for _ in range(20):
                assert {one["name"] for one in mission.status()["absent"]} <= {f"recorder-{recorder.pid}"}
                time.sleep(0.2)
        finally:
            recorder.send_signal(signal.SIGCONT)
        ended(recorder)


def absent_remedies(mission: RunningMission) -> dict[str, str]:
    return {one["name"]: one["remedy"] for one in mission.status()["absent"]}


@pytest.mark.thorough
def test_a_recorder_begun_by_hand_is_named_while_it_hangs_and_no_longer(
    mission: RunningMission, tmp_path: Path
) -> None:
    with recording_to(mission, tmp_path / "paused.mcap") as paused:
        name = f"recorder-{paused.pid}"
        paused.send_signal(signal.SIGSTOP)
        try:
            wait_for(lambda: f"kill -CONT {paused.pid}" in absent_remedies(mission).get(name, ""), mission)
        finally:
            paused.send_signal(signal.SIGCONT)
        wait_for(lambda: name not in absent_remedies(mission), mission)
        ended(paused)
    with recording_to(mission, tmp_path / "killed.mcap") as killed:
        time.sleep(1.0)
    with recording_to(mission, tmp_path / "lost.mcap") as lost:
        lost.send_signal(signal.SIGSTOP)
        wait_for(lambda: f"recorder-{lost.pid}" in absent_remedies(mission), mission)
        time.sleep(HOST_LEASE_MS / 1000)  # its link expires, and it is named all the same
        assert f"recorder-{lost.pid}" in absent_remedies(mission)
    wait_for(lambda: not absent_remedies(mission), mission)
    log = mission.command("scout-backbone", "log", "--text", "recover", "--mission", mission.name).stdout
    assert (name in log, log.count(f"recorder-{killed.pid} "), log.count(f"recorder-{lost.pid} ")) == (False, 1, 1), log


@pytest.mark.thorough
def test_what_cannot_be_recorded_is_refused_with_a_remedy(mission: RunningMission, tmp_path: Path) -> None:
    there = tmp_path / "there.mcap"
    there.touch()
    for words, told in (
        (["--to", str(there)], "exists"),
        (["--to", str(tmp_path / "no" / "x.mcap")], "cannot be written"),
    ):
        done = mission.command("scout-backbone", "record", *words, "--mission", mission.name)
        assert (done.returncode, told in done.stderr) == (2, True), done.stderr
    assert os.path.getsize(there) == 0
    done = mission.command("scout-backbone", "record", "--mission", "nobody")
    assert done.returncode == 4
