"""A few cells of the table of stops, of each kind of console, as its program tries them on a real mission."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
import web_browser

pytestmark = [pytest.mark.processes, pytest.mark.alone, pytest.mark.timeout(300)]  # measures times

PROGRAM = Path(__file__).parents[2] / "bench" / "stops.py"
WITHIN_S = "3"  # of which 0.5 s are the rule; the rest is a machine that also runs tests without processes
IN_A_TERMINAL = ("terminal 80x24", "pendant", "monitor", "gamepad")


def consoles() -> list[str]:
    """Return those that this machine can try."""
    found = ["script"]
    if shutil.which("tmux") is not None:
        found += IN_A_TERMINAL
    if web_browser.CHROMIUM:
        found.append("page phone")
    return found


@pytest.mark.thorough
def test_every_kind_of_console_stops_robots_or_says_that_it_cannot() -> None:
    words = ["--console", *consoles(), "--link", "up", "other holds", "cut", "--first", "1", "--within", WITHIN_S]
    done = subprocess.run(
        [sys.executable, str(PROGRAM), *words], capture_output=True, text=True, timeout=280, check=False
    )
    rows = [json.loads(line) for line in done.stdout.splitlines()]
    assert [row for row in rows if "fault" in row] == [], done.stderr
    assert done.returncode == 0, done.stderr
    assert {row["console"] for row in rows} == set(consoles())
    assert all("stands_s" in row or row["says"] for row in rows)
