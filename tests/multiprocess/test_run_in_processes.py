"""Modules in processes of their own, without a mission: a script of thirty lines, what falls, and how it ends."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import psutil
import pytest

from mission_control.modules.graph import GraphRefused
from mission_control.modules.run_in_processes import run_in_processes

pytestmark = pytest.mark.processes

TOP = Path(__file__).parents[2]
EXAMPLES = TOP / "docs/examples"
WITHIN_S = 60.0
SCRIPT = """
import os, sys
from pair import Height, Smoothing, Wave
from mission_control.modules.module import Module
from mission_control.modules.run_in_processes import run_in_processes

class Falling(Module):
    class Inputs(Module.Inputs):
        smooth: Height
    class Outputs(Module.Outputs):
        pid: Height
    def update(self, inputs):
        if {falls}:
            os._exit(7)
        return self.Outputs(Height(float(os.getpid())))

pids = []
heard = {{"pid": lambda one: pids.append(one.height_m), "wave": lambda one: print("wave", flush=True)}}
modules = Falling(), Wave(), Smoothing(Smoothing.Parameters(weight=0.5))
told = run_in_processes(*modules, frequency_hz=50, for_s={for_s}, listen=heard)
print(len({{os.getpid(), *pids}}), sorted(told), told["smoothing"]["smoothing_runs"] > 3)
"""


def script(*, falls: bool = False, for_s: str, folder: str = "") -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", SCRIPT.format(falls=falls, for_s=for_s)],
        cwd=TOP,
        env={"PYTHONPATH": str(EXAMPLES), "TMPDIR": folder},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_the_pair_in_two_processes_says_what_it_says_in_one() -> None:
    """Slowly: an input that waits while the next one comes is replaced by it."""
    text = (
        (EXAMPLES / "pair_in_processes.py").read_text().replace("frequency_hz=20, for_s=2", "frequency_hz=2, for_s=1.5")
    )
    done = subprocess.run(
        [sys.executable, "-c", text],
        env={"PYTHONPATH": str(EXAMPLES)},
        capture_output=True,
        text=True,
        check=True,
        cwd=TOP,
    )
    assert done.stdout.splitlines()[:2] == ["Height(height_m=0.25)", "Height(height_m=0.6875)"]
    assert not done.stderr


def test_modules_of_the_script_itself_run_elsewhere_and_its_statistics_come_back() -> None:
    said, complaint = script(for_s="2").communicate(timeout=WITHIN_S)
    assert said.splitlines()[-1:] == ["2 ['falling', 'smoothing', 'wave'] True"], complaint


def test_a_process_that_falls_ends_the_run_with_its_name() -> None:
    with script(falls=True, for_s="60") as running:
        _said, complaint = running.communicate(timeout=WITHIN_S)
    assert running.returncode == 1
    assert "ModuleProcessFell: the process of falling ended" in complaint


@pytest.mark.parametrize(
    ("raised", "begins"),
    [
        ("ValueError", "ValueError: "),
        ("SystemExit", ""),
        ("TimeoutError", "TimeoutError: "),
        ("StopIteration", "RuntimeError: StopIteration: "),
    ],
)
def test_a_listener_that_raises_ends_the_run_as_in_one_process(raised: str, begins: str) -> None:
    text = (EXAMPLES / "pair_in_processes.py").read_text().replace("for_s=2", "for_s=600").replace("print", "fail")
    failing = f"def fail(height):\n    raise {raised}('no such height')\n"
    done = subprocess.run(
        [sys.executable, "-c", failing + text],
        env={"PYTHONPATH": str(EXAMPLES)},
        capture_output=True,
        text=True,
        check=False,
        cwd=TOP,
        timeout=WITHIN_S,
    )
    assert done.returncode == 1
    assert done.stderr.splitlines()[-1].partition(" (")[0] == f"{begins}no such height"


def test_the_processes_end_with_a_script_that_is_killed_and_leave_no_file(tmp_path: Path) -> None:
    with script(for_s="60", folder=str(tmp_path)) as running:
        assert running.stdout is not None
        assert running.stdout.readline() == "wave\n"
        assert list(tmp_path.iterdir())
        children = psutil.Process(running.pid).children(recursive=True)
        assert len(children) == 3
        running.kill()
        _gone, left = psutil.wait_procs(children, timeout=WITHIN_S)
        assert not left
    assert not list(tmp_path.iterdir())


def test_what_cannot_be_connected_starts_no_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(EXAMPLES)
    import pair

    with pytest.raises(GraphRefused, match="smoothing needs wave"):
        run_in_processes(pair.Smoothing())


LARGE = """
from backbone.ranges import Bulk
from backbone.wire import Message
from mission_control.modules.module import Module
from mission_control.modules.run_in_processes import run_in_processes

class Map(Message, frozen=True):
    cells: Bulk

class Length(Message, frozen=True):
    of: int

class Mapper(Module):
    class Outputs(Module.Outputs):
        map: Map
    def update(self, inputs):
        return self.Outputs(Map(memoryview(bytes(20_000_000))))

class Measure(Module):
    class Inputs(Module.Inputs):
        map: Map
    class Outputs(Module.Outputs):
        length: Length
    def update(self, inputs):
        return self.Outputs(Length(len(inputs.map.cells)))

lengths = set()
run_in_processes(Mapper(), Measure(), frequency_hz=2, for_s=3, listen={"length": lambda one: lengths.add(one.of)})
print(lengths)
"""


def test_a_value_that_the_network_would_not_take_reaches_the_next_process_as_in_a_mission() -> None:
    words = [sys.executable, "-c", LARGE]
    done = subprocess.run(words, check=True, capture_output=True, text=True, cwd=TOP, timeout=WITHIN_S)
    assert done.stdout == "{20000000}\n", done.stderr


AGAIN = """
from pair import Smoothing, Wave
from mission_control.modules.run_in_processes import RunsOnce, run_in_processes

run_in_processes(Wave(), Smoothing(), for_s=0.1)
try:
    run_in_processes(Wave(), Smoothing(), for_s=0.1)
except RunsOnce as refused:
    print(refused)
"""


def test_a_second_run_in_one_script_is_refused_at_once() -> None:
    """Zenoh works in no process that is forked after its threads exist; the second run waited for 20 s in vain."""
    words = [sys.executable, "-c", AGAIN]
    environment = {"PYTHONPATH": str(EXAMPLES)}
    done = subprocess.run(words, check=True, env=environment, capture_output=True, text=True, cwd=TOP, timeout=WITHIN_S)
    assert done.stdout.startswith("a script can run modules in processes once (Run each in a script of its own")
