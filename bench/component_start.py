"""From the order to all ready: 20 light components started by one creator, beside bare process starts.

Prints one JSON line. Hub, nameserver and creator are real; the components are started all at once, as the placer starts
them. Floors, measured in the same run: a bare zygote (imports done, no bus) that forks 20 children, which answer with
one byte on a pipe; and 20 bare interpreters (``python -c pass``), two at a time.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import tempfile
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from statistics import median
from time import perf_counter

import msgspec
import uvloop
from measuring import bare_interpreters_s, free_endpoint, report

from backbone.addresses import PLACER
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.launch import Launch
from backbone.component_database.messages import ComponentType
from backbone.creator.messages import EndProcess, ProcessEnded, RestartPolicy, Spawn, Spawned
from backbone.creator.process_keeper import ProcessKeeper
from backbone.creator.zygote import Zygote
from backbone.naming import Subsystem

COMPONENTS = 20
CREATOR = "backbone/creator-bench"
LIGHT = ComponentType("light", "light_component:Light", Subsystem.RESOURCE_POOL)


@asynccontextmanager
async def creator_up(folder: str) -> AsyncIterator[ZenohBus]:
    """Run a host with nameserver and creator, and yield the placer's bus."""
    clock = MissionClock.started_now()
    hub = Launch(
        "bench",
        Subsystem.BACKBONE,
        "nameserver",
        "nameserver",
        "backbone.nameserver.service:Nameserver",
        "bench",
        free_endpoint(),
        clock.origin_monotonic_s,
        1.0,
        run_directory=str(Path(folder) / "run"),
    )
    creator = msgspec.structs.replace(
        hub,
        name="creator-bench",
        type="creator",
        class_path="backbone.creator.service:Creator",
        parameters={"types": [msgspec.to_builtins(LIGHT)]},
    )
    zygote = await Zygote.spawn_fresh(run_directory=hub.run_directory)
    keeper = ProcessKeeper(zygote)
    try:
        await keeper.start_hub(hub, RestartPolicy())
        bus = await ZenohBus.open_when_up("bench", PLACER, clock, client_config(hub.endpoint))
        try:
            keeper.use(bus)
            await keeper.wait_ready(hub.name, 20.0)
            await keeper.start(creator, RestartPolicy(), 20.0)
            yield bus
            await keeper.end(creator.name)
        finally:
            await bus.close()
    finally:
        await keeper.close()
        await zygote.close()


async def start_light(bus: ZenohBus, count: int) -> list[Spawned]:
    """Start so many components at once and return when all are ready."""
    orders = [
        Spawn(Subsystem.RESOURCE_POOL, f"light-{number}", "light", "light_component:Light") for number in range(count)
    ]
    return await asyncio.gather(*(bus.ask(CREATOR, order, Spawned, within_s=30.0) for order in orders))


async def end_light(bus: ZenohBus, count: int) -> None:
    """End them again."""
    ends = (bus.ask(CREATOR, EndProcess(f"light-{n}"), ProcessEnded, within_s=10.0) for n in range(count))
    await asyncio.gather(*ends)


async def timed_start(bus: ZenohBus, count: int) -> float:
    """Return the seconds from the order to all ready."""
    began_s = perf_counter()
    await start_light(bus, count)
    took_s = perf_counter() - began_s
    await end_light(bus, count)
    return took_s


def bare_forks() -> float:
    """Return the seconds in which a process with all imports forks 20 children and gets a byte from each."""
    began_s = perf_counter()
    heard, said = os.pipe()
    pids = []
    for _ in range(COMPONENTS):
        pid = os.fork()
        if pid == 0:
            os.write(said, b".")
            os._exit(0)
        pids.append(pid)
    count = 0
    while count < COMPONENTS:
        count += len(os.read(heard, COMPONENTS))
    took_s = perf_counter() - began_s
    for pid in pids:
        os.waitpid(pid, 0)
    os.close(heard)
    os.close(said)
    return took_s


async def measure(rounds: int) -> tuple[list[float], list[float]]:
    """Return the seconds for 20 components and for one, of each round."""
    with tempfile.TemporaryDirectory() as folder:
        async with creator_up(folder) as bus:
            await timed_start(bus, 1)
            many = [await timed_start(bus, COMPONENTS) for _ in range(rounds)]
            one = [await timed_start(bus, 1) for _ in range(rounds)]
    return many, one


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    rounds = parser.parse_args().rounds
    forks = [bare_forks() for _ in range(rounds)]  # first: later this process has threads
    interpreters = [bare_interpreters_s(COMPONENTS) for _ in range(rounds)]
    many, one = uvloop.run(measure(rounds))
    report(
        "component_start",
        rounds=rounds,
        components=COMPONENTS,
        all_ready_s=round(median(many), 3),
        slowest_s=round(max(many), 3),
        one_ready_s=round(median(one), 4),
        floor=f"{COMPONENTS} bare forks / {COMPONENTS} bare interpreters, two at a time",
        floor_forks_s=round(median(forks), 3),
        floor_interpreters_s=round(median(interpreters), 3),
        ratio_to_interpreters=round(median(many) / median(interpreters), 2),
    )


if __name__ == "__main__":
    main()
