"""``scout-backbone load``: processor time of each robot, module and process."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import Iterable

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.interface import Bus
from backbone.command_line.connection import REPLY_TIME_S, connected
from backbone.command_line.tables import console_of_width, print_on
from backbone.command_line.where import Where
from backbone.component.messages import AskStatistics, Statistics
from backbone.errors import LinkError, Refusal
from backbone.launcher.endings import ExitCode, say, show
from backbone.nameserver.messages import Components, ListComponents
from backbone.picture.load import LoadReading, Loads, loads
from backbone.picture.screen import table
from backbone.printable import printable_all
from backbone.rc_manager.messages import AskSchedule
from backbone.scheduling.views import Schedule
from backbone.wire import plain


async def print_loads(where: Where, for_s: float, *, as_json: bool, width: int | None) -> ExitCode:
    """Print the loads between two readings, ``for_s`` seconds apart.

    Raises:
        LinkError: The nameserver did not answer.
    """
    async with connected(where) as (bus, clock):
        first = await _reading(bus, await _listed(bus))
        await clock.sleep_s(for_s * clock.rate)
        listed = await _listed(bus)
        then = await _reading(bus, listed)
        found = loads(listed.components, await _schedule(bus), first, then)
        if as_json:
            show([json.dumps({"mission": bus.mission, "for_s": then.at_s - first.at_s, **plain(found)})])
        else:
            _draw(found, width)
    return ExitCode.DONE


async def _listed(bus: Bus) -> Components:
    return printable_all(await bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S))


async def _schedule(bus: Bus) -> Schedule | None:
    try:
        return printable_all(await bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S))
    except (LinkError, Refusal):
        say("the RC manager did not answer, so the robots are unknown")
        return None


async def _reading(bus: Bus, listed: Components) -> LoadReading:
    async def of(address: str) -> dict[str, float]:
        try:
            return printable_all(await bus.ask(address, AskStatistics(), Statistics, within_s=REPLY_TIME_S)).values
        except (LinkError, Refusal):
            return {}

    at_s, addresses = time.monotonic(), [one.address for one in listed.components]
    return LoadReading(at_s, dict(zip(addresses, await asyncio.gather(*map(of, addresses)), strict=True)))


def _draw(found: Loads, width: int | None) -> None:
    console = console_of_width(width)
    for title, columns, rows in (
        ("robots", ("robot", "cores", "processor time", "its RC and ARCs"), _robot_rows(found)),
        ("modules", ("unit", "module", "cores", "processor time", "rate", "longest"), _module_rows(found)),
        ("processes", ("host", "pid", "cores", "processor time", "components"), _process_rows(found)),
    ):
        if rows := list(rows):
            print_on(console, table(title, columns, rows))
    if found.silent:
        say(f"no answer from {', '.join(found.silent)}")


def _robot_rows(found: Loads) -> Iterable[tuple[str, ...]]:
    for one in found.robots:
        yield one.robot, f"{one.cores:.2f}", f"{one.processor_s:.2f} s", ", ".join(one.components)


def _module_rows(found: Loads) -> Iterable[tuple[str, ...]]:
    for one in found.modules:
        times = (
            f"{one.cores:.2f}",
            f"{one.processor_s:.2f} s",
            f"{one.rate_hz:.1f} Hz",
            f"{one.longest_s * 1e3:.1f} ms",
        )
        yield one.unit, one.module, *times


def _process_rows(found: Loads) -> Iterable[tuple[str, ...]]:
    for one in found.processes:
        yield one.host, str(one.pid), f"{one.cores:.2f}", f"{one.processor_s:.2f} s", ", ".join(one.components)
