"""The copy of a mission that the module kit brings up finds the files that the mission names."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from backbone.mission.reader import read_mission, read_mission_bytes
from mission_control.laboratory.module_kit.real_mission import mission_text

EXAMPLES = Path(__file__).parents[3] / "docs/examples"


@pytest.mark.parametrize("is_text", [False, True])
def test_a_room_of_its_own_is_found_from_any_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_text: bool
) -> None:
    folder = tmp_path / "one & 'two'"
    folder.mkdir()
    for name in ("own-room.xml", "corridor.mjcf"):
        shutil.copy(EXAMPLES / name, folder)
    monkeypatch.chdir(folder)
    file = folder / "own-room.xml"
    copied = mission_text(file.read_text() if is_text else file, "test-1", {"corridor.mjcf": "./corridor.mjcf"})
    described = read_mission_bytes(copied.encode(), str(tmp_path / "mission.xml"))
    assert described.name == "test-1"
    assert described.components == read_mission(file).components
    assert "niche" in str(described.components)
    assert mission_text(copied, "test-1", {}) == copied, "an absolute path stays"


def test_so_is_a_floor_plan() -> None:
    plan = """<mission name="m"><parameter name="floor_plan" value='plan.png'/></mission>"""
    assert f"value='{Path.cwd()}/plan.png'" in mission_text(plan, "m", {})
