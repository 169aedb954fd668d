"""The work of ``scout-backbone metrics``."""

from __future__ import annotations

import asyncio
from contextlib import suppress

from backbone.command_line.connection import connected
from backbone.command_line.listening import opening_port, until_ended
from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode, say
from backbone.metrics.page import Metrics, MetricsServer, Numbers, metrics
from backbone.metrics.watch import MetricsWatch
from backbone.operating_system.own_process import go_behind_others

READ_WITHIN_S = 5.0  # chosen: half of Prometheus' usual patience


async def serve_metrics(where: Where, host: str, port: int) -> ExitCode:
    """Serve the metrics of a mission until a signal, or until the mission has ended.

    Raises:
        PortUnusable: The port cannot be opened.
    """
    go_behind_others()
    async with connected(where) as (bus, clock), until_ended(bus, clock) as ended:
        loop, watch = asyncio.get_running_loop(), MetricsWatch(bus, clock)

        async def now() -> Metrics:
            watch.tally.advance(clock.now_s())
            return metrics(Numbers(watch.tally, watch.utilization, watch.statistics, watch.dropped))

        def read() -> Metrics:
            return asyncio.run_coroutine_threadsafe(now(), loop).result(READ_WITHIN_S)

        with opening_port(host, port):
            server = MetricsServer(host, port, read)
        asking = asyncio.create_task(watch.run(), name="numbers of components")
        asking.add_done_callback(lambda _bug: ended.set())
        say(f"metrics of {bus.mission} at http://{host}:{port}/metrics; Ctrl-C ends it")
        await ended.wait()
        asking.cancel()
        await asyncio.to_thread(server.close)
        with suppress(asyncio.CancelledError):
            await asking
    return ExitCode.DONE
