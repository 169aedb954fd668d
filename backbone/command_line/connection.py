"""Connection: a command's bus to the mission that its options name."""

from __future__ import annotations

import os
from contextlib import AbstractAsyncContextManager

from backbone.bus.clock import MissionClock
from backbone.bus.zenoh_bus import ZenohBus
from backbone.command_line.where import Where
from backbone.launcher import mission_connection

REPLY_TIME_S = 2.0  # chosen: a person at a terminal accepts this wait, and a slow wireless link answers within it


def source() -> str:
    """Return the address of this process in a mission."""
    return f"ui_console/cli-{os.getpid()}"


def connected(where: Where) -> AbstractAsyncContextManager[tuple[ZenohBus, MissionClock]]:
    """Return a context manager for a bus to a mission that is up, and its clock."""
    return mission_connection.connected(where.mission, where.connect, source(), where.secret())
