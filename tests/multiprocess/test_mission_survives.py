"""SIGKILL of each process of a running mission, one at a time."""

from __future__ import annotations

import asyncio
import contextlib
import os
import signal
from collections.abc import Callable
from pathlib import Path

import pytest
from running_mission import RunningMission, asked, mission_up, wait_gone

from backbone.bus.interface import Bus
from backbone.errors import LinkError, Refusal
from backbone.picture.look import look

pytestmark = [pytest.mark.processes, pytest.mark.timeout(400)]

RECOVERED_WITHIN_S = 20.0
LOOK_EVERY_S = 0.05
VICTIMS = [
    "watch-scout1",
    "watch-scout1-capture",
    "surveillance",
    "scout1",
    "radio",
    "video1",
    "grabber",
    "world",
    "dependency_database",
    "component_database",
    "placer",
    "rc_manager",
    "nameserver",
    "creator-base",
]
ONE_OF_EACH_PACK = ["watch-scout1", "scout1", "grabber", "world", "rc_manager", "nameserver", "creator-base"]


async def wait_until(mission: RunningMission, bus: Bus, what: str, holds: Callable[[dict], bool]) -> dict:
    """Return the status as soon as it fulfills the condition."""
    status: dict = {}
    try:
        async with asyncio.timeout(RECOVERED_WITHIN_S):
            while True:
                with contextlib.suppress(LinkError, Refusal):  # whoever knows has just been killed
                    status = (await look(bus, mission.clock.now_s())).to_json()
                    if holds(status):
                        return status
                await asyncio.sleep(LOOK_EVERY_S)
    except TimeoutError:
        raise AssertionError(f"not within {RECOVERED_WITHIN_S} s: {what}\n{status}\n{mission.story()}") from None


def names(status: dict) -> set[str]:
    return {c["name"] for c in status["components"] if c["state"] == "ready" and not c["name"].startswith("cli-")}


def turns(status: dict) -> dict[str, int]:
    return {request["arc"]: request["turns"] for request in status["requests"]}


def both_watchers_ask(status: dict) -> bool:
    return {"watch-scout1-capture", "watch-scout2-capture"} <= set(turns(status))


def somebody_runs(status: dict) -> bool:
    return any(request["state"] == "running" for request in status["requests"])


@pytest.mark.thorough
@pytest.mark.parametrize(("options", "victims"), [((), VICTIMS), (("--pack", "1"), ONE_OF_EACH_PACK)])
async def test_a_mission_recovers_from_the_death_of_each_of_its_processes(
    tmp_path: Path, options: tuple[str, ...], victims: list[str]
) -> None:
    trace = tmp_path / "run.jsonl"
    with mission_up("--trace", str(trace), *options) as mission:
        async with mission.bus() as bus:
            expected = names(
                await wait_until(mission, bus, "both watchers ask", lambda s: both_watchers_ask(s) and somebody_runs(s))
            )
            for victim in victims:
                there = await wait_until(mission, bus, f"{victim} is there", lambda s, v=victim: v in names(s))
                before = next(c["pid"] for c in there["components"] if c["name"] == victim)
                with contextlib.suppress(ProcessLookupError):  # the ARC of a behavior that was killed just now
                    os.kill(before, signal.SIGKILL)

                def recovered(status: dict, victim: str = victim, before: int = before) -> bool:
                    pids = {c["name"]: c["pid"] for c in status["components"]}
                    return (
                        pids.get(victim, before) != before
                        and expected <= names(status)
                        and both_watchers_ask(status)
                        and somebody_runs(status)
                        and not status["problems"]
                    )

                status = await wait_until(mission, bus, f"recovery from the death of {victim}", recovered)
                for rc in status["rcs"]:
                    assert rc["sharable"] or len(rc["holders"]) <= 1, rc
        assert await asyncio.to_thread(mission.down) in (0, 6), mission.story()


@pytest.mark.thorough
def test_nothing_is_left_after_the_death_of_the_launcher() -> None:
    with mission_up() as mission:
        mission.launcher.send_signal(signal.SIGKILL)
        mission.launcher.wait(5)
        left = wait_gone(mission.environment["SCOUT_TEST_MARK"], 3.0)
        assert not left, f"{left}\n{mission.story()}"
        assert not mission.directory.exists()
        status = asked(mission, "status")
        assert f"its launcher, process {mission.launcher.pid}, was killed" in status.stderr


@pytest.mark.thorough
@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_ends_the_mission_cleanly(how: signal.Signals) -> None:
    with mission_up() as mission:
        mission.launcher.send_signal(how)
        assert mission.launcher.wait(20) == 0, mission.story()
