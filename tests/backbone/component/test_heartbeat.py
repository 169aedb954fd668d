"""A written heartbeat is read, and a failure to write or read it ends no component."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from pathlib import Path

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.heartbeat import (
    BEAT_EVERY_S,
    DOING_BYTES,
    Heartbeat,
    forget_heartbeat,
    heartbeat_path,
    read_vitals,
)


def beat_for(run_directory: str, seconds: float, doing: str = "") -> None:
    async def main() -> None:
        heartbeat = Heartbeat(run_directory, lambda: doing)
        beating = asyncio.create_task(heartbeat.keep(VirtualClock()))
        await VirtualClock().sleep_s(seconds)
        beating.cancel()
        await asyncio.gather(beating, return_exceptions=True)
        heartbeat.close()

    run_virtual(main())


def test_what_is_written_is_read(tmp_path: Path) -> None:
    beat_for(str(tmp_path), 10 * BEAT_EVERY_S + 0.01, "opens the camera")
    vitals = read_vitals(str(tmp_path), os.getpid())
    assert vitals is not None
    assert (vitals.beats, vitals.doing) == (11, "opens the camera")
    assert vitals.ran_s > 0


def test_a_long_line_is_cut(tmp_path: Path) -> None:
    beat_for(str(tmp_path), 0.1, "ü" * 1000)
    vitals = read_vitals(str(tmp_path), os.getpid())
    assert vitals is not None
    assert len(vitals.doing.encode()) <= DOING_BYTES


def test_without_a_folder_the_processor_time_is_still_seen() -> None:
    beat_for("", 1.0)
    vitals = read_vitals("", os.getpid())
    assert vitals is not None
    assert vitals.beats == 0


def test_a_folder_that_cannot_be_written_harms_nobody(tmp_path: Path) -> None:
    (tmp_path / "heartbeat").write_text("a file where a folder should be")
    beat_for(str(tmp_path), 1.0)
    vitals = read_vitals(str(tmp_path), os.getpid())
    assert vitals is not None
    assert vitals.beats == 0


def test_a_full_disk_stops_no_heartbeat(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A disk that filled up once made every process look hung, and all of them were killed."""

    def full(*_arguments: object) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    beat_for(str(tmp_path), 10 * BEAT_EVERY_S + 0.01, "records")
    vitals = read_vitals(str(tmp_path), os.getpid())
    assert vitals is not None
    assert (vitals.beats, vitals.doing) == (11, "")


@pytest.mark.processes
def test_a_process_that_has_ended_has_no_vitals(tmp_path: Path) -> None:
    ended = subprocess.Popen([sys.executable, "-c", ""])
    ended.wait()
    assert read_vitals(str(tmp_path), ended.pid) is None


def test_a_heartbeat_can_be_forgotten_twice(tmp_path: Path) -> None:
    beat_for(str(tmp_path), 0.1)
    for _ in range(2):
        forget_heartbeat(str(tmp_path), os.getpid())
    assert not heartbeat_path(str(tmp_path), os.getpid()).exists()
