"""On a disk that takes nothing a mission is refused at once, or goes on without what cannot be written."""

from __future__ import annotations

import contextlib
import os
import resource
import signal
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import psutil
import pytest
from running_mission import BIN, MISSION_XML, RunningMission, mission_up

from backbone.operating_system import memory_folder

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]
WHOLE_WITHIN_S = 60.0
Fill = Callable[[RunningMission], None]


def test_up_refuses_a_disk_that_takes_nothing_before_anything_starts(tmp_path: Path) -> None:
    words = f"ulimit -f 0; exec {BIN / 'scout-backbone'} up {MISSION_XML} --headless"
    done = subprocess.run(
        ["/bin/sh", "-c", words],
        env={**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 4, done.stderr
    assert "refused [run.folder]" in done.stderr
    assert "nameserver" not in done.stderr
    assert "Traceback" not in done.stderr


def test_up_refuses_a_trace_that_cannot_be_written_before_anything_starts(tmp_path: Path) -> None:
    done = subprocess.run(
        [str(BIN / "scout-backbone"), "up", str(MISSION_XML), "--headless", "--trace", str(tmp_path / "no" / "trace")],
        env={**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 4, done.stderr
    assert "refused [run.trace]" in done.stderr
    assert "Traceback" not in done.stderr


@pytest.mark.thorough
def test_a_mission_goes_on_when_nothing_it_tells_can_be_written(tmp_path: Path) -> None:
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [str(BIN / "scout-backbone"), "up", str(MISSION_XML), "--headless", "--for", "8"],
            env={**os.environ, "XDG_RUNTIME_DIR": str(tmp_path)},
            stderr=full,
            timeout=90,
            check=False,
        )
    assert done.returncode == 0


def let_nothing_be_written(mission: RunningMission) -> None:
    """Needs no rights: no process of the mission, and none it starts, may make a file any longer."""
    for process in mission.processes():
        with contextlib.suppress(psutil.Error, ProcessLookupError):
            resource.prlimit(process.pid, resource.RLIMIT_FSIZE, (0, resource.RLIM_INFINITY))


@pytest.fixture(params=["no process may write", "a small disk is full"])
def fill(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Iterator[Fill]:
    """Return what fills the disk under a running mission."""
    if request.param == "no process may write":
        yield let_nothing_be_written
        return
    disk = Path(tempfile.mkdtemp(prefix="disk-"))  # short: the mission's socket lies in it
    mounted = subprocess.run(
        ["mount", "-t", "tmpfs", "-o", "size=2m", "tmpfs", str(disk)], capture_output=True, check=False
    )
    if mounted.returncode:
        disk.rmdir()
        pytest.skip("needs the right to mount a small disk")
    monkeypatch.setattr(memory_folder, "SHARED_MEMORY", disk)  # for the mission's folder
    monkeypatch.setattr(tempfile, "tempdir", str(disk))  # for the trace

    def write_all_of_it(_mission: RunningMission) -> None:
        with (disk / "ballast").open("wb", buffering=0) as ballast, contextlib.suppress(OSError):
            while ballast.write(bytes(512)):
                pass

    yield write_all_of_it
    subprocess.run(["umount", "--lazy", str(disk)], check=True)
    disk.rmdir()


@pytest.mark.thorough
def test_a_disk_that_fills_up_stops_the_trace_and_keeps_no_component_from_coming_back(fill: Fill) -> None:
    trace = Path(tempfile.gettempdir()) / f"trace-{os.getpid()}.jsonl"
    try:
        with mission_up("--trace", str(trace)) as mission:
            killed = {name: mission.component(name)["pid"] for name in ("grabber", "nameserver", "creator-base")}
            fill(mission)
            (mission.directory / "gl_support.json").unlink(missing_ok=True)
            for pid in killed.values():
                os.kill(pid, signal.SIGKILL)
            wait_until(mission, lambda: all(mission.component(name)["pid"] != pid for name, pid in killed.items()))
            wait_until(mission, lambda: all(c["state"] == "ready" for c in mission.status()["components"]))
            words = ("scout-backbone", "story", "rc_manager", "--mission", mission.name)
            # The last page of the trace has room for some lines yet.
            wait_until(mission, lambda: "the trace of the schedule stopped: " in mission.command(*words).stdout)
            assert mission.down() == 0, mission.story()
            assert "Traceback" not in "\n".join(mission.lines)
    finally:
        trace.unlink(missing_ok=True)


def wait_until(mission: RunningMission, holds: Callable[[], bool]) -> None:
    deadline_s = time.monotonic() + WHOLE_WITHIN_S
    while time.monotonic() < deadline_s:
        with contextlib.suppress(AssertionError):  # the nameserver is away for a moment
            if holds():
                return
        time.sleep(0.2)
    raise AssertionError(mission.story())
