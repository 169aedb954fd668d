"""What the packages use of one system only stands where the page on porting says, and nowhere else."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
import walls
from system_calls import calls_among, system_calls

TOP = Path(__file__).parents[2]
PAGE = (TOP / "docs/reference/porting.md").read_text()
ROW = re.compile(r"^\| \[`(?P<file>[^`]+)`\]\([^)]+\) \| (?P<uses>(?:`[^`]+` ?)+)\|", re.MULTILINE)
LAYER = "backbone/operating_system"


def test_the_page_lists_every_use_and_no_other() -> None:
    packages, _contracts = walls.contracts(TOP)
    files = walls.modules(TOP, packages).values()
    with walls.kept_trees():
        found = {str(file.relative_to(TOP)): calls for file in files if (calls := calls_among(walls.nodes(file)))}
    assert found == {row["file"]: set(re.findall(r"`([^`]+)`", row["uses"])) for row in ROW.finditer(PAGE)}


def test_the_layer_imports_nothing_of_this_project() -> None:
    packages, _contracts = walls.contracts(TOP)
    layer = {name: file for name, file in walls.modules(TOP, packages).items() if LAYER in str(file)}
    assert len(layer) > 3
    assert not [one for one in walls.imports(layer, layer) if one[1].partition(".")[0] in packages]


@pytest.mark.parametrize(
    ("line", "found"),
    [
        ("import fcntl", "fcntl"),
        ("from ctypes import CDLL", "ctypes"),
        ("from os import fork", "os.fork"),
        ("def late():\n    os.kill(1, 9)", "os.kill"),
        ("signal.signal(signal.SIGCHLD, act)", "signal.SIGCHLD"),
        ("socket.socket(socket.AF_UNIX)", "socket.AF_UNIX"),
        ("loop.add_signal_handler(2, end)", "add_signal_handler"),
        ("Path(f'/proc/{pid}/stat')", "/proc"),
    ],
)
def test_a_planted_use_is_found(line: str, found: str) -> None:
    assert system_calls(line) == {found}


def test_a_docstring_may_speak_of_them() -> None:
    assert system_calls('"""/proc is a folder of Linux."""\nimport os\nos.getpid()') == set()
