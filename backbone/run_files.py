"""Missions that are up on this machine, found by name: one small file for each.

The launcher writes its file as soon as the hub listens and removes it at the end. A file whose launcher has ended is
stale: readers skip it, and the next mission of that name overwrites it.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

import msgspec

from backbone import unexpected_ends
from backbone.atomic_file import is_at, opened_locked, replace_file
from backbone.authentication import secret_of
from backbone.errors import Refusal
from backbone.naming import is_legal, legal
from backbone.operating_system.file_locks import lock_alone_nowait
from backbone.operating_system.memory_folder import temporary_folder
from backbone.operating_system.process_starts import started_s

FILE_NAME = "run.json"
KEPT = ".kept"  # no legal name of a mission
ENDED = ".ended-"  # the folder of an ending mission is renamed to .<mission>.ended-<pid of the zygote that removes it>
TRIAL_BYTES = 1 << 16  # chosen: a mission writes so much until it is ready, logs included


class RunFile(msgspec.Struct, frozen=True):
    """How to connect to a mission that is up.

    Attributes:
        launcher_pid: Pid of the launcher.
        clock_origin_monotonic_s: This machine's monotonic clock at mission time 0.
        clock_rate: Mission seconds per second of the machine.
        host: Name of this machine in the mission.
        source: Path of the mission file.
        launcher_started_s: Start of the launcher's process, seconds since the machine's start; set by ``write``.
    """

    mission: str
    endpoint: str
    launcher_pid: int
    clock_origin_monotonic_s: float
    clock_rate: float
    host: str
    source: str
    launcher_started_s: float = 0.0


class MissionNotUp(Refusal):
    """No mission of this name, or none at all, is up on this machine."""

    code = "run.not_up"
    remedy = "Start it as this user with 'scout-backbone up MISSION.xml', or name a hub elsewhere with --connect."


class SeveralMissions(Refusal):
    """Several missions are up and none was named."""

    code = "run.several"
    remedy = "Name one with --mission."


class UnsafeDirectory(Refusal):
    """The folder of the run files, or the one around it, is another user's, or other users may write into it."""

    code = "run.unsafe_directory"
    remedy = "Set XDG_RUNTIME_DIR to a folder of your own with mode 0700. You can command only your own missions."


class RunFolderUnusable(Refusal):
    """The system refuses to write the files of a mission."""

    code = "run.folder"
    remedy = "Free the disk, or set XDG_RUNTIME_DIR to a folder of your own that can be written into."


class RunFolderRelative(Refusal):
    """The folder of the run files would be another one in each working directory."""

    code = "run.folder_relative"
    remedy = "Set XDG_RUNTIME_DIR to an absolute path, or unset it."


class RunFolderRemoved(Refusal):
    """The folder of a mission that is up was removed, as at the end of a login session."""

    code = "run.folder_removed"
    remedy = "Keep it: let your session last, by 'loginctl enable-linger', or set XDG_RUNTIME_DIR to another folder."


class FolderInUse(Refusal):
    """A mission of this name is coming up or ending on this machine."""

    code = "run.in_use"
    remedy = "Wait until it is up or has ended, see 'scout-backbone status'; or give this one another name."


class TraceUnwritable(Refusal):
    """The system refuses to write the trace."""

    code = "run.trace"
    remedy = "Name a file in a folder that can be written into, on a disk that is not full."


def run_directory(mission: str) -> Path:
    """Return the folder of a mission's files; its parent folder exists afterwards, for this user alone.

    Raises:
        IllegalName: The mission's name is no legal name.
        RunFolderRelative: ``XDG_RUNTIME_DIR`` is a relative path.
        UnsafeDirectory: Another user could write files there, or ``XDG_RUNTIME_DIR`` is another user's.
        RunFolderUnusable: The system refused.
    """
    return _directory() / legal(mission)


def kept_directory() -> Path:
    """Return this user's folder for files that outlive a process and belong to no mission of this machine.

    The folder lasts as long as the login session or, without a folder for sessions, as the machine's temporary files.

    Raises:
        Refusal: See ``run_directory``.
    """
    directory = _directory() / KEPT
    try:
        directory.mkdir(mode=0o700, exist_ok=True)
        _check_private(directory)
    except OSError as error:
        raise _unusable(directory, error) from error
    return directory


@contextlib.contextmanager
def own_folder(mission: str) -> Iterator[Path]:
    """Prepare the folder of a mission's files for this process alone, and remove it at the end.

    The folder stays locked meanwhile, because a mission that is coming up or ending has no run file.

    Raises:
        FolderInUse: Another process has the folder.
        Refusal: See ``run_directory``. If the system refuses, the folder is removed.
    """
    descriptor = _locked_folder(mission)
    try:
        yield prepare(mission)
    finally:
        if is_at(descriptor, run_directory(mission)):  # else its zygote has hidden it, and this is its successor's
            remove(mission)
        os.close(descriptor)


def prepare(mission: str) -> Path:
    """Create the folder of a mission's files, check that it is writable, and return it.

    Raises:
        Refusal: See ``run_directory``. If the system refuses, the folder is removed.
    """
    directory = run_directory(mission)
    _remove_what_dead_zygotes_left(directory)
    try:
        unexpected_ends.forget(directory)
        (directory / "log").mkdir(mode=0o700, parents=True, exist_ok=True)
        directory.chmod(0o700)
        trial = directory / ".trial"
        try:
            replace_file(trial, bytes(TRIAL_BYTES), is_lasting=False)
        finally:
            trial.unlink(missing_ok=True)
    except OSError as error:
        shutil.rmtree(directory, ignore_errors=True)
        raise _unusable(directory, error) from error
    return directory


def begin_trace(trace: Path) -> None:
    """Make the file of a trace, unless it is there and empty, or a pipe or device.

    Raises:
        TraceUnwritable: The system refuses the file, or it has content: two missions in one trace cannot be judged.
    """
    try:
        with trace.open("ab") as file:
            length = os.fstat(file.fileno()).st_size
    except OSError as error:
        raise TraceUnwritable(f"{trace}: {error.strerror}", trace=str(trace)) from error
    if length:
        raise TraceUnwritable(f"{trace} has content", remedy="Name a new file, or remove this one.", trace=str(trace))


def write(run_file: RunFile) -> Path:
    """Make the mission findable and return the file's path.

    Raises:
        Refusal: See ``run_directory``.
    """
    directory = run_directory(run_file.mission)
    began_s = started_s(run_file.launcher_pid) or 0.0
    content = msgspec.json.encode(msgspec.structs.replace(run_file, launcher_started_s=began_s))
    path = directory / FILE_NAME
    try:
        directory.mkdir(mode=0o700, exist_ok=True)
        directory.chmod(0o700)
        replace_file(path, content, is_lasting=False)
    except OSError as error:
        raise _unusable(directory, error) from error
    return path


def unlist(directory: Path) -> None:
    """Let no command find the mission of this folder any more: its launcher ends it. Idempotent."""
    with contextlib.suppress(OSError):
        (directory / FILE_NAME).unlink()


def remove(mission: str) -> None:
    """Remove the mission's folder and its files. Idempotent."""
    shutil.rmtree(run_directory(mission), ignore_errors=True)


def find(mission: str | None = None) -> RunFile:
    """Return the run file of a mission that is up on this machine.

    Args:
        mission: Its name; None: the only mission.

    Raises:
        MissionNotUp: The mission is not up; the detail names the missions that are up, and says how this one, or the
            last one, ended unexpectedly.
        SeveralMissions: ``mission`` is None and several missions are up.
    """
    up = find_all()
    names = ", ".join(run_file.mission for run_file in up)
    if mission is None:
        if not up:
            raise MissionNotUp(f"no mission is up on this machine for this user{_how_ended(None)}")
        if len(up) > 1:
            raise SeveralMissions(f"several missions are up: {names}", missions=names)
        return up[0]
    for run_file in up:
        if run_file.mission == mission:
            return run_file
    told = f"mission {mission!r} is not up; up: {names or 'none'}{_how_ended(mission)}"
    raise MissionNotUp(told, mission=mission, missions=names)


def _how_ended(mission: str | None) -> str:
    """Return the unexpected end of the mission as the last part of a sentence; empty: none is known."""
    end = unexpected_ends.newest(_directory(), mission)
    return f"; {end}" if end is not None else ""


def secret(run_file: RunFile) -> str:
    """Return the mission's secret; empty: the hub asks for none."""
    return secret_of(str(run_directory(run_file.mission)))


def find_all() -> list[RunFile]:
    """Return the missions that are up on this machine, sorted by name; folders that cannot be read are left out.

    Raises:
        Refusal: See ``run_directory``.
    """
    directory = _directory()
    try:
        folders = sorted(directory.iterdir())
    except OSError as error:
        raise _unusable(directory, error) from error
    found = (_read(folder / FILE_NAME) for folder in folders if is_legal(folder.name))
    return [run_file for run_file in found if run_file is not None and _is_fresh(run_file)]


def _locked_folder(mission: str) -> int:
    """Create the mission's folder if it is missing, lock it, and return its descriptor."""
    while True:
        directory = run_directory(mission)
        try:
            directory.mkdir(mode=0o700, exist_ok=True)
            return opened_locked(directory, os.O_NOFOLLOW, 0, lock_alone_nowait)
        except FileNotFoundError:  # its owner has just removed it
            continue
        except BlockingIOError as error:
            raise FolderInUse(f"mission {mission} is coming up or ending", mission=mission) from error
        except OSError as error:
            raise _unusable(directory, error) from error


def _remove_what_dead_zygotes_left(directory: Path) -> None:
    """Remove folders of earlier runs whose zygote was killed between hiding its folder and removing it."""
    for hidden in directory.parent.glob(f".{directory.name}{ENDED}*"):
        pid = hidden.name.rpartition(ENDED)[2]
        if pid.isdecimal() and started_s(int(pid)) is None:
            shutil.rmtree(hidden, ignore_errors=True)


def _directory() -> Path:
    """Create and check the folder of this user's run files, and return it."""
    runtime = os.environ.get("XDG_RUNTIME_DIR")
    if runtime and not os.path.isabs(runtime):
        raise RunFolderRelative(f"XDG_RUNTIME_DIR is {runtime!r}, a relative path", directory=runtime)
    base = Path(runtime) if runtime else temporary_folder() / f"scout-backbone-{os.getuid()}"
    directory = base / "scout-backbone"
    try:
        if not runtime:
            base.mkdir(mode=0o700, exist_ok=True)
            _check_private(base)
        elif base.exists():
            _check_own(base)
        directory.mkdir(mode=0o700, parents=True, exist_ok=True)
        _check_private(directory)
    except OSError as error:
        raise _unusable(directory, error) from error
    return directory


def _unusable(directory: Path, error: OSError) -> RunFolderUnusable:
    return RunFolderUnusable(f"{directory}: {error.strerror or error}", directory=str(directory))


def _check_own(base: Path) -> None:
    # su keeps XDG_RUNTIME_DIR: root would make folders there that its owner could not use.
    owner = base.stat().st_uid
    if owner not in (0, os.getuid()):
        raise UnsafeDirectory(f"{base} belongs to user {owner}", directory=str(base))


def _check_private(directory: Path) -> None:
    # All users can write into the folder for temporary files, so another user may have created this folder first.
    found = directory.lstat()
    if found.st_uid != os.getuid() or found.st_mode & 0o022 or directory.is_symlink():
        raise UnsafeDirectory(f"{directory} is not private to this user", directory=str(directory))


def _read(path: Path) -> RunFile | None:
    """Return the run file at this path; None if it is missing, unreadable, or from another release."""
    try:
        if not path.is_file():  # a pipe would be waited for
            return None
        return msgspec.json.decode(path.read_bytes(), type=RunFile)
    except (OSError, msgspec.DecodeError):  # one folder of another account must not hide all missions
        return None


def _is_fresh(run_file: RunFile) -> bool:
    return started_s(run_file.launcher_pid) == run_file.launcher_started_s
