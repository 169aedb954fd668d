"""The launcher reads its mission file in a child, with the same result as in its own process."""

from __future__ import annotations

import os
import select
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.processes

ENDS_WITHIN_S = 20.0
MISSION = Path(__file__).parents[3] / "mission.xml"
BOTH = """
import sys
from pathlib import Path
from backbone.mission.reading_apart import begin_reading
from backbone.mission.report import MissionInvalid

def outcome(read):
    try:
        return read()
    except MissionInvalid as invalid:
        return invalid.faults

path = Path(sys.argv[1])
apart = outcome(begin_reading(path))
assert "pydantic" not in sys.modules, "this process has read the file itself"
from backbone.mission.reader import read_written_mission
assert apart == outcome(lambda: read_written_mission(path))
print(type(apart[0]).__name__)
"""
CHILD = """
import os, signal, sys, time
from backbone.operating_system.forked_child import ForkedChild

def interrupted(*_):
    raise InterruptedError

print("printed once", end="")
work = {
    "long": lambda: bytes(3_000_000),
    "bug": lambda: 1 / 0,
    "killed": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "interrupted": lambda: time.sleep(60),
}[sys.argv[1]]
child = ForkedChild(work)
if sys.argv[1] == "interrupted":
    signal.signal(signal.SIGALRM, interrupted)
    signal.setitimer(signal.ITIMER_REAL, 0.05)
try:
    answer = child.answer()
except InterruptedError:
    answer = b"!"
print("", None if answer is None else len(answer))
try:
    os.waitpid(-1, 0)
except ChildProcessError:
    print("no child is left")
"""
KILLED = """
import os, signal, sys, time
from pathlib import Path
from backbone.mission import reading_apart

def read_slowly(path):
    print(os.getpid(), flush=True)
    time.sleep(60)

reading_apart._read = read_slowly
reading = reading_apart.begin_reading(Path("mission.xml"))
sys.stdin.read()
os.kill(os.getpid(), signal.SIGKILL)
"""


def printed(program: str, argument: str) -> str:
    command = [sys.executable, "-c", program, argument]
    done = subprocess.run(command, check=False, capture_output=True, text=True, timeout=60)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_a_mission_read_apart_is_the_same() -> None:
    assert printed(BOTH, str(MISSION)) == "MissionDescription\n"


def test_faults_are_the_same_and_so_is_a_missing_file(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.xml"
    wrong.write_text(MISSION.read_text().replace('priority="5"', 'priority="x"').replace("<radio", "<radoi"))
    assert printed(BOTH, str(wrong)) == "Fault\n"
    assert printed(BOTH, str(tmp_path / "missing.xml")) == "Fault\n"


@pytest.mark.parametrize(
    ("work", "answer"), [("long", "3000000"), ("bug", "None"), ("killed", "None"), ("interrupted", "1")]
)
def test_a_child_answers_or_not_and_never_stays(work: str, answer: str) -> None:
    assert printed(CHILD, work) == f"printed once {answer}\nno child is left\n"


def test_the_child_ends_with_a_killed_launcher() -> None:
    command = [sys.executable, "-c", KILLED]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as launcher:
        assert launcher.stdout is not None
        child = os.pidfd_open(int(launcher.stdout.readline()))
        assert launcher.stdin is not None
        launcher.stdin.close()
        has_ended, _, _ = select.select([child], [], [], ENDS_WITHIN_S)
        os.close(child)
    assert has_ended


def test_the_launcher_holds_no_reader_of_mission_files() -> None:
    program = "import sys, backbone.command_line.mission_console; print({'pydantic', 'pyexpat'} & set(sys.modules))"
    assert printed(program, "") == "set()\n"
