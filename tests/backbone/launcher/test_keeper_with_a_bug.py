"""A bug of the launcher's process keeper ends the mission, with its reason; nothing waits for it."""

from __future__ import annotations

import asyncio
import signal
from collections.abc import Callable
from typing import Any

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.component.launch import Launch
from backbone.creator.process_keeper import ProcessKeeper
from backbone.launcher.core_launches import UpOptions
from backbone.launcher.launcher import Launcher
from backbone.mission.reader import read_mission_bytes
from backbone.naming import Subsystem

MISSION = read_mission_bytes(b'<mission name="m" priority="10"/>', "m.xml")
HERE = MISSION.hosts[0].name
LAUNCHER = Launch("local", Subsystem.BACKBONE, "launcher", "launcher", "", HERE, "", 0.0, 1.0)


class ZygoteWithABug:
    """Fails at each order."""

    on_exit: Callable[[int, int], None]
    on_lost: Callable[[], None]

    async def fork(self, launch: Launch) -> int:
        raise ValueError(f"bug at {launch.name}")

    def kill(self, pid: int, number: signal.Signals) -> None: ...

    def keep_running(self) -> str:
        return ""

    def busy_s(self) -> float:
        return 0.0

    async def close(self) -> None: ...


class Nobody:
    def __getattr__(self, name: str) -> Callable[..., None]:
        return lambda *_arguments: None


def test_the_launcher_fails_by_the_bug(local_mission: Callable[..., Any]) -> None:
    async def main() -> None:
        async with local_mission() as network:
            clock = VirtualClock()
            keeper = ProcessKeeper(ZygoteWithABug(), clock)
            launcher = Launcher(
                LAUNCHER,
                network.join(LAUNCHER.address, clock),
                clock,
                keeper=keeper,
                description=MISSION,
                options=UpOptions(),
                observer=Nobody(),
                began_s=0.0,
            )
            async with asyncio.timeout(60):
                with pytest.raises(ValueError, match="bug at component_database"):
                    await launcher.run()
                await keeper.close()

    run_virtual(main())
