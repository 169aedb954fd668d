"""The work of ``scout-backbone bridge``."""

from __future__ import annotations

from backbone.command_line.connection import connected
from backbone.command_line.listening import opening_port, until_ended
from backbone.command_line.watching import overhearing
from backbone.command_line.where import Where
from backbone.foxglove.bridge import Bridge
from backbone.foxglove.well_known import installed
from backbone.launcher.endings import ExitCode, say
from backbone.operating_system.own_process import go_behind_others
from backbone.spoken import counted


async def bridge(where: Where, host: str, port: int, keys: tuple[str, ...]) -> ExitCode:
    """Show a mission in viewers until a signal, or until the mission has ended.

    Raises:
        PortUnusable: The port cannot be opened.
    """
    go_behind_others()
    async with connected(where) as (bus, clock), until_ended(bus, clock) as ended:
        with opening_port(host, port):
            served = Bridge(bus.mission, host, port, installed())
        try:
            async with overhearing(bus, clock, keys, served.heard) as subscribed:
                say(f"Foxglove shows {bus.mission} at ws://{host}:{port}; Ctrl-C ends it")
                await ended.wait()
                if dropped := sum(one.dropped for one in subscribed):
                    say(f"{counted(dropped, 'message')} came faster than they could be shown")
        finally:
            await served.close()
    return ExitCode.DONE
