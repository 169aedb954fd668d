"""The modules that the execution units of a mission run, as these say themselves."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from typing import Any

from backbone.bus.interface import Bus
from backbone.command_line.connection import REPLY_TIME_S
from backbone.component.messages import AskParameters, Parameters
from backbone.errors import LinkError


async def modules_by_unit(bus: Bus, units: Iterable[str]) -> dict[str, list[dict[str, Any]] | None]:
    """Return address of a unit → its modules, each with ``name`` and ``class_path``; None: it did not answer."""

    async def ask(unit: str) -> list[dict[str, Any]] | None:
        try:
            told = await bus.ask(unit, AskParameters(), Parameters, within_s=REPLY_TIME_S)
        except LinkError:
            return None
        modules = told.values.get("modules")
        return [one for one in modules if isinstance(one, dict)] if isinstance(modules, list) else []

    units = list(units)
    return dict(zip(units, await asyncio.gather(*map(ask, units)), strict=True))
