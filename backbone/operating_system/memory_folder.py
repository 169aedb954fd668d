"""Folder for temporary files, in memory if the system has such a folder: a process there never waits for a disk."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path

SHARED_MEMORY = Path("/dev/shm")  # noqa: S108  run_files checks whose folder it uses there
"""Linux's folder for shared memory (``shm_overview(7)``): it lies in memory, and all users may make folders there."""
LOGIND = Path("/run/systemd/seats")
"""Folder of the login manager while it runs. When a user has logged out, it removes the user's files from shared
memory, except those of system users (``logind.conf(5)``, ``RemoveIPC``)."""
MOUNTS = Path("/proc/self/mountinfo")
_SYSTEM_USERS = 1000  # systemd's uids of system users are below
_IN_MEMORY = frozenset({"tmpfs", "ramfs"})


def temporary_folder() -> Path:
    """Return a folder in which this user may make folders: in memory if they stay there, else for temporary files."""
    stays = os.getuid() < _SYSTEM_USERS or not LOGIND.exists()
    is_usable = os.access(SHARED_MEMORY, os.W_OK | os.X_OK) and _file_system(SHARED_MEMORY) in _IN_MEMORY
    return SHARED_MEMORY if stays and is_usable else Path(tempfile.gettempdir())


def disk_of(folder: Path) -> str:
    """Return the file system of a folder on a disk, such as ``ext4``; empty: it is in memory, or nothing is known."""
    kind = _file_system(folder)
    return "" if kind in _IN_MEMORY else kind


def _file_system(folder: Path) -> str:
    """Return the type of the folder's file system; empty: the system does not state it."""
    try:
        device = folder.stat().st_dev
        lines = MOUNTS.read_text(errors="replace").splitlines()
    except OSError:
        return ""
    wanted = f"{os.major(device)}:{os.minor(device)}"
    for line in lines:
        mount, _, source = line.partition(" - ")  # proc(5): the type follows this separator
        if mount.split()[2] == wanted:
            return source.split()[0]
    return ""
