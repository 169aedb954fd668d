"""A recorder begins, whatever it prints before. If its begin is broken off, no process is left; its end goes well."""

from __future__ import annotations

import asyncio
import os
import shutil
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import psutil
import pytest

from backbone.bus.clock import MissionClock
from backbone.launcher import mission_recorder
from backbone.launcher.kept_creator import Offered, recorder_of_host
from backbone.launcher.mission_recorder import MissionRecorder, RecorderFailed, absences_of
from backbone.recording.recorder import LEAST_FREE_BYTES
from backbone.waiting import end_tasks

pytestmark = [pytest.mark.processes, pytest.mark.timeout(60)]

WITHIN_S = 20.0
PLAYED = """#!/bin/sh
cd {folder}
echo $$ >> pids
{words}
trap '' TERM
touch hangs
while :; do sleep 0.1; done
"""
WARNS = "echo 'old.py:2: UserWarning: this module is old' >&2"
COUNTS = "head -c 300000 /dev/zero | tr '\\0' '\\r' >&2"
FALLS_FOR_GOOD = "test -e fell && exit 1; touch fell; echo records to night.mcap >&2"
FALLS_ONCE = "test -e fell || { touch fell; echo records to night.mcap >&2; echo the disc is gone >&2; exit 1; }"


def played(folder: Path, words: str, monkeypatch: pytest.MonkeyPatch) -> MissionRecorder:
    """Return a recorder whose process is a script that, after these words, hangs and ignores the order to end."""
    script = folder / "recorder"
    script.write_text(PLAYED.format(folder=folder, words=words))
    script.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(script))
    monkeypatch.setattr(mission_recorder, "ENDED_WITHIN_S", 0.5)
    return MissionRecorder("night", folder / "night.mcap", MissionClock.started_now(), [])


async def until(holds: Callable[[], bool]) -> None:
    until_s = time.monotonic() + WITHIN_S
    while not holds():
        assert time.monotonic() < until_s
        await asyncio.sleep(0.05)


async def until_it_hangs(folder: Path) -> None:
    await until((folder / "hangs").exists)


def left(folder: Path) -> list[int]:
    """End what is left, and return it."""
    pids = [pid for pid in map(int, (folder / "pids").read_text().split()) if psutil.pid_exists(pid)]
    for pid in pids:
        os.kill(pid, signal.SIGKILL)
    return pids


async def test_one_whose_first_begin_is_broken_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    recorder = played(tmp_path, "", monkeypatch)
    beginning = asyncio.create_task(recorder.begin())
    await until_it_hangs(tmp_path)
    absent = recorder.absence()
    await end_tasks(beginning)
    try:
        await recorder.end()
    finally:
        assert left(tmp_path) == []
    assert absent is not None, "the start waits for it"
    assert absent.cause == "it does not listen yet"


async def test_one_that_fell_and_whose_next_begin_is_broken_off(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = played(tmp_path, FALLS_ONCE, monkeypatch)
    await recorder.begin()
    keeping = asyncio.create_task(recorder.keep())
    await until_it_hangs(tmp_path)
    await end_tasks(keeping)
    try:
        await recorder.end()
    finally:
        assert left(tmp_path) == []


@pytest.mark.parametrize("words", [WARNS, COUNTS], ids=["a warning", "a progress bar"])
async def test_one_that_prints_something_first_has_begun(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = played(tmp_path, f"{words}; echo records to night.mcap >&2", monkeypatch)
    try:
        await recorder.begin()
        assert recorder.absence() is None
    finally:
        await recorder.end()
        assert left(tmp_path) == []


async def test_one_that_needs_long_to_begin_is_waited_for_and_named_meanwhile(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A recorder on a machine that swapped needed 25 s, and the mission did not come up."""
    monkeypatch.setattr(mission_recorder, "BEGUN_WITHIN_S", 0.1)
    waits = "while ! test -e may; do sleep 0.05; done; echo records to night.mcap >&2"
    recorder, changes = played(tmp_path, waits, monkeypatch), list[str]()
    recorder.on_changed = changes.append
    assert recorder.absence() is not None, "it is named from the first moment on"
    beginning = asyncio.create_task(recorder.begin())
    try:
        await until(lambda: changes != [])
        absent = recorder.absence()
        assert changes == ["waits for its recorder: it has not begun within 0.1 s"]
        assert absent is not None
        assert "kill -9 " in absent.remedy
        assert not beginning.done()
        (tmp_path / "may").touch()
        await beginning
        assert recorder.absence() is None
    finally:
        await end_tasks(beginning)
        await recorder.end()
        assert left(tmp_path) == []


async def test_one_that_is_killed_while_it_is_waited_for_did_not_begin(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mission_recorder, "BEGUN_WITHIN_S", 0.1)
    recorder, changes = played(tmp_path, "", monkeypatch), list[str]()
    recorder.on_changed = changes.append
    beginning = asyncio.create_task(recorder.begin())
    await until(lambda: changes != [])
    left(tmp_path)
    with pytest.raises(RecorderFailed, match="it ended without a word"):
        await beginning


async def test_of_one_that_cannot_begin_the_last_line_is_the_reason(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recorder = played(tmp_path, f"{WARNS}; echo night.mcap cannot be written >&2; exit 5", monkeypatch)
    with pytest.raises(RecorderFailed, match=r"did not begin: night\.mcap cannot be written"):
        await recorder.begin()


@pytest.mark.parametrize("words", [f"{COUNTS}; exit 1", "rm recorder; exit 1"], ids=["long last words", "no program"])
async def test_one_that_falls_and_cannot_begin_again_is_absent_until_it_can(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(mission_recorder, "AGAIN_AFTER_S", 0.05)
    recorder = played(tmp_path, f"{FALLS_FOR_GOOD}; {words}", monkeypatch)
    changes: list[str] = []
    recorder.on_changed = changes.append
    await recorder.begin()
    keeping = asyncio.create_task(recorder.keep())
    try:
        await until(lambda: (absence := recorder.absence()) is not None and "did not begin" in absence.cause)
        played(tmp_path, "echo records to night-2.mcap >&2", monkeypatch)
        await until(lambda: recorder.absence() is None)
        assert changes[-1] == "the recording goes on"
        assert len(changes) == 3, "the log has each cause once"
    finally:
        await end_tasks(keeping)
        await recorder.end()
    assert left(tmp_path) == []


FULL = "test -e full || { touch full; echo records to night.mcap >&2; echo the disc is full >&2; exit 5; }"


class Disc(NamedTuple):
    free: int


async def test_one_whose_disc_is_full_goes_on_when_there_is_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert mission_recorder.ROOM_BYTES > LEAST_FREE_BYTES
    free = [mission_recorder.ROOM_BYTES - 1]
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: Disc(free[0]))
    monkeypatch.setattr(mission_recorder, "ROOM_EACH_S", 0.05)
    recorder = played(tmp_path, f"{FULL}; echo records to night-2.mcap >&2", monkeypatch)
    await recorder.begin()
    keeping = asyncio.create_task(recorder.keep())
    try:
        await until(lambda: recorder.absence() is not None)
        absence = recorder.absence()
        assert absence is not None
        assert (absence.cause, absence.remedy) == ("the disc is full", "Free disc space.")
        free[0] += 1
        await until(lambda: recorder.absence() is None)
    finally:
        await end_tasks(keeping)
        await recorder.end()
    assert left(tmp_path) == []


async def test_one_whose_file_cannot_grow_though_there_is_room_is_absent_for_good(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(shutil, "disk_usage", lambda _path: Disc(mission_recorder.ROOM_BYTES))
    recorder = played(tmp_path, FULL, monkeypatch)
    await recorder.begin()
    await asyncio.wait_for(recorder.keep(), WITHIN_S)
    absence = recorder.absence()
    assert absence is not None
    assert "another file" in absence.remedy


def test_the_recorder_of_another_host_has_the_host_in_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Otherwise health shows only one of two recorders that are absent."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    recorder = recorder_of_host(
        Offered("night", "unixsock-stream/nowhere", "far", record=tmp_path / "far.mcap"), MissionClock.started_now()
    )
    [absent] = absences_of(recorder)
    assert absent.name == "recorder of far"
