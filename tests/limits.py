"""What holds for every test: limits of time, failures printed when they happen, and no process without the marker.

* A test that takes too long fails alone: ``pytest-timeout`` interrupts it. A test that hangs beyond that, in native
  code or because something swallows the interruption, ends its process with the stacks of all threads; ``pytest -n``
  replaces the process and goes on.
* A test on virtual time is limited in virtual time, so that a busy machine fails none: its mission may last
  ``VIRTUAL_LIMIT_S``, or what the marker ``virtual_limit(seconds)`` allows.
* A failure is printed when it happens: the names are there also if the run is killed.
* A test that starts processes says so with the marker ``processes``.
"""

from __future__ import annotations

import faulthandler
import os
import sys
from collections.abc import Generator
from typing import Any

import pytest

from backbone.bus import clock

VIRTUAL_LIMIT_S = 3_600.0  # chosen: the longest mission of a test without the marker lasts 1 200 s
GRACE_S = 60.0  # chosen: a test that was interrupted may stop its mission
STARTS_A_PROCESS = frozenset({"subprocess.Popen", "os.fork", "os.forkpty", "os.posix_spawn"})


class Limits:
    """Limits of each test, in the process that runs it."""

    def __init__(self, grace_s: float) -> None:
        self._grace_s = grace_s
        self._started: list[str] = []
        self._stderr = os.dup(sys.__stderr__.fileno()) if sys.__stderr__ is not None else 2
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event in STARTS_A_PROCESS:
            self._started.append(f"{event} {arguments[:2]}")

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """End this process if the test hangs beyond its limit."""
        self._started.clear()
        faulthandler.dump_traceback_later(limit_s(item) + self._grace_s, exit=True, file=self._stderr)
        try:
            return (yield)
        finally:
            faulthandler.cancel_dump_traceback_later()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, None, None]:
        """Limit virtual time, and fail a test that starts a process without saying so."""
        marker = item.get_closest_marker("virtual_limit")
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(clock, "LAST_VIRTUAL_S", marker.args[0] if marker is not None else VIRTUAL_LIMIT_S)
            yield
        if self._started and item.get_closest_marker("processes") is None:
            pytest.fail(f"starts a process without the marker 'processes': {self._started[0]}")


class FailuresAtOnce:
    """Prints each failure when it happens, in the process that a person looks at."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Print a line for a failure."""
        reporter = self._config.pluginmanager.get_plugin("terminalreporter")
        if report.failed and reporter is not None:
            crash = getattr(report.longrepr, "reprcrash", None)
            reason = (crash.message if crash is not None else str(report.longrepr)).partition("\n")[0]
            reporter.write(f"\nFAILED {report.nodeid} ({report.when}): {reason}\n", red=True)
            reporter.flush()


def limit_s(item: pytest.Item) -> float:
    """Return after how many seconds the test is interrupted."""
    marker = item.get_closest_marker("timeout")
    return float(marker.args[0] if marker is not None else item.config.getini("timeout"))


def watch(config: pytest.Config, grace_s: float = GRACE_S) -> None:
    """Have all of it for this run."""
    config.pluginmanager.register(Limits(grace_s), "limits")
    if not hasattr(config, "workerinput"):
        config.pluginmanager.register(FailuresAtOnce(config), "failures-at-once")
