"""Latency of a value over its size, by where its two modules are: in one unit, or in two processes of one host.

``unit``: two modules of one execution unit, which hand over the object itself. ``board``: two processes, by the bus
with a blackboard. ``network``: two processes, by the bus through the hub, without shared memory. Beside them, in the
same run: ``socket``, a bare unix socket whose receiver reads the whole value, and ``zenoh``, bare zenoh-python through
the same hub. Values of all ways alternate. Prints one JSON line: p50 in microseconds by size and way, and the ratio of
the bus to the floor of its way. A value of more than 8 MiB does not go by the network.
"""

from __future__ import annotations

import argparse
import asyncio
import socket
import struct
import tempfile
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import uvloop
import zenoh
from measuring import helper, percentile, report, summary, wait_for_end_of_input

from backbone.authentication import socket_endpoint
from backbone.bus.clock import MissionClock
from backbone.bus.host_boards import boards_for
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.keys import Conversation
from backbone.naming import Subsystem, address
from backbone.ranges import Bulk, MachineTime
from backbone.wire import MAX_MESSAGE_BYTES, Message
from mission_control.modules.module import Module
from mission_control.modules.run import connected

MISSION, CLOCK = "bench", MissionClock(0.0)
SIZES = (64, 1_000, 16_000, 76_800, 921_600, 10_000_000)
SENDER, RECEIVER = (address(Subsystem.MISSION_CONTROL, name) for name in ("sender", "receiver"))
WARM_UP = 10  # values of each way, in which the bus finds its way
BARE_KEY, OVER_KEY = "bare/values", "bare/over"
HEAD = struct.Struct("<Qd")
PAUSE_S, PAUSE_A_BYTE_S = 0.004, 3e-9  # chosen: no value waits for the one before it
READY_S = 30.0


class Large(Message, frozen=True):
    """A value that says when it was made, on the clock that all processes of a machine share."""

    made_s: MachineTime
    data: Bulk


class Source(Module):
    """Makes a value in each round."""

    class Outputs(Module.Outputs):
        """The value."""

        value: Large

    data = memoryview(b"")

    def update(self, _inputs: Module.Inputs) -> Outputs:
        """Make it."""
        return self.Outputs(Large(time.monotonic(), self.data))


class Sink(Module):
    """Takes values and notes how old they are."""

    class Inputs(Module.Inputs):
        """The value."""

        value: Large

    def reset(self) -> None:
        """Forget."""
        self.latencies_s: list[float] = []

    def update(self, inputs: Inputs) -> Module.Outputs:
        """Note one."""
        self.latencies_s.append(time.monotonic() - inputs.value.made_s)
        return self.Outputs()


def in_one_unit(size: int, values: int) -> list[float]:
    """Return the latencies between two modules of one unit."""
    source, sink = Source(), Sink()
    source.data = memoryview(bytes(size))
    units = connected(source, sink, frequency_hz=1000.0)
    for number in range(values):
        units.tick(number / 1000)
    return sink.latencies_s


def place(way: str, size: int) -> str:
    """Return the address of the values of a way and size."""
    return f"{SENDER}/{way}-{size}"


async def send(folder: str, values: int) -> None:
    """Be the sending process."""
    endpoint = socket_endpoint(Path(folder))
    near = ZenohBus.open(MISSION, SENDER, CLOCK, client_config(endpoint))
    near.boards = boards_for(folder)
    far = ZenohBus.open(MISSION, f"{SENDER}-far", CLOCK, client_config(endpoint))
    bare = zenoh.open(client_config(endpoint))
    ready = asyncio.Event()
    near.watch_alive(RECEIVER, lambda _address, alive: ready.set() if alive else None)
    await asyncio.wait_for(ready.wait(), READY_S)
    raw = socket.socket(socket.AF_UNIX)
    raw.connect(f"{folder}/raw")
    for size in SIZES:
        data = bytes(size)
        view, publisher = memoryview(data), bare.declare_publisher(f"{BARE_KEY}/{size}")

        def by_socket(data: bytes = data, size: int = size) -> None:
            raw.sendall(HEAD.pack(size, time.monotonic()) + data)

        def by_zenoh(data: bytes = data, size: int = size, publisher: zenoh.Publisher = publisher) -> None:
            publisher.put(HEAD.pack(size, time.monotonic()) + data)

        ways: list[Callable[[], None]] = [by_socket, by_zenoh]
        for way, bus in (("board", near), ("network", far)):
            if way == "board" or size < MAX_MESSAGE_BYTES:
                at = place(way, size)
                ways.append(
                    lambda bus=bus, at=at, view=view: bus.publish(  # type: ignore[misc]
                        at, Conversation.OUTPUTS, Large(time.monotonic(), view)
                    )
                )
        for _ in range(values + WARM_UP):
            for say in ways:
                say()
                await CLOCK.sleep_s(PAUSE_S + size * PAUSE_A_BYTE_S)
    await CLOCK.sleep_s(0.5)
    bare.put(OVER_KEY, b"", congestion_control=zenoh.CongestionControl.BLOCK)
    await asyncio.get_running_loop().run_in_executor(None, wait_for_end_of_input)
    raw.close()
    for bus in (near, far):
        await bus.close()
    bare.close()


def be_hub(folder: str) -> None:
    """Be the hub process."""
    with zenoh.open(hub_config([socket_endpoint(Path(folder))])):
        wait_for_end_of_input()


async def measure(folder: str, values: int) -> None:
    """Be the receiving process, and report."""
    latencies: dict[tuple[str, int], list[float]] = defaultdict(list)
    endpoint, loop, over = socket_endpoint(Path(folder)), asyncio.get_running_loop(), asyncio.Event()

    def note(way: str, size: int, made_s: float) -> None:
        latencies[way, size].append(time.monotonic() - made_s)

    async def read(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        try:
            while True:
                size, made_s = HEAD.unpack(await reader.readexactly(HEAD.size))
                await reader.readexactly(size)
                note("socket", size, made_s)
        except (asyncio.IncompleteReadError, asyncio.CancelledError):
            writer.close()  # asyncio prints a stream's handler that is cancelled as a bug

    def arrived(sample: zenoh.Sample) -> None:
        note("zenoh", *HEAD.unpack_from(sample.payload.to_bytes()))

    server = await asyncio.start_unix_server(read, f"{folder}/raw", limit=max(SIZES))
    bus = ZenohBus.open(MISSION, RECEIVER, CLOCK, client_config(endpoint))
    bus.boards = boards_for(folder)
    bare = zenoh.open(client_config(endpoint))
    for size in SIZES:
        bare.declare_subscriber(f"{BARE_KEY}/{size}", lambda sample: loop.call_soon_threadsafe(arrived, sample))
        for way in ("board", "network"):
            bus.subscribe(
                place(way, size),
                Conversation.OUTPUTS,
                Large,
                lambda one, way=way: note(way, len(one.body.data), one.body.made_s),  # type: ignore[misc]
                latest=True,
            )
    bare.declare_subscriber(OVER_KEY, lambda _sample: loop.call_soon_threadsafe(over.set))
    bus.declare_alive(RECEIVER)
    await over.wait()
    for size in SIZES:
        latencies["unit", size] = in_one_unit(size, values + WARM_UP)
    told = {
        way: {size: of[WARM_UP:] for (named, size), of in latencies.items() if named == way} for way, _ in latencies
    }
    p50_us = {way: {size: summary(of)["p50_us"] for size, of in by_size.items() if of} for way, by_size in told.items()}
    floors = (("board", "socket"), ("network", "zenoh"))
    report(
        "placements",
        values=values,
        p50_us=p50_us,
        arrived={
            way: {size: round(len(of) / values, 2) for size, of in by_size.items()} for way, by_size in told.items()
        },
        ratio={
            way: {
                size: round(percentile(of, 0.5) / percentile(told[floor][size], 0.5), 2)
                for size, of in told[way].items()
                if of and told[floor].get(size)
            }
            for way, floor in floors
        },
    )
    await bus.close()
    bare.close()
    server.close()


def main() -> None:
    """Run the role named first, or all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("role", nargs="?", default="all", choices=["all", "hub", "sender"])
    parser.add_argument("folder", nargs="?", default="")
    parser.add_argument("--values", type=int, default=100, help="of each size and way")
    chosen = parser.parse_args()
    if chosen.role == "hub":
        be_hub(chosen.folder)
    elif chosen.role == "sender":
        uvloop.run(send(chosen.folder, chosen.values))
    else:
        with tempfile.TemporaryDirectory(prefix="s-") as folder, helper(__file__, "hub", folder):
            while not Path(folder, "hub.sock").exists():
                time.sleep(0.01)
            with helper(__file__, "sender", folder, "--values", str(chosen.values)):
                uvloop.run(measure(folder, chosen.values))


if __name__ == "__main__":
    main()
