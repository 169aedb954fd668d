"""Cost of a console while the shipped mission runs: ``.venv/bin/python bench/console.py [SECONDS [CONSOLE …]]``.

Starts the mission, then one console after the other in a terminal of 120 × 40. Measures the processor time of each
console, and of the mission's own processes meanwhile. The claim: a monitor takes under 2 % of one core and changes no
grant. The run takes about a minute and a half.
"""

from __future__ import annotations

import fcntl
import json
import os
import pty
import struct
import subprocess
import sys
import termios
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import psutil
from measuring import BIN, MISSION_XML, busy_s, report
from missions import RealMission, mission_up, own_processes

COLUMNS, LINES = 120, 40
SETTLE_S = 6.0  # chosen: imports and the first pictures are over
CONSOLES = {
    "nobody": [],
    "monitor": ["scout-console", "monitor"],
    "monitor_json": ["scout-console", "monitor", "--json"],
    "attach": ["scout-console", "attach", "scout3"],
    "attach_video_only": ["scout-console", "attach", "scout3", "--video-only"],
}


@contextmanager
def in_a_terminal(command: list[str]) -> Iterator[tuple[psutil.Process, list[int]]]:
    """Run the command in a terminal whose output is read and counted."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", LINES, COLUMNS, 0, 0))
    drawn = [0]

    def read() -> None:
        try:
            while chunk := os.read(ours, 65536):
                drawn[0] += len(chunk)
        except OSError:  # the other end is closed
            return

    environment = {**os.environ, "TERM": "xterm-256color"}
    process = subprocess.Popen(
        command, stdin=theirs, stdout=theirs, stderr=theirs, env=environment, start_new_session=True
    )
    os.close(theirs)
    reading = threading.Thread(target=read, daemon=True)
    reading.start()
    try:
        yield psutil.Process(process.pid), drawn
    finally:
        process.terminate()
        process.wait(10)
        os.close(ours)


def turns_of_consoles() -> int:
    """Return the number of consoles' requests in the schedule."""
    done = subprocess.run([str(BIN / "scout-backbone"), "status", "--json"], capture_output=True, check=True)
    status: dict[str, Any] = json.loads(done.stdout)
    return sum(request["owner"].startswith("ui_console/") for request in status["requests"])


def measure(running: RealMission, name: str, command: list[str], lasts_s: float) -> None:
    """Print one JSON line about this console."""
    mission = own_processes(running)
    if not command:
        began_s, mission_s = time.monotonic(), busy_s(mission)
        time.sleep(lasts_s)
        took_s = time.monotonic() - began_s
        report("console", console=name, mission_percent=percent(busy_s(mission) - mission_s, took_s))
        return
    with in_a_terminal([str(BIN / command[0]), *command[1:]]) as (console, drawn):
        time.sleep(SETTLE_S)
        mission = own_processes(running)
        began_s, own_s, mission_s, bytes_before = time.monotonic(), busy_s([console]), busy_s(mission), drawn[0]
        time.sleep(lasts_s)
        took_s = time.monotonic() - began_s
        report(
            "console",
            console=name,
            cpu_percent=percent(busy_s([console]) - own_s, took_s),
            mission_percent=percent(busy_s(mission) - mission_s, took_s),
            requests_of_consoles=turns_of_consoles(),
            drawn_kb_s=round((drawn[0] - bytes_before) / took_s / 1000, 1),
            memory_mb=round(console.memory_info().rss / 1e6, 1),
        )


def percent(busy: float, took_s: float) -> float:
    """Return seconds of processor time as percent of one core."""
    return round(100 * busy / took_s, 2)


if __name__ == "__main__":
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 12.0
    with mission_up(MISSION_XML) as mission_of_consoles:
        for console_name, console_command in CONSOLES.items():
            if len(sys.argv) <= 2 or console_name in sys.argv[2:]:
                measure(mission_of_consoles, console_name, console_command, seconds)
