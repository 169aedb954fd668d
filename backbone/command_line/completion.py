"""Names for shell completion, asked of a mission that is up, if no file has them (``run_names``).

A person waits for the completion, so names that arrive too late are left out, and errors are not printed.
"""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

from backbone.authentication import read_secret_file
from backbone.errors import BackboneError
from backbone.launcher.mission_connection import connected
from backbone.picture.look import look, types_of
from backbone.picture.names import names_in
from backbone.run_names import MissionNames

WITHIN_S = 1.5  # chosen: a person does not wait longer after Tab


def names_now(mission: str | None, connect: str | None, secret_file: Path | None) -> MissionNames | None:
    """Return the names of a mission; None if no mission is up or it does not answer within ``WITHIN_S``."""

    async def ask() -> MissionNames:
        secret = read_secret_file(secret_file) if connect is not None and secret_file is not None else ""
        async with (
            asyncio.timeout(WITHIN_S),
            connected(mission, connect, f"ui_console/complete-{os.getpid()}", secret) as (bus, clock),
        ):
            picture, types = await asyncio.gather(look(bus, clock.now_s(), rate=clock.rate), types_of(bus))
            return names_in(picture, types)

    try:
        return asyncio.run(ask())
    except (BackboneError, TimeoutError, OSError):
        return None
