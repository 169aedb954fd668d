"""A component that hung is reported with the line at which it stood."""

from __future__ import annotations

import signal
import sysconfig
from pathlib import Path

import pytest

from backbone.component.launch import Launch
from backbone.creator.failed_starts import cause_of_end
from backbone.naming import Subsystem

STACKS = """\
12:00 INFO pan: ready
Thread 0x00007f01 (most recent call first):
  File "/lib/threading.py", line 320 in wait

Current thread 0x00007f02 (most recent call first):
  File "/home/anna/pan.py", line 12 in update
  File "/lib/asyncio/runners.py", line 118 in run
"""


def place_in(directory: Path, log: str, returncode: int = -signal.SIGKILL) -> str:
    at, run_directory = ("host", "endpoint", 0.0, 1.0), str(directory)
    launch = Launch("m", Subsystem.RESOURCE_POOL, "pan", "pan", "pan:Pan", *at, run_directory=run_directory)
    (directory / "log").mkdir(exist_ok=True)
    (directory / "log" / "pan.log").write_text(log)
    return cause_of_end(launch, 7, returncode)


def test_the_place_is_that_of_the_main_thread_s_innermost_call(tmp_path: Path) -> None:
    assert place_in(tmp_path, STACKS) == "/home/anna/pan.py, line 12, in update"


def test_a_file_with_letters_beyond_ascii_is_named_as_it_is(tmp_path: Path) -> None:
    """The interpreter escapes them in its stacks."""
    stacks = STACKS.replace("/home/anna", r"/home/J\xf6rg/\u0141\U0001f916\udcff")
    assert place_in(tmp_path, stacks) == r"/home/Jörg/Ł🤖\udcff/pan.py, line 12, in update"


def test_a_stack_that_the_interpreter_cuts_has_its_place_too(tmp_path: Path) -> None:
    assert place_in(tmp_path, f"{STACKS}  ...\n") == "/home/anna/pan.py, line 12, in update"


def test_stacks_that_are_followed_by_lines_are_of_an_earlier_hang(tmp_path: Path) -> None:
    assert place_in(tmp_path, f"{STACKS}12:01 INFO pan: ready\n") == ""


def test_only_a_killed_process_hung(tmp_path: Path) -> None:
    assert "pan.py" not in place_in(tmp_path, STACKS, 0)


CRASHED = """\
Fatal Python error: Segmentation fault

Thread 0x00007f01 (most recent call first):
  File "/lib/threading.py", line 320 in wait

Current thread 0x00007f02 (most recent call first):
  File "%sctypes/__init__.py", line 519 in string_at
  File "/home/anna/pan.py", line 12 in update
  File "/lib/asyncio/runners.py", line 118 in run

Extension modules: numpy.core (total: 1)
"""


def test_a_process_that_crashed_has_the_developers_place(tmp_path: Path) -> None:
    log = CRASHED % f"{sysconfig.get_path('stdlib')}/"
    assert place_in(tmp_path, log, -signal.SIGSEGV) == "/home/anna/pan.py, line 12, in update"


def test_an_earlier_crash_and_a_kill_from_outside_have_no_place(tmp_path: Path) -> None:
    assert place_in(tmp_path, CRASHED, -signal.SIGKILL) == ""
    assert place_in(tmp_path, "12:00 INFO pan: ready\n", -signal.SIGSEGV) == ""


@pytest.mark.parametrize("returncode", [0, 1, 3])
def test_an_end_without_a_reason_is_named_as_such(tmp_path: Path, returncode: int) -> None:
    """``os._exit`` in a module: the story said only "exit code 0"."""
    assert "os._exit" in place_in(tmp_path, "12:00 INFO pan: ready\n", returncode)
    assert "os._exit" in place_in(tmp_path, "", returncode)
