"""The mission of the design tutorial is checked and brought up as the tutorial says; hands build it elsewhere."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
from design_tutorial import tutorial_draft
from tutorial_commands import run_all

from backbone.mission.reader import read_mission
from ui_console.design.file import save
from ui_console.design.serving import look_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

ROOT = Path(__file__).parents[3]
TUTORIAL = ROOT / "docs" / "tutorial" / "design-a-mission.md"


@pytest.mark.thorough
def test_what_the_tutorial_builds_is_checked_and_brought_up() -> None:
    """The browser tests do the tutorial's steps and save these bytes."""
    with tempfile.TemporaryDirectory(prefix="scout-design-") as name:
        file = Path(name) / "guard.xml"
        save(tutorial_draft(), file)
        assert read_mission(file).behaviors == read_mission(ROOT / "mission.xml").behaviors
        run_all(TUTORIAL, Path(name))


async def test_classes_are_asked_in_another_process_and_one_that_cannot_be_says_why() -> None:
    watch = "mission_control.behaviors.watch_for_motion:WatchForMotion"
    scout, missing = "resource_pool.rcs.scout:Scout", "no.such.module:Thing"
    found = await look_up([watch, scout, missing])
    told = {one.name: one for one in found[watch].parameters}
    assert told["clean_share"].summary == "number, at least 0.05, at most 1, default 0.75"
    assert told["again_after_s"].doc == "Time after which continuing motion is published again, mission seconds."
    assert not {"path", "arc", "children"} & set(told)
    assert "network_id" in {one.name for one in found[scout].parameters}
    assert "ModuleNotFoundError" in found[missing].failure
