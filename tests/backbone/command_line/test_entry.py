"""A Ctrl-C ends the program, also while Python imports a module or runs a callback."""

from __future__ import annotations

import signal
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.processes

DROPPED = """
import signal, sys, time, weakref
from backbone.command_line import entry

class Referred: pass

def main():
    here = Referred()
    watch = weakref.ref(here, lambda _: signal.raise_signal(signal.SIGINT))
    del here
    time.sleep(20)
    print("goes on")

sys.modules["ui_console.cli"] = sys.modules["__main__"]
entry.scout_console()
"""
OTHER = """
import sys
from backbone.command_line import entry

class Faulty:
    def __del__(self): raise OSError("of a destructor")

def main(): Faulty()

sys.modules["ui_console.cli"] = sys.modules["__main__"]
entry.scout_console()
"""
WRAPPED = """
import signal, sys
from backbone.command_line import entry

def main():
    try:
        if "--interrupted" in sys.argv:
            signal.raise_signal(signal.SIGINT)
    except KeyboardInterrupt:
        pass
    raise ValueError("of a library")

sys.modules["ui_console.cli"] = sys.modules["__main__"]
entry.scout_console()
"""
ENDING = """
import atexit, signal, sys
from backbone.command_line import entry

def main(): atexit.register(signal.raise_signal, signal.SIGINT)

sys.modules["ui_console.cli"] = sys.modules["__main__"]
entry.scout_console()
"""
LOOP = """
import asyncio, signal, sys
from backbone.command_line import entry
from backbone.command_line.event_loop import exit_code_of

async def work():
    try:
        signal.raise_signal(signal.SIGINT)
        await asyncio.sleep(20)
    except asyncio.CancelledError:
        print("tidied up")
        raise

def main():
    try:
        exit_code_of(work)
    except KeyboardInterrupt:
        sys.exit(130)

sys.modules["ui_console.cli"] = sys.modules["__main__"]
entry.scout_console()
"""


def ended(code: str, where: Path, *words: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-c", code, *words]
    return subprocess.run(command, cwd=where, capture_output=True, text=True, timeout=60, check=False)


def test_an_interrupt_that_python_drops_in_a_callback_ends_the_program(tmp_path: Path) -> None:
    done = ended(DROPPED, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")


def test_another_exception_that_python_drops_is_printed(tmp_path: Path) -> None:
    done = ended(OTHER, tmp_path)
    assert (done.returncode, done.stdout) == (0, "")
    assert "OSError: of a destructor" in done.stderr


def test_an_interrupt_of_which_a_library_makes_another_exception_ends_the_program(tmp_path: Path) -> None:
    done = ended(WRAPPED, tmp_path, "--interrupted")
    assert (done.returncode, done.stdout, done.stderr) == (-signal.SIGINT, "", "")
    assert "ValueError: of a library" in ended(WRAPPED, tmp_path).stderr


def test_an_interrupt_while_the_program_ends_prints_nothing(tmp_path: Path) -> None:
    done = ended(ENDING, tmp_path)
    assert (done.stdout, done.stderr) == ("", "")


def test_an_interrupt_ends_an_event_loop_in_good_order(tmp_path: Path) -> None:
    done = ended(LOOP, tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (130, "tidied up\n", "")
