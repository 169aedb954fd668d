"""A script whose process stands still for longer than its hold lasts: it hears once that its robot is lost."""

from __future__ import annotations

import json
import signal
import subprocess
import threading
import time
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
from running_mission import BIN, RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.slow, pytest.mark.timeout(300)]

WITHIN_S = 60.0
PAUSE_S = 8.0  # longer than a lease, and than the hub waits for a silent client
LINES = [{"at_s": at_s, "left_rad_s": 3, "right_rad_s": 3} for at_s in range(600)]


class Listener:
    """Keeps the events of a script."""

    def __init__(self, process: subprocess.Popen[str]) -> None:
        self.heard: list[dict[str, Any]] = []
        self._process = process
        threading.Thread(target=self._read, daemon=True).start()

    def _read(self) -> None:
        assert self._process.stdout is not None
        for line in self._process.stdout:
            self.heard.append(json.loads(line))

    def wait(self, event: str, mission: RunningMission) -> None:
        deadline_s = time.monotonic() + WITHIN_S
        while event not in [one["event"] for one in self.heard]:
            assert time.monotonic() < deadline_s, f"never {event}: {self.heard[-5:]}\n{mission.story()}"
            time.sleep(0.05)


def test_a_script_that_was_paused_hears_once_that_its_robot_is_lost_and_moves_nothing(tmp_path: Path) -> None:
    script = tmp_path / "drive.jsonl"
    script.write_text("\n".join(map(json.dumps, LINES)))
    with mission_up() as mission:
        command = [str(BIN / "scout-console"), "attach", "scout3", "--script", str(script), "--mission", mission.name]
        with subprocess.Popen(command, env=mission.environment, stdout=subprocess.PIPE, text=True) as driving:
            try:
                listener = Listener(driving)
                listener.wait("applied", mission)
                driving.send_signal(signal.SIGSTOP)
                time.sleep(PAUSE_S)
                paused_at = len(listener.heard)
                driving.send_signal(signal.SIGCONT)
                listener.wait("suspended", mission)
                listener.wait("resumed", mission)
                granted_at = len(listener.heard)
                time.sleep(2.0)
                driving.send_signal(signal.SIGTERM)
                driving.wait(WITHIN_S)
            finally:
                if driving.poll() is None:
                    driving.kill()
        words = Counter(one["event"] for one in listener.heard[paused_at:granted_at])
        assert words["no_answer"] <= 1, words
        [lost] = [one for one in listener.heard if one["event"] == "suspended"]
        assert (lost["reason"], lost["why"]) == ("lost", "the ARC that held it for this console has ended")
        assert "applied" not in [one["event"] for one in listener.heard[granted_at:]]
