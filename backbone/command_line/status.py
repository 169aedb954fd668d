"""``scout-backbone status``: the mission picture once, or again and again, also of a mission whose hub is away.

Rule of this file: it loads no screen; ``tables`` does. The import of a screen takes a fifth of the command's time, and
programs that read JSON need no screen.
"""

from __future__ import annotations

import contextlib
import json
from collections.abc import AsyncGenerator, AsyncIterator
from typing import Protocol

from backbone import run_files
from backbone.addresses import NAMESERVER
from backbone.bus.clock import MissionClock
from backbone.bus.interface import Bus, Clock
from backbone.command_line.connection import connected
from backbone.command_line.where import Where
from backbone.component.messages import Absence
from backbone.creator.process_table import is_stopped
from backbone.errors import HubUnreachable, LinkError
from backbone.launcher.endings import ExitCode, show
from backbone.naming import component_of
from backbone.picture.health import HealthWord
from backbone.picture.look import look
from backbone.picture.mission import MissionPicture

EVERY_S = 1.0  # chosen: programs that watch want one line a second


class Display(Protocol):
    """How pictures of a mission are shown.

    Attributes:
        every_s: Seconds of the machine between two of them.
    """

    every_s: float

    def show(self, picture: MissionPicture) -> None:
        """Show one."""

    async def keep_showing(self, pictures: AsyncIterator[MissionPicture]) -> None:
        """Show each, until there are no more."""


class JsonLines:
    """One JSON object a line."""

    every_s = EVERY_S

    def show(self, picture: MissionPicture) -> None:
        """Print one."""
        show([json.dumps(picture.to_json())])

    async def keep_showing(self, pictures: AsyncIterator[MissionPicture]) -> None:
        """Print each, until there are no more."""
        async for picture in pictures:
            self.show(picture)


async def show_status(where: Where, display: Display, *, watch: bool) -> ExitCode:
    """Show how a mission is and return the exit code: MISSION_FAILED if it has failed, else DONE.

    Args:
        watch: Again and again, until Ctrl-C.

    Raises:
        MissionNotUp: No mission of this name is up on this machine, or not any more.
        LinkError: The nameserver did not answer, and no launcher of the mission lives on this machine.
    """
    found = run_files.find(where.mission) if where.connect is None else None
    try:
        async with connected(where) as (bus, clock):
            return await _show(_pictures(bus, clock, found, display.every_s), display, watch)
    except LinkError as error:
        if found is None:
            raise
        picture = picture_without_hub(found, error)
        display.show(picture)
        return _exit_code(picture)


async def _show(pictures: AsyncGenerator[MissionPicture, None], display: Display, watch: bool) -> ExitCode:
    async with contextlib.aclosing(pictures):
        if watch:
            await display.keep_showing(pictures)
        picture = await anext(pictures)
        display.show(picture)
        return _exit_code(picture)


async def _pictures(
    bus: Bus, clock: Clock, found: run_files.RunFile | None, every_s: float
) -> AsyncGenerator[MissionPicture, None]:
    """Yield the state of the mission, until it has ended.

    Raises:
        MissionNotUp: The mission has ended; a later one of its name may be up.
        LinkError: The nameserver of a mission elsewhere did not answer.
    """
    before = None
    while True:
        try:
            before = await look(bus, clock.now_s(), before=before, rate=clock.rate)
        except LinkError as error:
            if found is None:
                raise
            before = picture_without_hub(found, error)
        if found is not None:
            _require_same(found, before)
        yield before
        await clock.sleep_s(every_s * clock.rate)


def _require_same(found: run_files.RunFile, picture: MissionPicture) -> None:
    """Return if the mission of this picture is still up on this machine.

    Raises:
        MissionNotUp: Its nameserver does not answer and it has ended, or a later mission of its name is up, whose time
            is another.
    """
    if any(absence.name == component_of(NAMESERVER) for absence in picture.missed):
        run_files.find(found.mission)
    origins = [one.clock_origin_monotonic_s for one in run_files.find_all() if one.mission == found.mission]
    if any(origin != found.clock_origin_monotonic_s for origin in origins):
        raise run_files.MissionNotUp(
            f"{found.mission} was started again", remedy="Repeat the command for the new mission."
        )


def picture_without_hub(found: run_files.RunFile, error: LinkError) -> MissionPicture:
    """Return the picture of a mission from its run file alone: its launcher lives, its hub does not answer."""
    clock = MissionClock(found.clock_origin_monotonic_s, found.clock_rate)
    now_s, pid = clock.now_s(), found.launcher_pid
    silence = f"no answer: {error}" if not isinstance(error, HubUnreachable) else f"nothing answers at {found.endpoint}"
    if is_stopped(pid):
        remedy = f"Let it go on with 'kill -CONT {pid}', or end the mission with 'scout-backbone down'."
        missed = [
            Absence("launcher", now_s, f"its process {pid} is paused", "", remedy, vital=True),
            Absence("nameserver", now_s, silence, "", "Continue the launcher, which restarts it.", vital=True),
        ]
    else:
        missed = [Absence("nameserver", now_s, silence, f"the launcher, process {pid}, restarts it", vital=True)]
    problem = "nothing else is known: no component can be reached without the nameserver"
    return MissionPicture(found.mission, now_s, {}, problems=(problem,), missed=tuple(missed), rate=clock.rate)


def _exit_code(picture: MissionPicture) -> ExitCode:
    return ExitCode.MISSION_FAILED if picture.health.word is HealthWord.FAILED else ExitCode.DONE
