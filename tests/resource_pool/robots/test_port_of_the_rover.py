"""What another kind of robot costs: the lines of the rover's folder, and not one line anywhere else."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

TOP = Path(__file__).parents[3]
FOLDER = TOP / "resource_pool" / "robots" / "rover"
MISSION = TOP / "docs" / "examples" / "mixed.xml"
WORD = re.compile(r"(?<![a-z])rover|Rover|ROVER")  # not in "controversy"
PRODUCT = ("backbone", "resource_pool", "mission_control", "ui_console", "scout_model", "bench", ".ci")
TEXTS = {".py", ".js", ".ts", ".html", ".css", ".json", ".xsd", ".xml", ".toml", ".svg", ".mjcf", ""}
EXCEPTIONS: dict[str, str] = {}
"""File that may name the rover → why."""
MOST_LINES = {"rc.py": 90, "arcs.py": 35}  # chosen: what is written for RC and ARCs in a morning, with docstrings


def product_files() -> Iterator[Path]:
    """Yield each file of the product that is text, outside of the rover's folder."""
    for folder in PRODUCT:
        for file in (TOP / folder).rglob("*"):
            inside = {"__pycache__", "node_modules"} & set(file.parts)
            if file.is_file() and not inside and file.suffix in TEXTS and FOLDER not in file.parents:
                yield file
    yield TOP / "pyproject.toml"
    yield TOP / "mission.xml"


def lines(file: Path) -> int:
    return len(file.read_text(encoding="utf-8").splitlines())


def test_no_file_but_its_own_names_the_rover() -> None:
    named = {
        str(file.relative_to(TOP)): number
        for file in product_files()
        for number, line in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), start=1)
        if WORD.search(line)
    }
    assert {file: line for file, line in named.items() if file not in EXCEPTIONS} == {}
    assert EXCEPTIONS.keys() <= named.keys(), "an exception that is none any more"


def test_the_search_finds_the_rover_where_it_is() -> None:
    assert all(WORD.search(file.read_text(encoding="utf-8")) for file in (MISSION, *FOLDER.glob("*.py")))
    assert len(list(product_files())) > 400
    assert [bool(WORD.search(text)) for text in ("my_rover", "SimRover", "ROVER1", "controversy")] == [True] * 3 + [
        False
    ]


def test_lines_of_the_port(capsys: pytest.CaptureFixture[str]) -> None:
    port = {file.name: lines(file) for file in sorted(FOLDER.iterdir()) if file.is_file()}
    with capsys.disabled():
        print(f"\nlines of the rover: {', '.join(f'{name} {count}' for name, count in port.items())}")
        print(f"in all {sum(port.values())}; its mission file {lines(MISSION)}; elsewhere {len(EXCEPTIONS)} files")
    assert {name: port[name] for name in MOST_LINES if port[name] > MOST_LINES[name]} == {}
