"""What tests over real processes share."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

Judged = Callable[..., None]
TOLERANCE_S = "0.5"  # a machine that also runs other tests reacts late; order and exclusion are judged all the same
NOT_JUDGED = pytest.StashKey[list[str]]()


def judge_path() -> Path | None:
    """Return where the independent judge of schedule traces lies, if it is on this machine."""
    given = os.environ.get("SCOUT_TRACE_CHECK", "")
    beside = Path(__file__).parents[3] / "shared" / "trace" / "trace_check.py"
    for path in (Path(given) if given else beside, beside):
        if path.is_file():
            return path
    return None


@pytest.fixture
def judged(request: pytest.FixtureRequest) -> Judged:
    """Return a check that the judge finds no violation in a trace, but for the codes allowed.

    Without a judge the check is skipped, and the end of the test report says which traces went unjudged.
    """

    def check(trace: Path, allowed: frozenset[str] = frozenset()) -> None:
        judge = judge_path()
        if judge is None:
            request.config.stash.setdefault(NOT_JUDGED, []).append(request.node.nodeid)
            return
        command = [sys.executable, str(judge), str(trace), "--tol", TOLERANCE_S]
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
        violations = [line for line in done.stdout.splitlines() if line.split(": ", 1)[-1].split(" ")[0] not in allowed]
        assert len(violations) == 1, done.stdout + done.stderr

    return check


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter, config: pytest.Config) -> None:
    """Name the tests whose traces no judge has seen."""
    unjudged = config.stash.get(NOT_JUDGED, [])
    if not unjudged:
        return
    terminalreporter.section("traces not judged: no trace_check.py on this machine (set SCOUT_TRACE_CHECK)")
    for nodeid in unjudged:
        terminalreporter.line(f"NOT JUDGED {nodeid}")
