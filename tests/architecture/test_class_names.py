"""Each class of the product has a name of its own, so that a name leads to one class.

Two message classes of one name would also share a schema in recordings. A module's nested ``Parameters``, ``Inputs``
and ``Outputs`` are named by the module.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from pathlib import Path

TOP = Path(__file__).parents[2]
ROOMS = ("backbone", "mission_control", "resource_pool", "scout_model", "ui_console")
PAIRS = {"Scout"}  # the robot's own firmware, and the RC that talks to it


def test_no_two_files_have_a_class_of_the_same_name() -> None:
    found: dict[str, list[str]] = defaultdict(list)
    for path in sorted(file for room in ROOMS for file in (TOP / room).rglob("*.py")):
        for node in ast.parse(path.read_text()).body:
            if isinstance(node, ast.ClassDef):
                found[node.name].append(str(path.relative_to(TOP)))
    assert len(found) > 1000
    assert {name: files for name, files in found.items() if len(files) > 1 and name not in PAIRS} == {}
