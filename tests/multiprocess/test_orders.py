"""Orders over processes: a robot goes from stick to order and back, and no order outlives its console."""

from __future__ import annotations

import json
import signal
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from running_mission import BIN, RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(300)]

WITHIN_S = 30.0
GONE_WITHIN_S = 8.0  # a look at all components takes a second or two of a busy machine
ROBOT = "scout1"
ORDER = {"at_s": 0, "order": "watch_for_motion"}


class Script:
    """A console whose operator types lines of a script; what it answers is kept."""

    def __init__(self, mission: RunningMission) -> None:
        self.mission, self.heard = mission, list[dict[str, Any]]()
        words = ["attach", ROBOT, "--script", "-", "--mission", mission.name]
        self.process = subprocess.Popen(
            [str(BIN / "scout-console"), *words],
            env=mission.environment,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
        )
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def close(self) -> None:
        """End the console as SIGKILL does, if it has not ended; close its pipes."""
        self.process.kill()
        self.process.wait(WITHIN_S)
        self._reader.join(WITHIN_S)
        for pipe in (self.process.stdin, self.process.stdout):
            assert pipe is not None
            pipe.close()

    def _read(self) -> None:
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.heard.append(json.loads(line))

    def says(self, **line: Any) -> None:
        assert self.process.stdin is not None
        self.process.stdin.write(json.dumps(line) + "\n")
        self.process.stdin.flush()

    def count(self, event: str, state: str = "") -> int:
        return sum(one["event"] == event and state in ("", one.get("state")) for one in self.heard)

    def hears(self, event: str, state: str = "", times: int = 1) -> None:
        until(lambda: self.count(event, state) >= times, lambda: f"{event} {state}: {self.heard}", self.mission)

    @property
    def order(self) -> str:
        """Name of its first order's behavior."""
        return f"console-{self.process.pid}-order-1"


def until(condition: Callable[[], Any], what: Callable[[], str], mission: RunningMission) -> float:
    """Return after how many seconds the condition held."""
    began_s = time.monotonic()
    while not condition():
        assert time.monotonic() < began_s + WITHIN_S, f"never {what()}\n{mission.story()}"
        time.sleep(0.05)
    return time.monotonic() - began_s


def arc(mission: RunningMission) -> str:
    """Return the ARC that holds the robot; empty: none."""
    done = mission.command("scout-console", "monitor", "--once", "--mission", mission.name)
    [found] = [row["arc"] for row in json.loads(done.stdout)["robots"] if row["robot"] == ROBOT]
    return str(found)


@contextmanager
def ordered(mission: RunningMission) -> Iterator[Script]:
    """Give a console whose order is carried out."""
    script = Script(mission)
    try:
        script.hears("granted")
        script.says(**ORDER)
        script.hears("order", "running")
        yield script
    finally:
        script.close()


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up() as running:
        running.wait_for_components("watch-scout1", "watch-scout2")
        yield running


def names(mission: RunningMission) -> set[str]:
    return {component["name"] for component in mission.status()["components"]}


@pytest.mark.thorough
def test_a_halt_takes_the_robot_back_from_its_order(mission: RunningMission) -> None:
    with ordered(mission) as script:
        assert script.order in names(mission)
        assert arc(mission) == f"{script.order}-capture"
        script.says(at_s=0.1, halt=True)
        script.hears("order", "ended")
        script.hears("granted", times=2)
        script.says(at_s=0.2, release=True)
        script.hears("released", times=2)
        assert script.process.wait(WITHIN_S) == 0
    assert script.order not in names(mission)


@pytest.mark.thorough
@pytest.mark.parametrize("how", [signal.SIGKILL, signal.SIGSTOP, signal.SIGTERM])
def test_an_order_does_not_outlive_its_console(mission: RunningMission, how: signal.Signals) -> None:
    with ordered(mission) as script:
        script.process.send_signal(how)
        gone_s = until(lambda: script.order not in names(mission), lambda: "gone", mission)
        until(lambda: arc(mission) and script.order not in arc(mission), lambda: f"free: {arc(mission)}", mission)
        assert gone_s < GONE_WITHIN_S, f"the behavior was gone after {gone_s:.1f} s"
