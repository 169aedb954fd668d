"""The mission of the tutorial on trees: built by mouse in a real browser, and brought up as the tutorial says."""

from __future__ import annotations

import tempfile
from pathlib import Path

import pytest
import web_browser
from design_hands import ROOT, Mouse, build_by_tutorial, served
from tutorial_commands import run_all

pytestmark = [pytest.mark.processes, pytest.mark.timeout(240)]

TUTORIAL = ROOT / "docs" / "tutorial" / "compose-a-tree.md"
EXAMPLE = ROOT / "docs" / "examples" / "night.xml"


@pytest.mark.thorough
async def test_a_mouse_alone_composes_the_tree_of_the_example(tmp_path: Path) -> None:
    file = tmp_path / "night.xml"
    with served(file) as address:
        async with web_browser.page_at("desktop", address, shows=".element", expects=()) as page:
            await build_by_tutorial(Mouse(page), tutorial=TUTORIAL)
    assert file.read_text() == EXAMPLE.read_text()


@pytest.mark.thorough
def test_what_it_composes_is_checked_and_brought_up() -> None:
    with tempfile.TemporaryDirectory(prefix="scout-design-") as name:
        (Path(name) / "night.xml").write_bytes(EXAMPLE.read_bytes())
        run_all(TUTORIAL, Path(name))
