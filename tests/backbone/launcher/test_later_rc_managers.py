"""The launcher starts a later RC manager with the parameters that the present one sent, and takes none from others."""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from typing import Any, cast

import pytest
from up_watcher import UpWatcher

from backbone.addresses import PLACER, RC_MANAGER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.creator.messages import EndedBy, NotThePlacer, ProcessEnded, ReviseSpawn, SpawnRevised
from backbone.creator.process_keeper import ProcessKeeper
from backbone.launcher.core_launches import UpOptions
from backbone.launcher.launcher import Launcher
from backbone.mission.reader import read_mission_bytes
from backbone.naming import Subsystem

MISSION = read_mission_bytes(b'<mission name="m" priority="10"/>', "m.xml")
HERE = MISSION.hosts[0].name
LAUNCHER = Launch("local", Subsystem.BACKBONE, "launcher", "launcher", "", HERE, "", 0.0, 1.0)
REVISED = ReviseSpawn("rc_manager", {"tree": {}})


class KeeperOfOrders:
    """Core services that begin and end at once."""

    def __init__(self) -> None:
        self.revised: list[ReviseSpawn] = []

    on_fell = on_silent = on_changed = on_bug = None

    async def start(self, *_given: object) -> None: ...

    async def end(self, name: str, _reason: str) -> ProcessEnded:
        return ProcessEnded(name, EndedBy.ASKING, 0)

    def absences(self) -> list[object]:
        return []

    def processes(self) -> list[object]:
        return []

    def revise(self, revised: ReviseSpawn) -> None:
        self.revised.append(revised)


def test_only_the_rc_manager_changes_its_next_start(local_mission: Callable[..., Any]) -> None:
    async def main() -> None:
        async with local_mission() as network:
            clock, keeper, watcher = VirtualClock(), KeeperOfOrders(), UpWatcher()
            launcher = Launcher(
                LAUNCHER,
                network.join(LAUNCHER.address, clock),
                clock,
                keeper=cast("ProcessKeeper", keeper),
                description=MISSION,
                options=UpOptions(),
                observer=watcher,
                began_s=0.0,
            )
            running = asyncio.create_task(launcher.run())
            await watcher.is_up.wait()
            rc_manager, placer = network.join(RC_MANAGER, clock), network.join(PLACER, clock)
            await rc_manager.ask(LAUNCHER.address, REVISED, SpawnRevised, within_s=1.0)
            with pytest.raises(NotThePlacer):
                await rc_manager.ask(LAUNCHER.address, ReviseSpawn("placer", {}), SpawnRevised, within_s=1.0)
            with pytest.raises(NotThePlacer):
                await placer.ask(LAUNCHER.address, REVISED, SpawnRevised, within_s=1.0)
            assert keeper.revised == [REVISED]
            launcher.end("test", at_once=True)
            await running

    run_virtual(main())
