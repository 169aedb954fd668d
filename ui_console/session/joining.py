"""A console's process joins a mission: its name, its clock, its bus, and the signals that end it."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import socket
import sys
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass

from backbone import run_files
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Clock
from backbone.bus.zenoh_bus import ZenohBus, client_config
from backbone.command_line.line_printer import LinePrinter
from backbone.command_line.where import Where
from backbone.component.launch import Launch
from backbone.launcher.mission_connection import clock_elsewhere
from backbone.naming import Subsystem
from backbone.operating_system.ending_signals import orders_to_end
from ui_console.session.observer import AnyObserver

MOST_OF_HOST = 24  # chosen: leaves room in a component's name for its number, and for its ARC's


@dataclass(frozen=True)
class Joining:
    """A console that has not opened its bus yet.

    Attributes:
        secret: The secret of the mission's hub.
    """

    launch: Launch
    clock: Clock
    secret: str

    async def open_bus(self, launch: Launch | None = None) -> ZenohBus:
        """Return the bus once the hub has answered.

        Args:
            launch: Identity of the component that joins; None: this console.
        """
        who = launch or self.launch
        config = client_config(who.endpoint, self.secret)
        return await ZenohBus.open_when_up(who.mission, who.address, self.clock, config)


async def join(where: Where, parameters: dict[str, object] | None = None) -> Joining:
    """Return the identity of this process in the mission.

    Raises:
        Refusal: No such mission is up on this machine.
        LinkError: The hub elsewhere does not answer.
    """
    mission, connect = where.mission, where.connect
    name = f"console-{os.getpid()}" if connect is None else _name_elsewhere(socket.gethostname())
    clock: Clock
    if connect is None or mission is None:
        found = run_files.find(mission)
        mission, endpoint, secret = found.mission, found.endpoint, run_files.secret(found)
        clock, host = MissionClock(found.clock_origin_monotonic_s, found.clock_rate), found.host
    else:
        endpoint, host, secret = connect, socket.gethostname(), where.secret()
        clock = await clock_elsewhere(mission, connect, f"{Subsystem.UI_CONSOLE}/{name}", secret)
    launch = Launch(
        mission,
        Subsystem.UI_CONSOLE,
        name,
        "console",
        "ui_console.session.teleoperation:Teleoperation",
        host,
        endpoint,
        clock.origin_monotonic_s,
        clock.rate,
        parameters or {},
    )
    return Joining(launch, clock, secret)


def end_on_signals(console: AnyObserver) -> Callable[[], bool]:
    """Make SIGINT and SIGTERM end the console in good order; the returned function tells whether SIGINT arrived."""
    return _end_on(console.end, signal.SIGINT, signal.SIGTERM)


def end_server_on_signals(end: Callable[[str], None]) -> Callable[[], bool]:
    """Make SIGINT, SIGTERM and SIGHUP end a server in good order; the result returns whether SIGINT came.

    A SIGHUP that ``nohup`` ignores stays ignored.

    Args:
        end: Called with the signal's name.
    """
    return _end_on(end, signal.SIGINT, *orders_to_end())


def _end_on(end: Callable[[str], None], *numbers: signal.Signals) -> Callable[[], bool]:
    came = set[signal.Signals]()

    def caught(number: signal.Signals) -> None:
        came.add(number)
        end(number.name)

    for number in numbers:
        asyncio.get_running_loop().add_signal_handler(number, caught, number)
    return lambda: signal.SIGINT in came


@asynccontextmanager
async def line_writer() -> AsyncIterator[Callable[[bytes], None]]:
    """Yield a function that writes one line to standard output, beside the event loop: no reader holds up the robot.

    If the reader has gone away, this process ends in good order, as after SIGTERM.
    """
    printer = LinePrinter(lambda: signal.raise_signal(signal.SIGTERM))
    try:
        yield printer.put_bytes
    finally:
        with suppress(BrokenPipeError):
            await printer.end()


def write_line(line: bytes) -> None:
    """Write one line to standard output without delay, because a reader may wait for it.

    If the reader has gone away, this process ends in good order, as after SIGTERM.
    """
    try:
        sys.stdout.buffer.write(line + b"\n")
        sys.stdout.buffer.flush()
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        signal.raise_signal(signal.SIGTERM)


def _name_elsewhere(host: str) -> str:
    """Return a console's name that is unique over machines, because each machine has its own process numbers.

    Example:
        >>> _name_elsewhere("Lab PC.local").rpartition("-")[0]
        'console-lab-pc-local'
    """
    plain = re.sub(r"[^a-z0-9]+", "-", host.lower()).strip("-")[:MOST_OF_HOST].strip("-")
    return f"console-{plain}-{os.getpid()}"
