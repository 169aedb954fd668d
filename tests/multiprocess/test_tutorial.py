"""The commands of the tutorials print what the tutorials say."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

import pytest
from running_mission import MISSION_XML
from tutorial_commands import run_all

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

DOCS = MISSION_XML.parent / "docs"
TUTORIAL = DOCS / "tutorial" / "first-mission.md"
INTRUDER = DOCS / "tutorial" / "the-intruder-nobody-saw.md"


@pytest.mark.thorough
def test_every_command_prints_what_the_tutorial_says() -> None:
    with tempfile.TemporaryDirectory(prefix="scout-tutorial-") as name:
        shutil.copy(MISSION_XML, Path(name) / "mission.xml")
        run_all(TUTORIAL, Path(name))


@pytest.mark.thorough
@pytest.mark.timeout(360)
def test_the_intruder_is_missed_and_then_seen_as_the_tutorial_says() -> None:
    with tempfile.TemporaryDirectory(prefix="scout-intruder-") as name:
        shutil.copytree(DOCS / "examples", Path(name) / "docs" / "examples")
        run_all(INTRUDER, Path(name))


def test_the_pictures_it_shows_are_there() -> None:
    for picture in re.findall(r"!\[[^]]*\]\(([^)]*)\)", TUTORIAL.read_text()):
        assert (TUTORIAL.parent / picture).is_file(), picture
