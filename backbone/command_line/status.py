"""``scout-backbone status``: the mission picture once or repeatedly, also of a mission whose hub does not answer."""

from __future__ import annotations

import contextlib
import json
from collections.abc import AsyncGenerator
from dataclasses import dataclass

import psutil
from rich.console import Console
from rich.live import Live

from backbone import run_files
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.command_line.connection import connected
from backbone.command_line.where import Where
from backbone.component.messages import Absence
from backbone.errors import HubUnreachable, LinkError
from backbone.launcher.endings import ExitCode
from backbone.picture.health import HealthWord
from backbone.picture.look import look
from backbone.picture.mission import MissionPicture
from backbone.picture.screen import live_screen, screen

EVERY_S = 1.0  # chosen: monitoring programs want one line a second
REDRAW_EVERY_S = 0.5  # chosen: slices of seconds stay visible


@dataclass(frozen=True)
class Shown:
    """How a status is shown.

    Attributes:
        as_json: True: one JSON object instead of tables.
        watch: True: show it repeatedly.
        width: Width of tables; None: the terminal's.
    """

    as_json: bool
    watch: bool
    width: int | None


async def show_status(where: Where, shown: Shown) -> ExitCode:
    """Print the state of a mission and return the exit code: MISSION_FAILED if it has failed, else DONE.

    Raises:
        MissionNotUp: No mission of this name is up on this machine.
        LinkError: The nameserver did not answer, and no launcher of the mission lives on this machine.
    """
    found = run_files.find(where.mission) if where.connect is None else None
    try:
        async with connected(where) as (bus, clock):
            return await _show(bus, clock, found, shown)
    except LinkError as error:
        if found is None:
            raise
        picture = picture_without_hub(found, error)
        _print(picture, shown)
        return _exit_code(picture)


async def _show(bus: Bus, clock: Clock, found: run_files.RunFile | None, shown: Shown) -> ExitCode:
    pictures = _pictures(bus, clock, found, EVERY_S if shown.as_json else REDRAW_EVERY_S)
    async with contextlib.aclosing(pictures):
        if shown.watch and not shown.as_json:
            console = console_of_width(shown.width)
            with Live(console=console, auto_refresh=False, screen=True, vertical_overflow="crop") as live:
                async for picture in pictures:
                    live.update(live_screen(picture, None, console.height), refresh=True)
        async for picture in pictures:
            _print(picture, shown)
            if not shown.watch:
                return _exit_code(picture)
    raise AssertionError("a mission is watched until Ctrl-C")


async def _pictures(
    bus: Bus, clock: Clock, found: run_files.RunFile | None, every_s: float
) -> AsyncGenerator[MissionPicture, None]:
    """Yield the state of the mission, without end."""
    before = None
    while True:
        try:
            before = await look(bus, clock.now_s(), before=before, rate=clock.rate)
        except LinkError as error:
            if found is None:
                raise
            before = picture_without_hub(found, error)
        yield before
        await clock.sleep_s(every_s * clock.rate)


def picture_without_hub(found: run_files.RunFile, error: LinkError) -> MissionPicture:
    """Return the picture of a mission from its run file alone: its launcher lives, its hub does not answer."""
    clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)
    now_s, pid = clock.now_s(), found.launcher_pid
    silence = f"no answer: {error}" if not isinstance(error, HubUnreachable) else f"nothing answers at {found.endpoint}"
    if _is_paused(pid):
        remedy = f"Continue it with 'kill -CONT {pid}', or end the mission with 'scout-backbone down'."
        missed = [
            Absence("launcher", now_s, f"its process {pid} is paused", "", remedy, vital=True),
            Absence("nameserver", now_s, silence, "", "Continue the launcher, which restarts it.", vital=True),
        ]
    else:
        missed = [Absence("nameserver", now_s, silence, f"the launcher, process {pid}, restarts it", vital=True)]
    problem = "nothing else is known: no component can be reached without the nameserver"
    return MissionPicture(found.mission, now_s, {}, problems=(problem,), missed=tuple(missed), rate=clock.rate)


def _is_paused(pid: int) -> bool:
    try:
        return psutil.Process(pid).status() == psutil.STATUS_STOPPED
    except psutil.NoSuchProcess:
        return False


def _print(picture: MissionPicture, shown: Shown) -> None:
    if shown.as_json:
        print(json.dumps(picture.to_json()), flush=True)
    else:
        console_of_width(shown.width).print(screen(picture))


def console_of_width(width: int | None) -> Console:
    """Return a console for tables; None: as wide as the terminal."""
    # Cell contents come over the bus: square brackets in them are text, not markup.
    return Console(width=width, markup=False, emoji=False, highlight=False)


def _exit_code(picture: MissionPicture) -> ExitCode:
    return ExitCode.MISSION_FAILED if picture.health.word is HealthWord.FAILED else ExitCode.DONE
