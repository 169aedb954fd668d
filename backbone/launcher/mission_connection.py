"""Connection to a mission that is up: by name on this machine, or by its hub's endpoint.

On the launcher's machine, a process computes the mission's time from the monotonic clock of that machine. On
another machine, it asks the nameserver and assumes that question and answer took equally long.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import AsyncIterator

from backbone import run_files
from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.component.messages import AskTime, MissionTime
from backbone.errors import NoResponder

REPLY_TIME_S = 2.0  # chosen: a slow wireless link answers within this
ASKED_TIMES = 5  # chosen: the quickest of a few answers is within a millisecond


@contextlib.asynccontextmanager
async def connected(
    mission: str | None, endpoint: str | None, source: str, secret: str = ""
) -> AsyncIterator[tuple[ZenohBus, MissionClock]]:
    """Open a bus to a mission and close it at the end.

    Args:
        mission: Name; may be None if exactly one mission is up on this machine.
        endpoint: Endpoint of a hub on another machine; needs the mission's name.
        source: Address of this client, which every envelope carries.
        secret: Secret of the mission; empty: the hub requires none.

    Raises:
        MissionNotUp: No mission of this name is up on this machine.
        HubUnreachable: No hub listens at the endpoint.
        LinkError: The nameserver did not answer.
    """
    if endpoint is None:
        found = run_files.find(mission)
        clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)
        bus = await ZenohBus.open_when_up(
            found.mission, source, clock, client_config(found.endpoint, run_files.secret(found))
        )
        bus.use_host(str(run_files.run_directory(found.mission)))
    else:
        assert mission is not None  # noqa: S101  the command line refuses this
        clock = await clock_elsewhere(mission, endpoint, source, secret)
        bus = await ZenohBus.open_when_up(mission, source, clock, client_config(endpoint, secret))
    try:
        yield bus, clock
    finally:
        await bus.close()


async def clock_elsewhere(mission: str, endpoint: str, source: str, secret: str = "") -> MissionClock:
    """Return a clock of this machine that shows the time of a mission on another machine.

    Raises:
        HubUnreachable: No hub listens at the endpoint.
        LinkError: The nameserver did not answer, or the hub belongs to another mission.
    """
    config = client_config(endpoint, secret)
    bus = await ZenohBus.open_when_up(mission, source, MissionClock.started_now(), config)
    try:
        return await mission_clock(bus)
    except NoResponder as error:
        raise NoResponder(f"the hub at {endpoint} has no mission {mission}, or is just starting") from error
    finally:
        await bus.close()


async def mission_clock(bus: Bus) -> MissionClock:
    """Return a clock of this machine that shows the time of the mission at the bus's hub.

    Raises:
        LinkError: The nameserver did not answer.
    """
    readings = [await _reading(bus) for _ in range(ASKED_TIMES)]
    _, origin_s, rate = min(readings)
    return MissionClock(origin_s, rate)


async def _reading(bus: Bus) -> tuple[float, float, float]:
    """Return the duration of one question, and the monotonic origin and rate that follow from its answer."""
    asked_s = time.monotonic()
    answer = await bus.ask(NAMESERVER, AskTime(), MissionTime, within_s=REPLY_TIME_S)
    took_s = time.monotonic() - asked_s
    return took_s, asked_s + took_s / 2 - answer.at_s / answer.rate, answer.rate
