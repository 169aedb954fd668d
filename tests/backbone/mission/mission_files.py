"""Mission files of the tests, and the faults that the reader finds in them."""

import re
from functools import cache
from pathlib import Path

import pytest

from backbone.mission.model import MissionDescription
from backbone.mission.reader import Fault, MissionInvalid, read_mission

HERE = Path(__file__).parent
SMALL = HERE / "small.xml"
BROKEN = sorted((HERE / "broken").glob("*.xml"))
MISSION_XML = HERE.parents[2] / "mission.xml"
SMALLEST = HERE.parents[2] / "docs" / "examples" / "smallest.xml"


def faults_of(path: Path | str) -> list[Fault]:
    with pytest.raises(MissionInvalid) as caught:
        read_mission(path)
    return list(caught.value.faults)


@cache
def faults_of_broken(path: Path) -> list[Fault]:
    """Return the faults of a file that all tests only look at."""
    return faults_of(path)


def faults_in(tmp_path: Path, content: str | bytes) -> list[Fault]:
    file = tmp_path / "m.xml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return faults_of(file)


def read_text(tmp_path: Path, content: str | bytes) -> MissionDescription:
    file = tmp_path / "m.xml"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    return read_mission(file)


def changed(*changes: tuple[str, str]) -> str:
    text = SMALL.read_text()
    for before, after in changes:
        assert before in text, before
        text = text.replace(before, after, 1)
    return text


def announced(path: Path) -> list[str]:
    """Return the faults that the file's first comment announces, as ``line:column: message``."""
    comment = path.read_text().partition("-->")[0]
    return re.findall(r"^    (\d+:\d+: .*)$", comment, re.MULTILINE)
