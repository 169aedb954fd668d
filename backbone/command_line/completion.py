"""Names of a mission that is up, for shells that complete them.

A person waits for the completion, so names that do not arrive at once are left out, and errors are not printed.
"""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import TypeVar

from backbone.authentication import read_secret_file
from backbone.bus.interface import Bus, Clock
from backbone.creator.messages import TYPE as CREATOR
from backbone.errors import BackboneError
from backbone.launcher.mission_connection import connected
from backbone.mission_log.people import is_console
from backbone.naming import component_of
from backbone.picture.look import look, types_of
from backbone.picture.mission import MissionPicture

Answer = TypeVar("Answer")

WITHIN_S = 1.5  # chosen: a person does not wait longer after Tab


def names_of(picture: MissionPicture) -> list[str]:
    """Return the names of components, requests, resources, hosts and people, sorted, each once."""
    schedule = picture.schedule
    names = {component_of(at) for at in picture.components}
    names |= {component.host for component in picture.components.values() if component.type == CREATOR}
    names |= {component.user for component in picture.components.values() if is_word(component.user)}
    names |= {rc.rc for rc in schedule.rcs} | {request.arc for request in schedule.requests} if schedule else set()
    return sorted(names - {""})


def resources_of(picture: MissionPicture) -> list[str]:
    """Return the names of resources, sorted."""
    return sorted(rc.rc for rc in picture.schedule.rcs) if picture.schedule else []


def people_of(picture: MissionPicture) -> list[str]:
    """Return the people at consoles, sorted."""
    return sorted({c.user for at, c in picture.components.items() if is_console(at) and is_word(c.user)})


def is_word(text: str) -> bool:
    """Return whether a shell takes the text as one word."""
    return bool(text) and text.isprintable() and not any(each in text for each in " \t'\"\\$`&|;<>()*?[]#~=%!{}:")


def picture_now(mission: str | None, connect: str | None, secret_file: Path | None) -> MissionPicture | None:
    """Return the picture of a mission; None if no mission is up or it does not answer within ``WITHIN_S``."""
    return _answer_now(mission, connect, secret_file, lambda bus, clock: look(bus, clock.now_s(), rate=clock.rate))


def types_now(mission: str | None, connect: str | None, secret_file: Path | None) -> list[str]:
    """Return the names of a mission's component types; empty as ``picture_now``."""
    types = _answer_now(mission, connect, secret_file, lambda bus, _: types_of(bus)) or []
    return [one.component_type.name for one in types]


def _answer_now(
    mission: str | None,
    connect: str | None,
    secret_file: Path | None,
    ask: Callable[[Bus, Clock], Awaitable[Answer]],
) -> Answer | None:
    async def answer() -> Answer:
        secret = read_secret_file(secret_file) if connect is not None and secret_file is not None else ""
        async with (
            asyncio.timeout(WITHIN_S),
            connected(mission, connect, f"ui_console/complete-{os.getpid()}", secret) as (bus, clock),
        ):
            return await ask(bus, clock)

    try:
        return asyncio.run(answer())
    except (BackboneError, TimeoutError, OSError):
        return None
