"""What an operator sees of a mission that lacks something: in ``status``, ``why``, ``story`` and ``up``."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import statistics
import time
from collections.abc import Callable, Iterator
from itertools import pairwise

import pytest
from running_mission import RunningMission, mission_up

from backbone.addresses import LAUNCHER
from backbone.component.messages import AskState, ComponentState, LifeState, StoryEvent
from backbone.keys import Conversation
from backbone.picture.health import MissionHealth
from backbone.wire import Envelope
from resource_pool.arc_client import ask_stop, lift_stop, stop_robot

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

HEALTHS = 8


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as up:
        yield up


def status(mission: RunningMission) -> tuple[int, dict]:
    done = mission.command("scout-backbone", "status", "--json", "--mission", mission.name)
    assert done.stdout, done.stderr
    return done.returncode, json.loads(done.stdout)


def wait_for(mission: RunningMission, holds: Callable[[int, dict], bool], what: str, within_s: float = 30.0) -> dict:
    deadline = time.monotonic() + within_s
    while time.monotonic() < deadline:
        code, found = status(mission)
        if holds(code, found):
            return found
    raise AssertionError(f"not within {within_s} s: {what}\n{code} {found}\n{mission.story()}")


@contextlib.contextmanager
def paused(*pids: int) -> Iterator[None]:
    try:
        for pid in pids:
            os.kill(pid, signal.SIGSTOP)
        yield
    finally:
        for pid in pids:
            with contextlib.suppress(ProcessLookupError):
                os.kill(pid, signal.SIGCONT)


@pytest.mark.thorough
def test_a_core_service_that_hangs_is_absent_in_status_why_and_up_until_it_answers(mission: RunningMission) -> None:
    with paused(mission.component("dependency_database")["pid"], mission.component("rc_manager")["pid"]):
        mission.wait_for_line("health degraded", 30.0)
        with paused(mission.launcher.pid):  # it would replace them while the commands ask
            found = wait_for(mission, lambda _, found: found["health"] != "ok", "the RC manager is missed")
            absent = {absence["name"]: absence for absence in found["absent"]}
            assert absent["rc_manager"]["vital"]
            why = mission.command("scout-backbone", "why", "rc_manager", "--mission", mission.name)
            assert "rc_manager is absent for" in why.stdout, why.stderr
            story = mission.command("scout-backbone", "story", "scout1", "--mission", mission.name)
            assert story.returncode == 0
            assert "incomplete: " in story.stderr
            assert "rc_manager: " in story.stderr
    wait_for(mission, lambda code, found: (code, found["health"]) == (0, "ok"), "health ok again")
    mission.wait_for_line("health ok", 10.0)


@pytest.mark.thorough
def test_a_nameserver_that_hangs_is_replaced(mission: RunningMission) -> None:
    hung = mission.component("nameserver")["pid"]
    with paused(hung):
        mission.wait_for_line("nameserver is absent", 10.0)
        wait_for(mission, lambda code, found: (code, found["health"]) == (0, "ok"), "health ok again")
    assert mission.component("nameserver")["pid"] != hung


@pytest.mark.thorough
def test_a_mission_whose_nameserver_and_launcher_hang_has_a_status_all_the_same(mission: RunningMission) -> None:
    nameserver = mission.component("nameserver")["pid"]
    with paused(mission.launcher.pid, nameserver):  # nobody is left who could replace the nameserver
        code, found = status(mission)
        assert (code, found["health"]) == (6, "failed")
        assert [absence["name"] for absence in found["absent"]] == ["launcher", "nameserver"]
    wait_for(mission, lambda code, found: (code, found["health"]) == (0, "ok"), "health ok again")


@pytest.mark.thorough
def test_a_standing_emergency_stop_is_in_status_and_why_until_it_is_lifted(mission: RunningMission) -> None:
    async def stop(reason: str) -> None:
        async with mission.bus() as bus:
            if reason:
                await stop_robot(bus, "scout1", reason, "anna")
            else:
                await lift_stop(bus, await ask_stop(bus, "scout1"), "anna")

    asyncio.run(stop("child in the \x1b[2Jroom"))
    found = wait_for(mission, lambda _, found: bool(found["stops"]), "the stop is in status")
    (shown,) = found["stops"]
    assert (shown["name"], shown["by"], shown["reason"]) == ("scout1", "anna", "child in the \\x1b[2Jroom")
    text = mission.command("scout-backbone", "status", "--mission", mission.name).stdout
    why = mission.command("scout-backbone", "why", "scout1", "--mission", mission.name).stdout
    for said in (text, why):
        assert "scout1 is STOPPED by anna for" in said
        assert "child in the \\x1b[2Jroom" in said
        assert "\x1b" not in said
    assert not [line for line in mission.lines if "\x1b" in line]
    asyncio.run(stop(""))
    wait_for(mission, lambda _, found: not found["stops"], "the stop is lifted")
    assert "STOPPED" not in mission.command("scout-backbone", "why", "scout1", "--mission", mission.name).stdout


@pytest.mark.thorough
def test_a_stranger_on_the_bus_writes_no_escape_to_any_terminal(mission: RunningMission) -> None:
    hostile = "\x1b]0;owned\x07\x1b[2J\rall is well [/red]"

    async def main() -> None:
        async with mission.bus() as bus:
            for at in ("ui_console/tester", "resource_pool/scout1"):
                bus.publish(at, Conversation.LOG, StoryEvent(1.0, at, hostile, hostile, hostile))
            scout = next(c for c in mission.status()["components"] if c["name"] == "scout3")  # no ARC holds it
            at = "resource_pool/scout3"
            known = (await bus.ask(at, AskState(), ComponentState, within_s=2)).start
            state = ComponentState(at, "scout", scout["host"], scout["pid"], LifeState.READY, 1.0, hostile, start=known)
            bus.publish("resource_pool/scout3", Conversation.STATUS, state)
            await asyncio.sleep(0.5)

    asyncio.run(main())
    mission.wait_for_line("all is well", 10.0)
    shown = [
        mission.command("scout-backbone", *words, "--mission", mission.name)
        for words in (["status"], ["status", "--json"], ["why", "scout3"], ["story", "scout3"])
    ]
    assert "all is well [/red]" in shown[0].stdout
    assert all(done.returncode == 0 for done in shown)
    for text in ("".join(done.stdout + done.stderr for done in shown), "".join(mission.lines)):
        assert text.replace("\n", "").isprintable()


@pytest.mark.thorough
def test_a_cause_in_a_story_can_be_asked_about(mission: RunningMission) -> None:
    told = mission.command("scout-backbone", "story", "scout1", "--mission", mission.name).stdout
    causes = [line.rpartition("because of ")[2] for line in told.splitlines() if "because of backbone/" in line]
    assert causes, told
    cause = causes[-1]
    address = cause.partition("#")[0]
    for name in (cause, address, address.rpartition("/")[2]):
        why = mission.command("scout-backbone", "why", name, "--mission", mission.name)
        story = mission.command("scout-backbone", "story", name, "--mission", mission.name)
        assert (why.returncode, story.returncode) == (0, 0), why.stderr + story.stderr
        assert why.stdout
        assert story.stdout
    asked = mission.command("scout-backbone", "story", cause, "--mission", mission.name).stdout
    assert all(line.endswith(f"because of {cause}") for line in asked.splitlines())


@pytest.mark.thorough
def test_the_launcher_says_every_second_how_its_mission_is(mission: RunningMission) -> None:
    async def main() -> list[float]:
        stamps: list[float] = []
        enough = asyncio.Event()

        def heard(said: Envelope[MissionHealth]) -> None:
            stamps.append(said.stamp_s)
            if len(stamps) == HEALTHS:
                enough.set()

        async with mission.bus() as bus:
            bus.subscribe(LAUNCHER, Conversation.HEALTH, MissionHealth, heard)
            await asyncio.wait_for(enough.wait(), 5.0 * HEALTHS)
        return stamps

    stamps = asyncio.run(main())
    # A busy machine makes some pauses longer; a change of the health shortens them.
    assert statistics.median(later - earlier for earlier, later in pairwise(stamps[:HEALTHS])) < 1.3, stamps
