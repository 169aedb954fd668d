"""Latency of a value over its size, by the placement of its two modules: unit, thread, or process of one host.

``unit``: two modules of one execution unit, which pass the object itself. ``thread``: two units of one process, each in
a thread of its own. ``board``: two processes, by the bus with a blackboard. ``network``: two processes, by the bus
through the hub, without shared memory. Beside them, in the same run, the floors: ``queue``, two bare threads and a
queue; ``socket``, a bare unix socket whose receiver reads the whole value; and ``zenoh``, bare zenoh-python through the
same hub. Values between processes alternate between all ways. Prints one JSON line: p50 in microseconds by size and
way, and the ratio of each way to its floor. A value of more than 8 MiB is not sent by the network.

``--plot FILE``, PNG or SVG, draws the line, as Figure 5 of RoboFrame 2006 does: floors are dashed.
"""

from __future__ import annotations

import argparse
import asyncio
import queue
import socket
import struct
import subprocess
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

import msgspec
import uvloop
import zenoh
from bare_hub import bare_hub
from measuring import helper, line_of, percentile, report, wait_for_end_of_input

from backbone.authentication import socket_endpoint
from backbone.bus.clock import MissionClock
from backbone.bus.host_boards import boards_for
from backbone.bus.local_bus import LocalNetwork
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.ranges import Bulk, MachineTime
from backbone.wire import MAX_MESSAGE_BYTES, Message
from mission_control.modules.arrangement import UnitOrder, arranged
from mission_control.modules.module import Module
from mission_control.modules.orders import ModuleOrder
from mission_control.modules.run import connected
from mission_control.modules.unit_component import UnitComponent

MISSION, CLOCK = "bench", MissionClock(0.0)
SIZES = (64, 1_000, 16_000, 76_800, 921_600, 10_000_000)
SENDER, RECEIVER = (address(Subsystem.MISSION_CONTROL, name) for name in ("sender", "receiver"))
WARM_UP = 10  # values of each way before the measurement, in which connections are set up
BARE_KEY = "bare/values"
HEAD = struct.Struct("<Qd")
PAUSE_S, PAUSE_A_BYTE_S = 0.004, 3e-9  # chosen: no value waits for the preceding one
READY_S = 30.0
ARRIVES_WITHIN_S = 0.5  # chosen: so long after the last value was sent, none is on its way any more
THREADS_HZ = 200.0  # chosen: no value waits for the preceding one
FLOORS = {"thread": "queue", "board": "socket", "network": "zenoh"}
LATENCIES_S: list[float] = []
"""Latencies that the sink of this process measured."""


class Large(Message, frozen=True):
    """A value with the time at which it was made, on the clock that all processes of a machine share."""

    made_s: MachineTime
    data: Bulk


class Source(Module):
    """Makes a value in each round."""

    class Outputs(Module.Outputs):
        """The value."""

        value: Large

    class Parameters(Module.Parameters, frozen=True):
        """Size of the value, in bytes."""

        size: int

    parameters: Parameters

    def reset(self) -> None:
        """Make new data."""
        self.data = memoryview(bytes(self.parameters.size))

    def update(self, _inputs: Module.Inputs) -> Outputs:
        """Make it."""
        return self.Outputs(Large(time.monotonic(), self.data))


class Sink(Module):
    """Receives values and records their ages."""

    class Inputs(Module.Inputs):
        """The value."""

        value: Large

    def reset(self) -> None:
        """Forget all ages."""
        LATENCIES_S.clear()

    def update(self, inputs: Inputs) -> Module.Outputs:
        """Record the age of a value."""
        LATENCIES_S.append(time.monotonic() - inputs.value.made_s)
        return self.Outputs()


class FreeUnit(UnitComponent):
    """A unit without a nameserver."""

    registers = False


def in_one_unit(size: int, values: int) -> list[float]:
    """Return the latencies between two modules of one unit."""
    units = connected(Source(Source.Parameters(size)), Sink(), frequency_hz=1000.0)
    for number in range(values):
        units.tick(number / 1000)
    return list(LATENCIES_S)


async def between_threads(size: int, values: int) -> list[float]:
    """Return the latencies between two units of this process, each in a thread of its own."""
    clock, network = MissionClock.started_now(), LocalNetwork()
    modules = {
        "sink": ModuleOrder("sink", f"{__name__}:Sink"),
        "source": ModuleOrder("source", f"{__name__}:Source", {"size": size}),
    }
    orders = [
        UnitOrder(name=name, own_thread=True, frequency_hz=THREADS_HZ if name == "source" else 0.0, modules=[one])
        for name, one in modules.items()
    ]
    units: list[FreeUnit] = []
    for name, parameters in arranged(orders, {}).items():
        given = msgspec.to_builtins(parameters)
        launch = Launch(MISSION, Subsystem.MISSION_CONTROL, name, "unit", "", "here", "", 0.0, 1.0, given)
        units.append(FreeUnit(launch, network.join(launch.address, clock), clock))
    lives = [asyncio.create_task(unit.run()) for unit in units]
    ends_s = clock.now_s() + READY_S + values / THREADS_HZ
    while len(LATENCIES_S) < values and clock.now_s() < ends_s:
        await clock.sleep_s(0.05)
    for unit in units:
        unit.end("measured")
    await asyncio.gather(*lives)
    return LATENCIES_S[:values]


def between_bare_threads(size: int, values: int) -> list[float]:
    """Return the latencies of an object passed from one thread to another by a queue."""
    handed: queue.SimpleQueue[tuple[float, bytes] | None] = queue.SimpleQueue()
    found: list[float] = []

    def take() -> None:
        while (came := handed.get()) is not None:
            found.append(time.monotonic() - came[0])

    taker, data = threading.Thread(target=take), bytes(size)
    taker.start()
    for _ in range(values):
        handed.put((time.monotonic(), data))
        time.sleep(1 / THREADS_HZ)
    handed.put(None)
    taker.join()
    return found


def place(way: str, size: int) -> str:
    """Return the address of the values of a way and size."""
    return f"{SENDER}/{way}-{size}"


Say = Callable[[], None]


def ways_to_say(raw: socket.socket, bare: zenoh.Session, near: ZenohBus, far: ZenohBus, size: int) -> list[Say]:
    """Return, for each way, a function that sends a value of this size."""
    data = bytes(size)
    publisher = bare.declare_publisher(f"{BARE_KEY}/{size}")

    def on_bus(bus: ZenohBus, way: str) -> Say:
        at, view = place(way, size), memoryview(data)
        return lambda: bus.publish(at, Conversation.OUTPUTS, Large(time.monotonic(), view))

    ways: list[Say] = [
        lambda: raw.sendall(HEAD.pack(size, time.monotonic()) + data),
        lambda: publisher.put(HEAD.pack(size, time.monotonic()) + data),
        on_bus(near, "board"),
    ]
    return ways if size > MAX_MESSAGE_BYTES else [*ways, on_bus(far, "network")]


async def send(folder: str, values: int) -> None:
    """Run as the sending process."""
    endpoint = socket_endpoint(Path(folder))
    near = ZenohBus.open(MISSION, SENDER, CLOCK, client_config(endpoint))
    near.boards = boards_for(folder)
    far = ZenohBus.open(MISSION, f"{SENDER}-far", CLOCK, client_config(endpoint))
    ready = asyncio.Event()
    near.watch_alive(RECEIVER, lambda _address, alive: ready.set() if alive else None)
    await asyncio.wait_for(ready.wait(), READY_S)
    with zenoh.open(client_config(endpoint)) as bare, socket.socket(socket.AF_UNIX) as raw:
        raw.connect(f"{folder}/raw")
        for size in SIZES:
            ways = ways_to_say(raw, bare, near, far, size)
            for _ in range(values + WARM_UP):
                for say in ways:
                    say()
                    await CLOCK.sleep_s(PAUSE_S + size * PAUSE_A_BYTE_S)
        await CLOCK.sleep_s(ARRIVES_WITHIN_S)
    await near.close()
    await far.close()


def be_hub(folder: str) -> None:
    """Run as the hub process."""
    with bare_hub(hub_config([socket_endpoint(Path(folder))])):
        print("ready", flush=True)
        wait_for_end_of_input()


class Latencies:
    """Ages of values at their arrival, by way and size."""

    def __init__(self) -> None:
        self.by_way: dict[str, dict[int, list[float]]] = defaultdict(lambda: defaultdict(list))

    def note(self, way: str, size: int, made_s: float) -> None:
        """Record a value that arrives now."""
        self.by_way[way][size].append(time.monotonic() - made_s)

    def report(self, values: int) -> dict[str, dict[int, float]]:
        """Print the line; return way → size → p50 in microseconds."""
        told = {way: {size: of[WARM_UP:] for size, of in by_size.items()} for way, by_size in self.by_way.items()}
        p50 = {
            way: {size: round(percentile(of, 0.5) * 1e6, 1) for size, of in by_size.items() if of}
            for way, by_size in told.items()
        }
        report(
            "placements",
            values=values,
            p50_us=p50,
            arrived={
                way: {size: round(len(of) / values, 2) for size, of in by_size.items()} for way, by_size in told.items()
            },
            ratio={
                way: {size: round(each / p50[floor][size], 2) for size, each in p50[way].items() if size in p50[floor]}
                for way, floor in FLOORS.items()
            },
        )
        return p50


async def measure(folder: str, values: int, sender: subprocess.Popen[bytes]) -> dict[str, dict[int, float]]:
    """Run as the receiving process, and report; return way → size → p50 in microseconds."""
    latencies, endpoint = Latencies(), socket_endpoint(Path(folder))
    loop = asyncio.get_running_loop()

    async def read(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                size, made_s = HEAD.unpack(await reader.readexactly(HEAD.size))
                await reader.readexactly(size)
                latencies.note("socket", size, made_s)
        except (asyncio.IncompleteReadError, asyncio.CancelledError):
            writer.close()  # if a stream's handler is cancelled, asyncio prints that as a bug

    def arrived(sample: zenoh.Sample) -> None:
        latencies.note("zenoh", *HEAD.unpack_from(sample.payload.to_bytes()))

    def listen(way: str, size: int) -> None:
        bus.subscribe(
            place(way, size),
            Conversation.OUTPUTS,
            Large,
            lambda one: latencies.note(way, len(one.body.data), one.body.made_s),
            latest=True,
        )

    server = await asyncio.start_unix_server(read, f"{folder}/raw", limit=max(SIZES))
    bus = ZenohBus.open(MISSION, RECEIVER, CLOCK, client_config(endpoint))
    bus.boards = boards_for(folder)
    with zenoh.open(client_config(endpoint)) as bare:
        for size in SIZES:
            bare.declare_subscriber(f"{BARE_KEY}/{size}", lambda sample: loop.call_soon_threadsafe(arrived, sample))
            listen("board", size)
            listen("network", size)
        bus.declare_alive(RECEIVER)
        assert await loop.run_in_executor(None, sender.wait) == 0
    await bus.close()
    server.close()
    for size in SIZES:
        latencies.by_way["unit"][size] = in_one_unit(size, values + WARM_UP)
        latencies.by_way["thread"][size] = await between_threads(size, values + WARM_UP)
        latencies.by_way["queue"][size] = between_bare_threads(size, values + WARM_UP)
    return latencies.report(values)


def main() -> None:
    """Run the role named first, or all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("role", nargs="?", default="all", choices=["all", "hub", "sender"])
    parser.add_argument("folder", nargs="?", default="")
    parser.add_argument("--values", type=int, default=100, help="of each size and way")
    parser.add_argument(
        "--plot", type=Path, metavar="FILE", help="also draw the line, PNG or SVG; needs the extra 'plot'"
    )
    chosen = parser.parse_args()
    if chosen.plot is not None and chosen.plot.suffix not in (".png", ".svg"):
        parser.error(f"{chosen.plot} ends neither with .png nor with .svg")
    if chosen.role == "hub":
        be_hub(chosen.folder)
    elif chosen.role == "sender":
        uvloop.run(send(chosen.folder, chosen.values))
    else:
        plot = import_module("placements_plot") if chosen.plot is not None else None  # before it measures for minutes
        with tempfile.TemporaryDirectory(prefix="s-") as folder, helper(__file__, "hub", folder, answers=True) as hub:
            assert line_of(hub) == "ready"
            with helper(__file__, "sender", folder, "--values", str(chosen.values)) as sender:
                p50 = uvloop.run(measure(folder, chosen.values, sender))
        if plot is not None:
            plot.draw(p50, FLOORS, chosen.plot)


if __name__ == "__main__":
    main()
