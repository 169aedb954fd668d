"""What a walking robot costs: the lines of the walker's folder, and not one line in the code anywhere else."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

TOP = Path(__file__).parents[3]
FOLDER = TOP / "resource_pool" / "robots" / "walker"
MISSION = TOP / "docs" / "examples" / "walker.xml"
WORD = re.compile(r"(?<![a-z])walker|Walker|WALKER")  # not in "dogwalker"
PRODUCT = ("backbone", "resource_pool", "mission_control", "ui_console", "scout_model", "bench", ".ci")
TEXTS = {".py", ".js", ".ts", ".html", ".css", ".json", ".xsd", ".xml", ".toml", ".svg", ".mjcf", ""}
EXCEPTIONS = {"pyproject.toml": "the extra that installs mink, and the contract that only its kinematics know mink"}
"""File that may name the walker → why."""
MOST_LINES = {"rc.py": 190, "arcs.py": 35, "pace.py": 60}  # chosen: an RC with a loop of its own, in two mornings


def product_files() -> Iterator[Path]:
    """Yield each file of the product that is text, outside of the walker's folder."""
    for folder in PRODUCT:
        for file in (TOP / folder).rglob("*"):
            inside = {"__pycache__", "node_modules"} & set(file.parts)
            if file.is_file() and not inside and file.suffix in TEXTS and FOLDER not in file.parents:
                yield file
    yield TOP / "pyproject.toml"
    yield TOP / "mission.xml"


def lines(file: Path) -> int:
    return len(file.read_text(encoding="utf-8").splitlines())


def test_no_file_but_its_own_names_the_walker() -> None:
    named = {
        str(file.relative_to(TOP)): number
        for file in product_files()
        for number, line in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), start=1)
        if WORD.search(line)
    }
    assert {file: line for file, line in named.items() if file not in EXCEPTIONS} == {}
    assert EXCEPTIONS.keys() <= named.keys(), "an exception that is none any more"


def test_the_search_finds_the_walker_where_it_is() -> None:
    named = [file.name for file in (MISSION, *FOLDER.glob("*.py")) if WORD.search(file.read_text(encoding="utf-8"))]
    assert {"walker.xml", "rc.py", "arcs.py", "body.py", "gait.py", "link.py", "motion.py"} <= {*named}
    assert len(list(product_files())) > 400
    words = ("my_walker", "SimWalker", "WALKER1", "walkers", "dogwalker")
    assert [bool(WORD.search(word)) for word in words] == [True] * 4 + [False]


def test_lines_of_the_port(capsys: pytest.CaptureFixture[str]) -> None:
    port = {file.name: lines(file) for file in sorted(FOLDER.iterdir()) if file.is_file()}
    with capsys.disabled():
        print(f"\nlines of the walker: {', '.join(f'{name} {count}' for name, count in port.items())}")
        print(f"in all {sum(port.values())}; its mission file {lines(MISSION)}; elsewhere {len(EXCEPTIONS)} files")
    assert {name: port[name] for name in MOST_LINES if port[name] > MOST_LINES[name]} == {}
