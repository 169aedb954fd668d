"""The port of one robot: its folder, its mission file, and the files elsewhere that name it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

TOP = Path(__file__).parents[3]
PRODUCT = ("backbone", "resource_pool", "mission_control", "ui_console", "scout_model", "bench", ".ci")
TEXTS = {".py", ".js", ".ts", ".html", ".css", ".json", ".xsd", ".xml", ".toml", ".svg", ".mjcf", ""}


@dataclass
class Port:
    """What one kind of robot added.

    Args:
        robot: Its name, which is its folder's too.
        mission: Path of its mission file below docs/examples.
        exceptions: File elsewhere that may name the robot → why.
        most_lines: File of the folder → lines that it may have.
    """

    robot: str
    mission: str
    exceptions: dict[str, str] = field(default_factory=dict)
    most_lines: dict[str, int] = field(default_factory=dict)

    def __post_init__(self) -> None:
        self.folder = TOP / "resource_pool" / "robots" / self.robot
        self.mission_file = TOP / "docs" / "examples" / self.mission
        self.word = re.compile(rf"(?<![a-z]){self.robot}|{self.robot.capitalize()}|{self.robot.upper()}")

    @cached_property
    def elsewhere(self) -> list[Path]:
        """Each file of the product that is text, outside of the robot's folder."""
        return list(self._product_files())

    def names_elsewhere(self) -> dict[str, int]:
        """Return each file elsewhere that names the robot, with the last line that does."""
        return {
            str(file.relative_to(TOP)): number
            for file in self.elsewhere
            for number, line in enumerate(file.read_text(encoding="utf-8", errors="replace").splitlines(), start=1)
            if self.word.search(line)
        }

    def assert_named_nowhere_else(self) -> None:
        named = self.names_elsewhere()
        assert {file: line for file, line in named.items() if file not in self.exceptions} == {}
        assert self.exceptions.keys() <= named.keys(), "an exception that is none any more"

    def assert_search_finds(self, words: tuple[str, ...], others: tuple[str, ...]) -> None:
        """The search that finds nothing elsewhere finds the robot in its mission file, its RC and its ARCs."""
        own = (self.mission_file, self.folder / "rc.py", self.folder / "arcs.py")
        assert [file.name for file in own if not self.word.search(file.read_text(encoding="utf-8"))] == []
        assert len(self.elsewhere) > 400
        assert [word for word in words if not self.word.search(word)] == []
        assert [word for word in others if self.word.search(word)] == []

    def assert_few_lines(self) -> str:
        """Return the lines of the port in words."""
        port = {file.name: lines(file) for file in sorted(self.folder.iterdir()) if file.is_file()}
        assert {name: port[name] for name, most in self.most_lines.items() if port[name] > most} == {}
        each = ", ".join(f"{name} {count}" for name, count in port.items())
        return (
            f"lines of the {self.robot}: {each}\nin all {sum(port.values())}; "
            f"its mission file {lines(self.mission_file)}; elsewhere {len(self.exceptions)} files"
        )

    def _product_files(self) -> Iterator[Path]:
        for folder in PRODUCT:
            for file in (TOP / folder).rglob("*"):
                inside = {"__pycache__", "node_modules"} & set(file.parts)
                if file.is_file() and not inside and file.suffix in TEXTS and self.folder not in file.parents:
                    yield file
        yield TOP / "pyproject.toml"
        yield TOP / "mission.xml"


def lines(file: Path) -> int:
    return len(file.read_text(encoding="utf-8").splitlines())
