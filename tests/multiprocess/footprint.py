"""What each process of a mission takes of the machine: memory, descriptors, threads, log."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import psutil
from running_mission import RunningMission


@dataclass(frozen=True)
class Footprint:
    """What one process takes.

    Attributes:
        pid: Of the process; another one than before means that it was restarted.
        memory_kb: What would be free if it ended, pages shared with other processes not counted.
        descriptors: Open files and sockets.
        threads: Of the process.
        log_kb: Of its log and the one before it.
    """

    pid: int
    memory_kb: int
    descriptors: int
    threads: int
    log_kb: int

    def beyond(self, before: Footprint, share: float) -> list[str]:
        """Return what is greater than before by more than this share; small numbers are given two more."""
        return [
            f"{what} {old} -> {new}"
            for what, old, new in (
                ("memory_kb", before.memory_kb, self.memory_kb),
                ("descriptors", before.descriptors, self.descriptors),
                ("threads", before.threads, self.threads),
            )
            if new > max(old * (1.0 + share), old + 2)
        ]


def footprint(mission: RunningMission) -> dict[str, Footprint]:
    """Return what every process of the mission takes, by its name: of a component, a shared process, or a role."""
    found: dict[str, Footprint] = {}
    processes = {process.pid: process for process in mission.processes()}
    names = {pid: _name(process, mission) for pid, process in processes.items()}
    for pid, process in sorted(processes.items()):
        with contextlib.suppress(psutil.Error):  # it ends just now
            name = names[pid]
            if process.name().startswith("zygote-"):
                name = f"zygote of {names.get(process.ppid(), 'another')}"
            found[name if name not in found else f"{name} {pid}"] = _of(process, name, mission.directory)
    return found


def grown(before: Mapping[str, Footprint], after: Mapping[str, Footprint], share: float = 0.1) -> dict[str, list[str]]:
    """Return what has grown by more than this share, of the processes that were there before and are still."""
    both = {name: (before[name], after[name]) for name in before.keys() & after.keys()}
    found = {name: new.beyond(old, share) for name, (old, new) in both.items() if old.pid == new.pid}
    return {name: what for name, what in sorted(found.items()) if what}


def _of(process: psutil.Process, name: str, directory: Path) -> Footprint:
    logs = (directory / "log" / f"{name}.log", directory / "log" / f"{name}.log.1")
    with process.oneshot():
        return Footprint(
            process.pid,
            process.memory_full_info().uss // 1024,
            process.num_fds(),
            process.num_threads(),
            sum(path.stat().st_size for path in logs if path.exists()) // 1024,
        )


def _name(process: psutil.Process, mission: RunningMission) -> str:
    """Return whose process it is: its standard error is its log."""
    if process.pid == mission.launcher.pid:
        return "launcher"
    try:
        log = os.readlink(f"/proc/{process.pid}/fd/2")
        title = process.name()
    except (OSError, psutil.Error):
        return f"process {process.pid}"
    return Path(log).name.partition(".log")[0] if ".log" in log else title
