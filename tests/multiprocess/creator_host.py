"""One host with a real hub, nameserver and creator, for tests; and a launcher of the same to be killed."""

from __future__ import annotations

import asyncio
import os
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec
import psutil
import uvloop
from free_ports import free_endpoint

from backbone.addresses import PLACER
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.launch import Launch
from backbone.component_database.messages import ComponentType
from backbone.creator import process_table
from backbone.creator.messages import (
    EndProcess,
    ListProcesses,
    ProcessEnded,
    Processes,
    ProcessFell,
    ProcessState,
    RestartPolicy,
    Spawn,
    Spawned,
)
from backbone.creator.process_keeper import ProcessKeeper
from backbone.creator.zygote import Zygote
from backbone.keys import Conversation
from backbone.naming import Subsystem

CREATOR = "backbone/creator-lab"
KINDS = ("Quiet", "Parent", "Stubborn", "Late", "Blocked", "Broken", "Stumbling", "Leaver", "Missing")
TYPES = [ComponentType(kind.lower(), f"sample_components:{kind}", Subsystem.RESOURCE_POOL) for kind in KINDS]
CORE_POLICY = RestartPolicy(back_off_s=0.02, limit=20, window_s=60.0)
POLICY = RestartPolicy(back_off_s=0.05, limit=2, window_s=60.0)


@dataclass
class CreatorHost:
    """What a test sees of the host: the launcher's keeper and zygote, and the placer's bus."""

    directory: Path
    zygote: Zygote
    keeper: ProcessKeeper
    bus: ZenohBus
    fell: list[ProcessFell] = field(default_factory=list)

    async def spawn(self, kind: str, name: str, **more: Any) -> Spawned:
        order = Spawn(
            Subsystem.RESOURCE_POOL,
            name,
            kind.lower(),
            f"sample_components:{kind}",
            **{"policy": POLICY, "ready_within_s": 10.0, **more},
        )
        return await self.bus.ask(CREATOR, order, Spawned, within_s=15.0)

    async def end(self, name: str) -> ProcessEnded:
        return await self.bus.ask(CREATOR, EndProcess(name, "over", 0.5, 0.3), ProcessEnded, within_s=10.0)

    async def processes(self) -> dict[str, ProcessState]:
        listing = await self.bus.ask(CREATOR, ListProcesses(), Processes, within_s=5.0)
        return {process.spawn.name: process for process in listing.processes}

    async def process(self, name: str) -> ProcessState:
        return (await self.processes())[name]

    def core(self, name: str) -> int:
        """Return the pid of a core service, 0 while it waits for its restart."""
        return {process.spawn.name: process.pid for process in self.keeper.processes()}[name]

    def creators_zygote(self) -> int:
        return next(iter(process_table.zygotes_of(process_table.read_table(), self.core("creator-lab"))))

    def story(self) -> str:
        """Return the ends of all logs, for failure messages."""
        logs = sorted(self.directory.glob("log/*.log"))
        return "\n".join(
            line for log in logs for line in (f"--- {log.name}", *log.read_text(errors="replace").splitlines()[-15:])
        )


def below(pid: int) -> list[psutil.Process]:
    """Return all descendants of a process."""
    return psutil.Process(pid).children(recursive=True)


def left_of(processes: list[psutil.Process], within_s: float) -> list[psutil.Process]:
    """Return those that still run after at most this time."""
    return [each for each in psutil.wait_procs(processes, timeout=within_s)[1] if each.status() != "zombie"]


@asynccontextmanager
async def creator_host(directory: Path) -> AsyncIterator[CreatorHost]:
    """Give a host whose creator is ready; everything of it is ended afterwards."""
    clock = MissionClock.started_now()
    hub = Launch(
        "creators",
        Subsystem.BACKBONE,
        "nameserver",
        "nameserver",
        "backbone.nameserver.service:Nameserver",
        "lab",
        free_endpoint(),
        clock.origin_monotonic_s,
        1.0,
        run_directory=str(directory),
    )
    creator = msgspec.structs.replace(
        hub,
        name="creator-lab",
        type="creator",
        class_path="backbone.creator.service:Creator",
        parameters={"types": [msgspec.to_builtins(one) for one in TYPES]},
    )
    zygote = await Zygote.spawn_fresh(run_directory=str(directory))
    keeper = ProcessKeeper(zygote)
    try:
        await keeper.start_hub(hub, CORE_POLICY)
        bus = await ZenohBus.open_when_up("creators", PLACER, clock, client_config(hub.endpoint))
        try:
            keeper.use(bus)
            await keeper.wait_ready("nameserver", 20.0)
            await keeper.start(creator, CORE_POLICY, 20.0)
            host = CreatorHost(directory, zygote, keeper, bus)
            bus.subscribe(CREATOR, Conversation.EVENTS, ProcessFell, lambda heard: host.fell.append(heard.body))
            yield host
            await keeper.end("creator-lab", "the test is over")
        finally:
            await bus.close()
    finally:
        await keeper.close()
        await zygote.close()


async def _launcher(directory: Path) -> None:
    async with creator_host(directory) as host:
        await host.spawn("Quiet", "scout1")
        await host.spawn("Parent", "scout2")
        await host.spawn("Stubborn", "scout3")
        print("all ready", os.getpid(), flush=True)
        await asyncio.get_running_loop().create_future()


if __name__ == "__main__":
    uvloop.run(_launcher(Path(sys.argv[1])))
