"""The file of a mission's names follows the mission, is this user's alone, and is gone when it cannot be written."""

from __future__ import annotations

import asyncio
import errno
import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from backbone import run_files, run_names
from backbone.addresses import RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.launcher.names_keeper import NamesKeeper
from backbone.naming import Subsystem
from backbone.rc_manager.messages import AskSchedule
from backbone.run_files import RunFile
from backbone.run_names import MissionNames
from backbone.scheduling.views import RcView, Schedule
from backbone.waiting import end_tasks

MISSION = "names-test"


@pytest.fixture
def directory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Give the run folder of a mission whose launcher is this process."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    return run_files.write(RunFile(MISSION, "tcp/127.0.0.1:1", os.getpid(), 0.0, 1.0, "base", "none")).parent


def written() -> MissionNames:
    found = run_names.read(MISSION)
    assert found is not None
    return found


def test_the_file_follows_what_comes_and_goes(local_mission: Any, beside: Callable[..., Any], directory: Path) -> None:
    async def scene() -> None:
        clock = VirtualClock()
        async with local_mission(MISSION, clock) as network:
            bus, manager = network.join("backbone/launcher", clock), network.join(RC_MANAGER, clock)
            keeping = asyncio.create_task(NamesKeeper(bus, clock, directory).run(), name="names")
            await clock.sleep_s(2.0)
            assert stat.S_IMODE((directory / run_names.FILE_NAME).stat().st_mode) == 0o600
            launch = Launch(MISSION, Subsystem.MISSION_CONTROL, "watch1", "watch", "x:Y", "base", "", 0.0, 1.0)
            watcher: Component[Any] = Component(launch, network.join(launch.address, clock), clock)
            rc = RcView("scout1", "scout", "up", False, 1.0, [], 0, [], is_robot=True)
            asked: list[float] = []

            async def answer(_asked: Any) -> Schedule:
                asked.append(clock.now_s())
                return Schedule(1.0, [rc], [], [])

            manager.serve(RC_MANAGER, AskSchedule, answer)
            async with beside(watcher):
                await clock.sleep_s(2.0)
                assert {"watch1", "scout1"} <= set(written().all)
                assert (written().robots, written().behaviors) == (["scout1"], ["watch1"])
            await clock.sleep_s(2.0)
            assert written().behaviors == []
            assert len(asked) <= 4, "the RC manager is asked after components came and went, and now and then"
            await end_tasks(keeping)
            await asyncio.gather(bus.close(), manager.close())

    run_virtual(scene())


def test_names_that_cannot_be_written_leave_no_old_ones(directory: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run_names.write(directory, MissionNames(["scout1"]))
    assert run_names.read(None) == MissionNames(["scout1"])

    def full(*_given: object, **_more: object) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(run_names, "replace_file", full)
    with pytest.raises(OSError, match="No space"):
        run_names.write(directory, MissionNames(["scout2"]))
    assert run_names.read(MISSION) is None


@pytest.mark.parametrize("content", [b"", b"[]", b'{"all": 3}'])
def test_a_file_that_cannot_be_read_is_none(directory: Path, content: bytes) -> None:
    (directory / run_names.FILE_NAME).write_bytes(content)
    assert run_names.read(MISSION) is None
