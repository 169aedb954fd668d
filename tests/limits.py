"""What holds for every test: limits of time, failures printed when they happen, and no process without the marker.

* A test that takes too long fails alone: ``pytest-timeout`` interrupts it. A test that hangs beyond that, in native
  code or because something swallows the interruption, ends its process with the stacks of all threads; ``pytest -n``
  replaces the process and goes on.
* A test on virtual time is limited in virtual time, so that a busy machine fails none: its mission may last
  ``VIRTUAL_LIMIT_S``, or as long as the marker ``virtual_limit(seconds)`` allows.
* A failure is printed when it happens: the names are there also if the run is killed.
* What a test prints or logs need not be UTF-8: its report escapes what would end the process of ``pytest -n``.
* A test that starts processes says so with the marker ``processes``. Beside one with the marker ``alone``, which makes
  the whole machine busy or measures a time on it, no other test with processes runs: with ``pytest -n`` each waits for
  its turn. Such tests come first then, while other workers have tests without processes.
"""

from __future__ import annotations

import contextlib
import faulthandler
import fcntl
import functools
import os
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from multiprocessing.process import BaseProcess
from pathlib import Path
from typing import Any

import pytest

from backbone.bus import clock

VIRTUAL_LIMIT_S = 1_000.0  # chosen: four times the longest mission of a test without the marker
GRACE_S = 60.0  # chosen: a test that was interrupted may stop its mission
LOCKS = (Path(__file__).with_name("conftest.py"), Path(__file__))  # files that are there anyway
TRIALS = ("backbone.mission.class_probe", "scout_model.gl_trial", "def get_version(library_handle)", "fc-list")
"""Parts of commands that look what is there: two of the product, one of glfw, which MuJoCo loads, one of matplotlib."""
STARTS_A_PROCESS = (
    (subprocess.Popen, "__init__"),
    (BaseProcess, "start"),
    *((os, name) for name in ("fork", "forkpty", "posix_spawn", "posix_spawnp", "system")),
)
"""Whatever Python starts for a test goes through one of them. They are wrapped: a hook for audit events would be called
for each of the many events that start nothing."""


class Machine:
    """The machine that the processes of ``pytest -n`` share: many tests use it together, or one alone.

    Who waits to have it alone holds the gate, so that no further test enters.
    """

    def __init__(self, gate: Path, room: Path) -> None:
        self._gate, self._room = gate.open(), room.open()

    @contextlib.contextmanager
    def used(self, alone: bool) -> Iterator[None]:
        """Use it until the end of the block."""
        fcntl.flock(self._gate, fcntl.LOCK_EX)
        fcntl.flock(self._room, fcntl.LOCK_EX if alone else fcntl.LOCK_SH)
        fcntl.flock(self._gate, fcntl.LOCK_UN)
        try:
            yield
        finally:
            fcntl.flock(self._room, fcntl.LOCK_UN)


class Limits:
    """Limits of each test, in the process that runs it."""

    def __init__(self, grace_s: float, machine: Machine) -> None:
        self._grace_s, self._machine = grace_s, machine
        self._started: list[str] = []
        self._stderr = os.dup(sys.__stderr__.fileno()) if sys.__stderr__ is not None else 2
        for owner, name in STARTS_A_PROCESS:
            setattr(owner, name, self._heard(getattr(owner, name)))

    def _heard(self, start: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(start)
        def start_and_hear(*arguments: Any, **named: Any) -> Any:
            command = str(named.get("args", arguments[1:2]))
            if not any(trial in command for trial in TRIALS):
                self._started.append(f"{start.__qualname__} {command}")
            return start(*arguments, **named)

        return start_and_hear

    @pytest.hookimpl(wrapper=True, tryfirst=True)
    def pytest_runtest_protocol(self, item: pytest.Item) -> Generator[None, object, object]:
        """Wait for the machine, then end this process if the test hangs beyond its limit."""
        self._started.clear()
        alone, processes = (item.get_closest_marker(name) is not None for name in ("alone", "processes"))
        with self._machine.used(alone) if processes else contextlib.nullcontext():
            faulthandler.dump_traceback_later(limit_s(item) + self._grace_s, exit=True, file=self._stderr)
            try:
                return (yield)
            finally:
                faulthandler.cancel_dump_traceback_later()

    @pytest.hookimpl(wrapper=True)
    def pytest_runtest_call(self, item: pytest.Item) -> Generator[None, None, None]:
        """Limit virtual time, and fail a test that starts a process without saying so."""
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(clock, "LAST_VIRTUAL_S", virtual_limit_s(item))
            yield
        if self._started and item.get_closest_marker("processes") is None:
            pytest.fail(f"starts a process without the marker 'processes': {self._started[0]}")


class EncodableReports:
    """Reports that a process of ``pytest -n`` can send."""

    @pytest.hookimpl(wrapper=True)
    def pytest_report_to_serializable(self) -> Generator[None, object, object]:
        """Escape what is not UTF-8."""
        return encodable((yield))


class AloneFirst:
    """The order of tests for workers: those that run alone, those with processes, the others."""

    @pytest.hookimpl(trylast=True)
    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Sort the tests; within a file they keep their order."""
        items.sort(key=_turn)


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


def encodable(value: object) -> object:
    """Return the value with each text made encodable.

    Example:
        >>> encodable({"sections": [("log", chr(0xDC80))]})
        {'sections': [('log', '\\\\udc80')]}
    """
    match value:
        case str():
            return value.encode(errors="backslashreplace").decode()
        case dict():
            return {encodable(key): encodable(inner) for key, inner in value.items()}
        case list() | tuple():
            return type(value)(map(encodable, value))
    return value


def _turn(item: pytest.Item) -> int:
    turns = ("alone", "processes")
    return next((turn for turn, name in enumerate(turns) if item.get_closest_marker(name) is not None), len(turns))


def limit_s(item: pytest.Item) -> float:
    """Return after how many seconds the test is interrupted."""
    marker = item.get_closest_marker("timeout")
    return float(marker.args[0] if marker is not None else item.config.getini("timeout"))


def virtual_limit_s(item: pytest.Item) -> float:
    """Return how long virtual time may go on; a long experiment is not limited."""
    if (marker := item.get_closest_marker("virtual_limit")) is not None:
        return float(marker.args[0])
    return clock.LAST_VIRTUAL_S if item.get_closest_marker("slow") is not None else VIRTUAL_LIMIT_S


def watch(config: pytest.Config, grace_s: float = GRACE_S, locks: tuple[Path, Path] = LOCKS) -> None:
    """Apply all limits to this run."""
    config.pluginmanager.register(Limits(grace_s, Machine(*locks)), "limits")
    if hasattr(config, "workerinput"):
        config.pluginmanager.register(AloneFirst(), "alone-first")
        config.pluginmanager.register(EncodableReports(), "encodable-reports")
    else:
        config.pluginmanager.register(FailuresAtOnce(config), "failures-at-once")
