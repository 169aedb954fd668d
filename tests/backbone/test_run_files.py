"""Missions of this machine are found by name, and only while their launcher lives."""

import errno
import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path

import pytest
from full_disk import disk_full_at

from backbone import run_files
from backbone.errors import Refusal
from backbone.run_files import (
    FolderInUse,
    MissionNotUp,
    RunFile,
    RunFolderRelative,
    RunFolderUnusable,
    SeveralMissions,
    TraceUnwritable,
    UnsafeDirectory,
)


@pytest.fixture(autouse=True)
def runtime_directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return tmp_path


def up(mission: str, pid: int | None = None) -> RunFile:
    return RunFile(mission, "tcp/127.0.0.1:7447", pid or os.getpid(), 12.5, 2.0, "lab", "/missions/m.xml")


def test_what_was_written_is_found_by_name_and_alone() -> None:
    run_files.write(up("iros2001"))
    for found in (run_files.find("iros2001"), run_files.find()):
        assert (found.endpoint, found.clock_origin_monotonic_s, found.clock_rate) == ("tcp/127.0.0.1:7447", 12.5, 2.0)


def test_nothing_is_up_on_a_fresh_machine() -> None:
    with pytest.raises(MissionNotUp):
        run_files.find()


def test_a_wrong_name_is_refused_and_the_refusal_names_what_is_up() -> None:
    run_files.write(up("iros2001"))
    with pytest.raises(MissionNotUp, match="iros2001"):
        run_files.find("ram2002")


def test_of_several_missions_one_must_be_named() -> None:
    run_files.write(up("one"))
    run_files.write(up("two"))
    with pytest.raises(SeveralMissions, match="one, two"):
        run_files.find()
    assert run_files.find("two").mission == "two"


@pytest.mark.processes
def test_the_file_of_a_launcher_that_ended_is_stale() -> None:
    with subprocess.Popen([sys.executable, "-c", "input()"], stdin=subprocess.PIPE) as launcher:
        run_files.write(up("iros2001", launcher.pid))
        assert run_files.find().launcher_pid == launcher.pid
        launcher.kill()
    with pytest.raises(MissionNotUp):
        run_files.find("iros2001")


def test_a_reused_process_number_does_not_revive_a_mission() -> None:
    path = run_files.write(up("iros2001"))
    path.write_bytes(path.read_bytes().replace(b'"launcher_started_s":', b'"launcher_started_s":1'))
    with pytest.raises(MissionNotUp):
        run_files.find()


def test_a_broken_file_is_passed_over() -> None:
    path = run_files.write(up("iros2001"))
    path.write_bytes(b"{")
    with pytest.raises(MissionNotUp):
        run_files.find()


@pytest.mark.timeout(30)
def test_a_pipe_or_a_folder_in_the_place_of_the_file_is_not_waited_for(runtime_directory: Path) -> None:
    run_files.write(up("there"))
    for mission, make in (("pipe", os.mkfifo), ("folder", os.mkdir)):
        folder = runtime_directory / "scout-backbone" / mission
        folder.mkdir()
        make(folder / run_files.FILE_NAME)
    assert [one.mission for one in run_files.find_all()] == ["there"]


def test_a_folder_that_cannot_be_read_hides_no_mission(runtime_directory: Path) -> None:
    run_files.write(up("iros2001"))
    (runtime_directory / "scout-backbone" / "loop").symlink_to("loop")
    (runtime_directory / "scout-backbone" / "other" / run_files.FILE_NAME).mkdir(parents=True)
    assert run_files.find().mission == "iros2001"


def test_run_folders_that_cannot_be_listed_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(_folder: Path) -> Iterator[Path]:
        raise PermissionError(errno.EACCES, "Permission denied")

    monkeypatch.setattr(Path, "iterdir", refused)
    with pytest.raises(RunFolderUnusable, match="Permission denied"):
        run_files.find()


def test_removing_leaves_nothing_and_may_be_done_twice(runtime_directory: Path) -> None:
    path = run_files.write(up("iros2001"))
    (path.parent / "log").mkdir()
    run_files.remove("iros2001")
    run_files.remove("iros2001")
    assert list((runtime_directory / "scout-backbone").iterdir()) == []


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a folder to another account")
def test_in_the_folder_of_another_account_nothing_is_made(runtime_directory: Path) -> None:
    os.chown(runtime_directory, 65534, 65534)
    for access in (run_files.find, run_files.kept_directory, lambda: run_files.run_directory("m")):
        with pytest.raises(run_files.UnsafeDirectory) as refused:
            access()
        assert refused.value.detail == f"{runtime_directory} belongs to user 65534"
    assert list(runtime_directory.iterdir()) == []


def test_the_folder_is_this_users_alone(runtime_directory: Path) -> None:
    path = run_files.write(up("iros2001"))
    assert path.parent.stat().st_mode & 0o777 == 0o700
    (runtime_directory / "scout-backbone").chmod(0o777)
    with pytest.raises(UnsafeDirectory):
        run_files.find()


def test_without_a_runtime_directory_a_folder_of_the_user_is_made(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delenv("XDG_RUNTIME_DIR")
    monkeypatch.setattr(run_files, "temporary_folder", lambda: tmp_path)
    path = run_files.write(up("iros2001"))
    assert path.is_relative_to(tmp_path / f"scout-backbone-{os.getuid()}")
    assert run_files.find().mission == "iros2001"


def test_a_mission_name_cannot_lead_out_of_the_folder() -> None:
    with pytest.raises(Refusal):
        run_files.run_directory("../elsewhere")


@pytest.mark.processes
def test_folders_that_killed_zygotes_hid_are_removed_at_the_next_beginning() -> None:
    directory = run_files.prepare("iros2001")
    child = subprocess.Popen(["true"])
    child.wait()
    left, ending, others = (
        directory.with_name(name)
        for name in (f".iros2001.ended-{child.pid}", f".iros2001.ended-{os.getpid()}", f".m.ended-{child.pid}")
    )
    for hidden in (left, ending, others):
        (hidden / "log").mkdir(parents=True)
    run_files.prepare("iros2001")
    assert [left.exists(), ending.exists(), others.exists()] == [False, True, True]


def test_a_folder_that_takes_nothing_is_refused_before_anything_starts_and_is_away(runtime_directory: Path) -> None:
    with disk_full_at(1000), pytest.raises(RunFolderUnusable, match="iros2001: File too large"):
        run_files.prepare("iros2001")
    assert list((runtime_directory / "scout-backbone").iterdir()) == []
    run_files.write(up("iros2001"))
    with disk_full_at(10), pytest.raises(RunFolderUnusable):
        run_files.write(up("iros2001"))
    assert run_files.find().mission == "iros2001", "the old one stays"


def test_a_runtime_folder_that_cannot_be_made_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").touch()
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path / "file"))
    with pytest.raises(RunFolderUnusable, match="Not a directory"):
        run_files.find()


def test_a_trace_that_cannot_be_opened_is_refused(tmp_path: Path) -> None:
    with pytest.raises(TraceUnwritable, match="No such file"):
        run_files.begin_trace(tmp_path / "no" / "trace.jsonl")


def test_a_trace_of_an_earlier_mission_is_neither_continued_nor_lost(tmp_path: Path) -> None:
    """Two missions in one file would be judged as one."""
    trace = tmp_path / "trace.jsonl"
    run_files.begin_trace(trace)
    run_files.begin_trace(trace)  # still empty
    trace.write_text("of an earlier mission\n")
    with pytest.raises(TraceUnwritable, match="has content") as refused:
        run_files.begin_trace(trace)
    assert "new file" in refused.value.remedy
    assert trace.read_text() == "of an earlier mission\n"


def test_a_trace_may_go_to_a_device() -> None:
    run_files.begin_trace(Path("/dev/null"))


def test_a_mission_that_comes_up_keeps_its_folder_to_itself(runtime_directory: Path) -> None:
    with run_files.own_folder("iros2001") as directory:
        with pytest.raises(FolderInUse, match="iros2001 is coming up"), run_files.own_folder("iros2001"):
            pass
        with run_files.own_folder("ram2002"):
            assert (directory / "log").is_dir()
    assert list((runtime_directory / "scout-backbone").iterdir()) == []
    with run_files.own_folder("iros2001"):
        pass


def test_a_mission_that_ends_leaves_its_successor_alone() -> None:
    """Its zygote hides its folder first, so that a mission of this name can come up again."""
    with ExitStack() as ending:
        folder = ending.enter_context(run_files.own_folder("iros2001"))
        folder.rename(folder.with_name(f".iros2001.ended-{os.getpid()}"))
        with run_files.own_folder("iros2001"):
            ending.close()
            assert (folder / "log").is_dir()


@pytest.mark.parametrize("relative", ["run", ".", "../run", "~/run"])
def test_a_relative_runtime_folder_is_refused_by_each_command(
    relative: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """XDG Base Directory Specification 0.8: paths must be absolute, a relative path is invalid."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("XDG_RUNTIME_DIR", relative)
    for access in (run_files.find, run_files.kept_directory, lambda: run_files.run_directory("m")):
        with pytest.raises(RunFolderRelative, match=relative) as refused:
            access()
        assert "Set XDG_RUNTIME_DIR to an absolute path" in refused.value.remedy
    assert not list(tmp_path.iterdir())
