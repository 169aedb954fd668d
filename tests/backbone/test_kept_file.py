"""Files that outlast a process, but not its mission."""

from __future__ import annotations

from pathlib import Path

import pytest

from backbone.kept_file import KeptFile, kept_files, put_back
from resource_pool.motion_file import MotionFile
from resource_pool.stop_file import StopFile
from resource_pool.stop_messages import StopState
from resource_pool.world_file import WorldFile
from scout_model.world import WorldMemory


def write_all(folder: Path) -> tuple[MotionFile, StopFile, WorldFile]:
    return MotionFile(str(folder), "one"), StopFile(str(folder), "one"), WorldFile(str(folder), "one")


@pytest.mark.parametrize("comes_up_again", [False, True])
def test_a_process_of_a_mission_that_has_ended_writes_nothing(tmp_path: Path, *, comes_up_again: bool) -> None:
    """A zygote renames the folder of a mission that ends; the next mission of this name may be up already."""
    folder = tmp_path / "mission"
    folder.mkdir()
    motions, stop, world = write_all(folder)
    motions.begin(1.0, [])
    folder.rename(tmp_path / ".mission.ended")
    if comes_up_again:
        folder.mkdir()
    motions.begin(2.0, [])
    stop.write(StopState("one", True, 1, "anna", "", 3.0))
    world.write(WorldMemory(90, {}, {}))
    world.forget()
    assert folder.exists() == comes_up_again
    assert not comes_up_again or list(folder.iterdir()) == []
    assert (motions.read(), stop.read(), world.read()) == (None, None, None)


def test_it_is_read_by_the_next_process(tmp_path: Path) -> None:
    target = KeptFile(str(tmp_path), "stops", "one").target()
    assert target == tmp_path / "kept" / "stops" / "one"
    target.write_bytes(b"x")
    assert KeptFile(str(tmp_path), "stops", "one").read() == b"x"


def test_kept_files_move_to_another_folder(tmp_path: Path) -> None:
    before, after = tmp_path / "before", tmp_path / "after"
    for folder in (before, after):
        folder.mkdir()
    write_all(before)[1].write(StopState("one", True, 1, "anna", "", 3.0))
    (before / "secret").write_text("not kept")
    (before / "kept" / "stops" / ".one.new").write_text("half written")
    put_back(after, kept_files(before))
    assert write_all(after)[1].read() == StopState("one", True, 1, "anna", "", 3.0)
    assert [str(path) for path in kept_files(after)] == ["kept/stops/one"]
    assert not (after / "secret").exists()


def test_a_kept_file_that_cannot_be_moved_is_left_with_a_warning(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "kept").touch()
    put_back(tmp_path, {Path("kept/stops/one"): b"x"})
    assert "kept/stops/one is lost" in caplog.text
    assert kept_files(tmp_path / "nowhere") == {}


@pytest.mark.parametrize("folder", ["", "/nowhere/at/all"])
def test_without_a_folder_nothing_is_kept(folder: str) -> None:
    kept = KeptFile(folder, "stops", "one")
    assert (kept.path, kept.target(), kept.read()) == (None, None, None)
