"""A file is replaced whole or not at all, and a writer that was killed leaves nothing for long."""

from __future__ import annotations

import fcntl
import os
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from full_disk import disk_full_at

from backbone import atomic_file
from backbone.atomic_file import freed_later, remove_leftover, replace_file

KILLED_WHILE_SAVING = """
import os, pathlib, signal, sys
from backbone import atomic_file
atomic_file.os.replace = lambda *_: os.kill(os.getpid(), signal.SIGKILL)
atomic_file.replace_file(pathlib.Path(sys.argv[1]), b"never whole")
"""


def kill_while_saving(target: Path) -> None:
    done = subprocess.run([sys.executable, "-c", KILLED_WHILE_SAVING, str(target)], check=False)
    assert done.returncode < 0, "it was not killed"


def names(folder: Path) -> list[str]:
    return sorted(one.name for one in folder.iterdir())


def test_a_file_is_replaced_and_keeps_its_mode(tmp_path: Path) -> None:
    target = tmp_path / "mission.xml"
    replace_file(target, b"old")
    target.chmod(0o640)
    replace_file(target, b"new")
    assert (target.read_bytes(), target.stat().st_mode & 0o777) == (b"new", 0o640)
    assert names(tmp_path) == ["mission.xml"]


@pytest.mark.processes
def test_kills_while_saving_leave_one_file_which_the_next_save_uses_up(tmp_path: Path) -> None:
    target = tmp_path / "mission.xml"
    replace_file(target, b"old")
    for _ in range(3):
        kill_while_saving(target)
    assert target.read_bytes() == b"old"
    assert len(names(tmp_path)) == 2
    replace_file(target, b"n")
    assert (target.read_bytes(), names(tmp_path)) == (b"n", ["mission.xml"])


@pytest.mark.processes
def test_the_leftover_of_a_killed_save_is_removed_at_the_next_opening(tmp_path: Path) -> None:
    target = tmp_path / "mission.xml"
    kill_while_saving(target)
    assert remove_leftover(target)
    assert names(tmp_path) == []
    assert not remove_leftover(target)


def test_the_blocks_of_the_old_content_are_freed_in_a_thread(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    target = tmp_path / "motions"
    replace_file(target, b"old")
    closes: list[str] = []
    close, replace = os.close, os.replace

    def watched_close(descriptor: int) -> None:
        closes.append(threading.current_thread().name)
        close(descriptor)

    def watched_replace(new: Path, old: Path) -> None:
        links = [one.resolve() for one in Path("/proc/self/fd").iterdir()]
        assert target in links, "the system would free the blocks before it returns"
        replace(new, old)

    monkeypatch.setattr(os, "close", watched_close)
    monkeypatch.setattr(os, "replace", watched_replace)
    replace_file(target, b"new", is_lasting=False)
    for thread in threading.enumerate():
        if thread.name == "free blocks":
            thread.join()
    assert (target.read_bytes(), sorted(set(closes))) == (b"new", ["MainThread", "free blocks"])


def test_where_no_thread_can_start_the_blocks_are_freed_at_once(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_thread: threading.Thread) -> None:
        raise RuntimeError("can't start new thread")

    target = tmp_path / "motions"
    replace_file(target, b"old")
    monkeypatch.setattr(threading.Thread, "start", refuse)
    before = set(os.listdir("/proc/self/fd"))
    replace_file(target, b"new", is_lasting=False)
    assert (target.read_bytes(), set(os.listdir("/proc/self/fd"))) == (b"new", before)


def test_a_file_that_is_missing_has_no_blocks_to_free(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError), freed_later(tmp_path / "missing"):
        (tmp_path / "missing").unlink()


def test_another_writer_at_work_is_neither_disturbed_nor_taken_for_a_leftover(tmp_path: Path) -> None:
    target = tmp_path / "mission.xml"
    beside = tmp_path / ".mission.xml.saving"
    with beside.open("wb") as theirs:
        fcntl.flock(theirs, fcntl.LOCK_EX)
        with pytest.raises(BlockingIOError):
            replace_file(target, b"ours")
        assert not remove_leftover(target)
        assert beside.exists()


def test_a_disk_that_becomes_full_leaves_the_old_file_and_nothing_else(tmp_path: Path) -> None:
    target = tmp_path / "mission.xml"
    replace_file(target, b"old")
    with disk_full_at(1000), pytest.raises(OSError, match="too large"):
        replace_file(target, b"x" * 5000)
    assert (target.read_bytes(), names(tmp_path)) == (b"old", ["mission.xml"])


def test_the_file_and_then_its_folder_are_on_the_disk_when_it_returns(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced: list[str] = []
    monkeypatch.setattr(
        atomic_file.os, "fsync", lambda descriptor: synced.append(os.readlink(f"/proc/self/fd/{descriptor}"))
    )
    replace_file(tmp_path / "mission.xml", b"new")
    assert synced == [str(tmp_path / ".mission.xml.saving"), str(tmp_path)]


def test_a_pipe_or_device_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    pipe = tmp_path / "pipe"
    os.mkfifo(pipe)
    with pytest.raises(OSError, match="no regular file"):
        replace_file(pipe, b"new")
    assert (pipe.is_fifo(), names(tmp_path)) == (True, ["pipe"])
