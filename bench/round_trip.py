"""Time from a question to its answer: client, hub and server in three processes.

The floor is the same path on bare zenoh-python: ``session.get`` and a queryable, both bridged to asyncio as the bus
does it, with the same bytes. Calls alternate one by one, so that both run under the same load. They use the unix
socket, as a mission on one machine does. Prints one JSON line; ``ratio`` is bus p50 over bare p50.
"""

from __future__ import annotations

import argparse
import asyncio
import tempfile
import time
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Any

import uvloop
import zenoh
from bare_hub import bare_hub
from measuring import free_endpoint, helper, percentile, report, summary, wait_for_end_of_input

from backbone.authentication import socket_endpoint
from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus, client_config, hub_config
from backbone.component.messages import SetParameter, Stop
from backbone.wire import WIRE_VERSION, Envelope, Message, write

MISSION = "bench"
SERVER, CLIENT = "backbone/server", "ui_console/client"
BARE_KEY = "bare/server/ask"
QUESTION = SetParameter("left_rad_s", 4.25, "ann")
WITHIN_S = 10.0


async def answer(asked: Envelope[Any]) -> Message:
    """Return an answer as small as the question."""
    return Stop(asked.body.name)


def serve_bare(session: zenoh.Session) -> None:
    """Answer on bare zenoh from the event loop, with as many bytes as the bus."""
    loop = asyncio.get_running_loop()
    reply = write(Envelope(WIRE_VERSION, SERVER, 1, 0.5, f"{CLIENT}#1", Stop("left_rad_s")))

    def in_loop(query: zenoh.Query) -> None:
        query.payload.to_bytes()
        query.reply(BARE_KEY, reply, express=True)
        query.drop()

    session.declare_queryable(BARE_KEY, lambda query: loop.call_soon_threadsafe(in_loop, query))


async def ask_bare(session: zenoh.Session, payload: bytes) -> bytes:
    """Ask on bare zenoh from the event loop.

    Raises:
        ConnectionError: No process answers.
    """
    loop = asyncio.get_running_loop()
    answered: asyncio.Future[zenoh.Reply] = loop.create_future()

    def arrived(reply: zenoh.Reply) -> None:
        loop.call_soon_threadsafe(answered.set_result, reply)

    def over() -> None:
        if not answered.done():
            answered.set_exception(ConnectionError("no process answers"))

    session.get(
        BARE_KEY,
        zenoh.handlers.Callback(arrived, lambda: loop.call_soon_threadsafe(over), indirect=False),
        payload=payload,
        timeout=WITHIN_S,
        express=True,
    )
    return (await answered).ok.payload.to_bytes()


async def serve(endpoint: str) -> None:
    """Run as the server process."""
    bus = await ZenohBus.open_when_up(MISSION, SERVER, MissionClock.started_now(), client_config(endpoint))
    bare = zenoh.open(client_config(endpoint))
    serve_bare(bare)
    bus.serve(SERVER, SetParameter, answer)
    bare.liveliness().declare_token("bare/alive")
    bus.declare_alive(SERVER)
    await asyncio.get_running_loop().run_in_executor(None, wait_for_end_of_input)
    await bus.close()
    bare.close()


def be_hub(endpoint: str) -> None:
    """Run as the hub process."""
    with bare_hub(hub_config([endpoint])):
        wait_for_end_of_input()


async def measure(endpoint: str, calls: int) -> None:
    """Run as the client process."""
    bus = await ZenohBus.open_when_up(MISSION, CLIENT, MissionClock.started_now(), client_config(endpoint))
    bare = zenoh.open(client_config(endpoint))
    ready = asyncio.Event()
    bus.watch_alive(SERVER, lambda _address, _alive: ready.set())
    await asyncio.wait_for(ready.wait(), WITHIN_S)
    payload = write(Envelope(WIRE_VERSION, CLIENT, 1, 0.5, "", QUESTION))

    async def on_bus() -> object:
        return await bus.ask(SERVER, QUESTION, Stop, within_s=WITHIN_S)

    async def on_bare() -> object:
        return await ask_bare(bare, payload)

    async def timed(call: Callable[[], Awaitable[object]]) -> float:
        began_s = time.perf_counter()
        await call()
        return time.perf_counter() - began_s

    for _ in range(calls // 10):
        await on_bus()
        await on_bare()
    times: dict[str, list[float]] = {"bus": [], "bare": []}
    cpu: dict[str, float] = {"bus": 0.0, "bare": 0.0}
    for _ in range(calls):
        for name, call in (("bus", on_bus), ("bare", on_bare)):
            cpu_began_s = time.process_time()
            times[name].append(await timed(call))
            cpu[name] += time.process_time() - cpu_began_s
    together = await timed(lambda: asyncio.gather(*(on_bus() for _ in range(1000))))
    bare_together = await timed(lambda: asyncio.gather(*(on_bare() for _ in range(1000))))
    report(
        "round_trip",
        calls=calls,
        bus=summary(times["bus"]),
        bare=summary(times["bare"]),
        ratio=round(percentile(times["bus"], 0.5) / percentile(times["bare"], 0.5), 3),
        ratio_p99=round(percentile(times["bus"], 0.99) / percentile(times["bare"], 0.99), 3),
        aim=1.25,
        client_cpu_us={name: round(spent_s / calls * 1e6) for name, spent_s in cpu.items()},
        together_per_s={"bus": round(1000 / together), "bare": round(1000 / bare_together)},
    )
    await bus.close()
    bare.close()


def main() -> None:
    """Run the role named first, or all of them."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("role", nargs="?", default="all", choices=["all", "hub", "server"])
    parser.add_argument("endpoint", nargs="?", default="")
    parser.add_argument("--tcp", action="store_true", help="by the port for other machines, not by the unix socket")
    parser.add_argument("--calls", type=int, default=2000, help="asked each way")
    chosen = parser.parse_args()
    if chosen.role == "hub":
        be_hub(chosen.endpoint)
    elif chosen.role == "server":
        uvloop.run(serve(chosen.endpoint))
    else:
        with tempfile.TemporaryDirectory(prefix="s-") as folder:
            endpoint = free_endpoint() if chosen.tcp else socket_endpoint(Path(folder))
            with helper(__file__, "hub", endpoint), helper(__file__, "server", endpoint):
                uvloop.run(measure(endpoint, chosen.calls))


if __name__ == "__main__":
    main()
