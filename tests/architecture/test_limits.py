"""The limits of tests hold: tried on suites of tests that break them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.processes

CONFTEST = """
import sys
from pathlib import Path
sys.path[:0] = [{tests!r}, {project!r}]
import limits

def pytest_configure(config):
    for marker in ("processes", "alone", "virtual_limit(seconds)"):
        config.addinivalue_line("markers", marker)
    here = Path(__file__)
    limits.watch(config, grace_s=2.0, locks=(here, here.with_name("test_suite.py")))
"""
SUITE = """
import asyncio, signal, subprocess, sys, time
import pytest
from backbone.bus.clock import VirtualClock, run_virtual

@pytest.mark.timeout(1)
def test_sleeps():
    time.sleep(600.0)

def test_starts():
    subprocess.run([sys.executable, "-c", "pass"])

def test_plays_for_long():
    run_virtual(VirtualClock().sleep_s(1001.0))

@pytest.mark.virtual_limit(2000.0)
def test_may_play_for_long():
    run_virtual(VirtualClock().sleep_s(1001.0))

@pytest.mark.timeout(1)
def test_hangs():
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
    time.sleep(600.0)

def test_comes_after_one_that_hangs():
    pass
"""
SAYS_ANYTHING = """
def test_logs():
    import logging
    logging.error("a file called caf" + chr(0xDCE9))

def test_fails():
    raise ValueError("caf" + chr(0xDCE9))
"""
ALONE = ("test_sleeps", "test_starts", "test_plays_for_long")


STARTS = """
import asyncio, multiprocessing, os, subprocess, sys
import pytest

PASS = (sys.executable, "-c", "pass")

def fork():
    if (child := os.fork()) == 0:
        os._exit(0)
    os.waitpid(child, 0)

async def start():
    await (await asyncio.create_subprocess_exec(*PASS)).wait()

def multiply(method):
    process = multiprocessing.get_context(method).Process(target=print)
    process.start()
    process.join()

WAYS = {
    "subprocess": lambda: subprocess.run(args=PASS),
    "asyncio": lambda: asyncio.run(start()),
    "fork": fork,
    "posix_spawn": lambda: os.waitpid(os.posix_spawn(sys.executable, PASS, {}), 0),
    "multiprocessing-fork": lambda: multiply("fork"),
    "multiprocessing-spawn": lambda: multiply("spawn"),
    "popen": lambda: os.popen("true").close(),
    "system": lambda: os.system("true"),
}

@pytest.mark.parametrize("way", WAYS.values(), ids=WAYS)
def test_starts(way):
    way()

def test_looks_what_is_there():
    with pytest.raises(FileNotFoundError):
        subprocess.run(["no-such-folder/fc-list"])
"""


def run(folder: Path, *options: str, suite: str = SUITE) -> str:
    """Return what pytest prints of the suite."""
    top = Path(__file__).parents[2]
    (folder / "conftest.py").write_text(CONFTEST.format(tests=str(top / "tests"), project=str(top)))
    (folder / "test_suite.py").write_text(suite)
    (folder / "pytest.ini").write_text("[pytest]\ntimeout_method = signal\ntimeout = 60\n")
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", *options, str(folder)]
    done = subprocess.run(command, check=False, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder)
    return done.stdout


@pytest.mark.thorough
def test_a_run_that_is_ended_has_named_each_failure_before(tmp_path: Path) -> None:
    printed = run(tmp_path)
    for name in ALONE:
        assert f"FAILED test_suite.py::{name} (call)" in printed
    assert "test_may_play" not in printed
    assert "in test_hangs" in printed, "the stack of the test that hangs"
    assert "short test summary" not in printed


@pytest.mark.thorough
def test_with_workers_a_test_that_hangs_fails_alone(tmp_path: Path) -> None:
    printed = run(tmp_path, "-n", "1")
    for name in (*ALONE, "test_hangs"):
        assert f"FAILED test_suite.py::{name}" in printed
    assert "4 failed, 2 passed" in printed


def test_no_way_to_start_a_process_is_missed(tmp_path: Path) -> None:
    printed = run(tmp_path, suite=STARTS)
    assert printed.count("starts a process without the marker 'processes'") >= 8
    assert "8 failed, 1 passed" in printed


TOGETHER = """
import os, time
from pathlib import Path
import pytest

def note(name, what, s=0.3):
    with Path("log").open("a") as log:
        log.write(f"{name} {what}\\n")
    if what == "begins":
        time.sleep(s)

@pytest.mark.processes
@pytest.mark.alone
@pytest.mark.parametrize("number", range(2))
def test_alone(number):
    note(f"alone{number}", "begins")
    note(f"alone{number}", "ends")

@pytest.mark.processes
@pytest.mark.parametrize("number", range(12))
def test_together(number):
    note(f"together{number}", "begins")
    note(f"together{number}", "ends")
"""


IN_TURN = """
from pathlib import Path
import pytest

def note(name):
    with Path("log").open("a") as log:
        log.write(f"{name} ")

def test_without_processes():
    note("without")

@pytest.mark.processes
def test_with_processes():
    note("with")

@pytest.mark.processes
@pytest.mark.alone
def test_alone():
    note("alone")
"""


@pytest.mark.parametrize(("options", "order"), [(("-n", "1"), "alone with without"), ((), "without with alone")])
def test_with_workers_tests_that_are_alone_come_first(tmp_path: Path, options: tuple[str, ...], order: str) -> None:
    assert "3 passed" in run(tmp_path, *options, suite=IN_TURN)
    assert (tmp_path / "log").read_text().strip() == order


@pytest.mark.thorough
def test_no_test_with_processes_runs_beside_one_that_is_alone(tmp_path: Path) -> None:
    assert "14 passed" in run(tmp_path, "-n", "3", suite=TOGETHER)
    busy: list[str] = []
    most = 0
    for line in (tmp_path / "log").read_text().splitlines():
        name, what = line.split()
        busy = [*busy, name] if what == "begins" else [each for each in busy if each != name]
        assert len(busy) < 2 or not any(each.startswith("alone") for each in busy), busy
        most = max(most, len(busy))
    assert most > 1, "nothing ran together"


def test_what_is_not_utf_8_in_a_report_ends_no_process(tmp_path: Path) -> None:
    said = run(tmp_path, "-n", "1", suite=SAYS_ANYTHING)
    assert "1 failed, 1 passed" in said, said
