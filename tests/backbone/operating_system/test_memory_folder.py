"""Temporary files lie in memory where the system has a folder for it, and a folder on a disk is known as one."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

import pytest

from backbone.operating_system import memory_folder
from backbone.operating_system.memory_folder import disk_of, temporary_folder


def mounts_of(folder: Path, kind: str) -> str:
    device = folder.stat().st_dev
    here = f"{os.major(device)}:{os.minor(device)}"
    return f"""22 27 250:7 / /proc rw,relatime shared:12 - proc proc rw
25 24 {here} / {folder} rw shared:1 master:2 - {kind} /dev/sda1 rw,size=24684084k
26 24 250:8 / /dev/pts rw - devpts devpts rw
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder that stands for the system's one in memory."""
    monkeypatch.setattr(memory_folder, "SHARED_MEMORY", tmp_path)
    monkeypatch.setattr(memory_folder, "MOUNTS", tmp_path / "mountinfo")
    monkeypatch.setattr(memory_folder, "LOGIND", tmp_path / "seats")
    return tmp_path


@pytest.mark.parametrize(
    ("user", "has_logins", "is_taken"), [(0, True, True), (999, True, True), (1000, True, False), (1000, False, True)]
)
def test_the_folder_in_memory_is_taken_if_no_logout_removes_it(
    folder: Path, monkeypatch: pytest.MonkeyPatch, user: int, has_logins: bool, is_taken: bool
) -> None:
    (folder / "mountinfo").write_text(mounts_of(folder, "tmpfs"))
    if has_logins:
        (folder / "seats").mkdir()
    monkeypatch.setattr(os, "getuid", lambda: user)
    assert temporary_folder() == (folder if is_taken else Path(tempfile.gettempdir()))


@pytest.mark.parametrize("kind", ["ext4", "overlay"])
def test_a_folder_of_that_name_on_a_disk_is_not_taken(folder: Path, kind: str) -> None:
    (folder / "mountinfo").write_text(mounts_of(folder, kind))
    assert temporary_folder() == Path(tempfile.gettempdir())


def test_nor_is_one_that_is_missing_or_of_which_nothing_is_known(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert temporary_folder() == Path(tempfile.gettempdir())
    (folder / "mountinfo").write_text("")
    assert temporary_folder() == Path(tempfile.gettempdir())
    monkeypatch.setattr(memory_folder, "SHARED_MEMORY", folder / "missing")
    assert temporary_folder() == Path(tempfile.gettempdir())


@pytest.mark.parametrize(
    ("kind", "disk"), [("ext4", "ext4"), ("fuse.sshfs", "fuse.sshfs"), ("tmpfs", ""), ("ramfs", "")]
)
def test_a_folder_on_a_disk_is_known_as_one(folder: Path, kind: str, disk: str) -> None:
    (folder / "mountinfo").write_text(mounts_of(folder, kind))
    assert disk_of(folder) == disk


def test_of_a_missing_folder_no_disk_is_known(folder: Path) -> None:
    assert disk_of(folder / "missing") == ""
    assert disk_of(folder) == "", "a system without a table of its mounts"
