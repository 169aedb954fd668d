"""People at consoles beside a running mission, each console in this process on a bus of its own."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from typing import Any

from running_mission import RunningMission, runtime_directory

from backbone import run_files
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.launch import Launch
from backbone.component.peer_monitor import PeerMonitor
from backbone.naming import Subsystem
from ui_console.model.driving import DriveWish
from ui_console.model.events import Asked, CommandApplied, ConsoleEvent, GivenBack, Granted, said
from ui_console.session.teleoperation import Teleoperation

WAIT_S = 10.0


class Console:
    """A person at a console."""

    def __init__(
        self,
        name: str,
        priority: int,
        robot: str,
        minimum_runtime_s: float,
        found: run_files.RunFile,
        clock: MissionClock,
        kind: str = "drive",
    ) -> None:
        self.name, self.clock, self.events = name, clock, list[ConsoleEvent]()
        self.launch = Launch(
            found.mission,
            Subsystem.UI_CONSOLE,
            name,
            "console",
            "ui_console.session.teleoperation:Teleoperation",
            found.host,
            found.endpoint,
            found.clock_origin_monotonic_s,
            found.clock_rate,
            {"robot": robot, "kind": kind, "priority": priority, "minimum_runtime_s": minimum_runtime_s},
        )
        self.component: Teleoperation | None = None
        self.heard = asyncio.Event()

    def show(self, event: ConsoleEvent) -> None:
        self.events.append(event)
        self.heard.set()

    async def hears(self, mark: int, kind: type[Any]) -> Any:
        """Return the first event of this kind after the mark."""
        async with asyncio.timeout(WAIT_S):
            while not (found := self.since(mark, kind)):
                self.heard.clear()
                await self.heard.wait()
        return found[0]

    def since(self, mark: int, kind: type[Any]) -> list[Any]:
        return [one for one in map(said, self.events[mark:]) if isinstance(one, kind)]

    async def take_and_drive(self, drive: DriveWish) -> float:
        """Return how long it took from the wish to the first command applied."""
        console = self.component
        assert console is not None
        mark = len(self.events)
        console.take()
        async with asyncio.timeout(WAIT_S):
            await console.wait_granted()
            assert await console.do(drive), self.events[mark:]
        [asked], [applied] = self.since(mark, Asked), self.since(mark, CommandApplied)[:1]
        assert isinstance(self.since(mark, Granted)[0], Granted)
        return float(applied.at_s - asked.at_s)

    async def give_back(self, *, for_good: bool = False) -> float:
        """Return when it began to give the robot back."""
        assert self.component is not None
        mark, began_s = len(self.events), self.clock.now_s()
        await self.component.give_back(for_good=for_good)
        assert self.since(mark, GivenBack)[0].confirmed
        return began_s

    def run(self, bus: Bus) -> asyncio.Task[None]:
        self.component = Teleoperation(
            self.launch, bus, self.clock, show=self.show, takes=False, watches=False, keeps_arc=True
        )
        return asyncio.create_task(self.component.run(), name=self.name)


@asynccontextmanager
async def consoles_at_work(
    mission: RunningMission,
    bus: Bus,
    robot: str,
    people: Sequence[tuple[str, int]],
    minimum_runtime_s: float = 0.1,
    kind: str = "drive",
) -> AsyncIterator[list[Console]]:
    """Have consoles ready that claim nothing yet.

    Args:
        mission: Up.
        bus: Of the onlooker.
        robot: What all of them want.
        people: Name and priority of each.
        minimum_runtime_s: Of each claim.
        kind: ARC kind of each claim.
    """
    with runtime_directory(mission.environment["XDG_RUNTIME_DIR"]):
        found = run_files.find(mission.name)
    clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)
    consoles = [Console(name, priority, robot, minimum_runtime_s, found, clock, kind) for name, priority in people]
    lives = []
    for console in consoles:
        own = await ZenohBus.open_when_up(mission.name, console.launch.address, clock, client_config(found.endpoint))
        lives.append(console.run(own))
    for console in consoles:
        monitor = PeerMonitor(bus, console.launch.address)
        await monitor.wait_there()
        monitor.close()
    try:
        yield consoles
    finally:
        for console in consoles:
            assert console.component is not None
            console.component.end("the test is over")
        await asyncio.gather(*lives)
