"""A mission on one core, and beside busy neighbors: slow, and no living process counts as dead."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
from collections.abc import Iterator

import pytest
from running_mission import RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

RUNS_S = 12.0  # two slices and a bit
HEALTHY_WITHIN_S = 30.0


@contextlib.contextmanager
def one_core() -> Iterator[None]:
    """Run everything that is started meanwhile on one core."""
    allowed = os.sched_getaffinity(0)
    os.sched_setaffinity(0, {min(allowed)})
    try:
        yield
    finally:
        os.sched_setaffinity(0, allowed)


@contextlib.contextmanager
def busy_neighbors(count: int) -> Iterator[None]:
    """Keep so many processes busy meanwhile."""
    neighbors = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(count)]
    try:
        yield
    finally:
        for neighbor in neighbors:
            neighbor.kill()
        for neighbor in neighbors:
            neighbor.wait()


def stays_whole(mission: RunningMission) -> None:
    """Let the mission run, and assert that nothing of it was replaced, and that it is healthy at the end."""
    time.sleep(RUNS_S)
    ends_s = time.monotonic() + HEALTHY_WITHIN_S
    while (status := mission.status())["health"] != "ok":
        assert time.monotonic() < ends_s, f"{status['health']}: {status['absent']}\n{mission.story()}"
        time.sleep(0.05)
    restarted = {c["name"]: c["restarts"] for c in status["components"] if c["restarts"]}
    assert not restarted, f"{restarted}\n{mission.story()}"
    assert {"watch-scout1-capture", "watch-scout2-capture"} <= {each["arc"] for each in status["requests"]}


@pytest.mark.thorough
def test_a_mission_on_one_core_comes_up_and_stays_whole() -> None:
    with one_core(), mission_up() as mission:
        stays_whole(mission)


@pytest.mark.thorough
@pytest.mark.alone
def test_a_mission_beside_twenty_busy_processes_comes_up_and_stays_whole() -> None:
    with busy_neighbors(20), mission_up() as mission:
        stays_whole(mission)


@pytest.mark.thorough
@pytest.mark.alone
def test_a_mission_beside_busy_processes_on_its_one_core_comes_up_and_stays_whole() -> None:
    with one_core(), busy_neighbors(5), mission_up() as mission:
        stays_whole(mission)
