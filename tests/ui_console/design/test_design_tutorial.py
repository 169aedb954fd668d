"""The design tutorial, typed and run as it stands: two watchers from nothing."""

from __future__ import annotations

import re
import tempfile
from pathlib import Path

import pytest
from design_keys import known, press, settle, tutorial_draft
from screen_text import screen_text
from tutorial_commands import run_all

from backbone.mission.reader import read_mission
from ui_console.design.draft import Draft
from ui_console.design.look_up import look_up
from ui_console.design.screen import DesignApp

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

ROOT = Path(__file__).parents[3]
TUTORIAL = ROOT / "docs" / "tutorial" / "design-a-mission.md"
SIZE = (110, 46)


async def test_two_watchers_are_built_from_nothing_checked_and_brought_up(monkeypatch: pytest.MonkeyPatch) -> None:
    with tempfile.TemporaryDirectory(prefix="scout-design-") as name:
        monkeypatch.chdir(name)
        app = DesignApp(Draft.new("guard.xml"), known)
        async with app.run_test(size=SIZE, notifications=True) as pilot:
            await settle(pilot)
            for kind, block in re.findall(r"```(keys|screen)\n(.*?)```", TUTORIAL.read_text(), re.DOTALL):
                for line in block.splitlines():
                    if kind == "keys":
                        await press(pilot, line)
                    else:
                        assert is_shown(line, screen_text(app)), f"{line}\n{screen_text(app)}"
        built, example = read_mission("guard.xml"), read_mission(ROOT / "mission.xml")
        assert built.behaviors == example.behaviors
        assert app.draft.saved == tutorial_draft().text
        run_all(TUTORIAL, Path(name))


def is_shown(line: str, shown: str) -> bool:
    """Say whether the line is on the screen; an ellipsis is itself or anything."""
    line, shown = " ".join(line.split()), " ".join(shown.split())
    wanted = ".*".join(re.escape(part.strip()) for part in line.split("…"))
    return line in shown or re.search(wanted, shown) is not None


async def test_classes_are_asked_in_another_process_and_one_that_cannot_be_says_why() -> None:
    watch = "mission_control.behaviors.watch_for_motion:WatchForMotion"
    scout, missing = "resource_pool.rcs.scout:Scout", "no.such.module:Thing"
    found = await look_up([watch, scout, missing])
    told = {one.name: one for one in found[watch].parameters}
    assert told["clean_share"].told == "number, above 0, at most 1, default 0.75"
    assert told["again_after_s"].doc == "Motion that goes on is told again after this long, mission seconds."
    assert not {"path", "arc", "children"} & set(told)
    assert "network_id" in {one.name for one in found[scout].parameters}
    assert "ModuleNotFoundError" in found[missing].failure
