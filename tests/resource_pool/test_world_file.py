"""What a simulated world keeps for its next process."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from resource_pool.world_file import WorldFile
from scout_model.world import WorldMemory

MEMORY = WorldMemory(90, {"scout1": [1.0, 2.0, 0.02, 1.0, 0.0, 0.0, 0.0]}, {"scout1": 0.75})


def file(folder: Path | str) -> WorldFile:
    return WorldFile(str(folder), "world")


def test_what_one_process_writes_the_next_reads(tmp_path: Path) -> None:
    assert file(tmp_path).read() is None
    file(tmp_path).write(MEMORY)
    assert file(tmp_path).read() == MEMORY


def test_an_unstable_world_is_forgotten(tmp_path: Path) -> None:
    former = file(tmp_path)
    former.forget()
    former.write(MEMORY)
    former.forget()
    assert file(tmp_path).read() is None


def test_without_a_folder_nothing_is_kept() -> None:
    nowhere = file("")
    nowhere.write(MEMORY)
    nowhere.forget()
    assert nowhere.read() is None


def test_a_file_that_cannot_be_read_is_as_none(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "worlds").mkdir()
    (tmp_path / "worlds" / "world").write_bytes(b"torn")
    assert file(tmp_path).read() is None
    assert "first places" in caplog.text


def test_a_full_disk_is_told_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise OSError(28, "No space left on device")

    kept = file(tmp_path)
    kept.write(MEMORY)
    monkeypatch.setattr("resource_pool.world_file.replace_file", full)
    for _ in range(3):
        kept.write(MEMORY)
    assert caplog.text.count("No space left") == 1
