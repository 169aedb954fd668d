"""The tutorial's commands print what the tutorial says."""

from __future__ import annotations

import re
import shutil
import tempfile
from pathlib import Path

import pytest
from running_mission import MISSION_XML
from tutorial_commands import run_all

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

TUTORIAL = MISSION_XML.parent / "docs" / "tutorial" / "first-mission.md"


def test_every_command_prints_what_the_tutorial_says() -> None:
    with tempfile.TemporaryDirectory(prefix="scout-tutorial-") as name:
        shutil.copy(MISSION_XML, Path(name) / "mission.xml")
        run_all(TUTORIAL, Path(name))


def test_the_pictures_it_shows_are_there() -> None:
    for picture in re.findall(r"!\[[^]]*\]\(([^)]*)\)", TUTORIAL.read_text()):
        assert (TUTORIAL.parent / picture).is_file(), picture
