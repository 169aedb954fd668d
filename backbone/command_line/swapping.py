"""The work of ``scout-backbone swap``: a person exchanges a module, and the mission's log tells who did."""

from __future__ import annotations

import asyncio

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus
from backbone.command_line.connection import connected
from backbone.command_line.where import Where
from backbone.component.messages import AskParameters, Parameters
from backbone.errors import LinkError
from backbone.exchange import SwapModule, Swapped, UnknownModule
from backbone.launcher.endings import ExitCode, say, show
from backbone.mission.tables import EXECUTION_UNIT
from backbone.mission_log.operators import OperatorAction, publish_action
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import did_you_mean
from backbone.spoken import counted

REPLY_TIME_S = 2.0  # chosen: a person at a terminal waits this long
READ_WITHIN_S = 60.0  # chosen: an import of a large library on a busy machine, and the answer


async def swap_module(where: Where, asked: SwapModule) -> ExitCode:
    """Exchange the module, and print which of the two goes on.

    Raises:
        UnknownModule: The mission has no such module.
        Refusal: The new one cannot take the place; nothing was changed.
        LinkError: The unit did not answer; the outcome is unknown.
    """
    async with connected(where) as (bus, clock):
        unit = await _unit_of(bus, asked.module)
        publish_action(bus, clock, OperatorAction.SWAP, asked.module, f"for {asked.class_path}")
        within_s = (asked.ready_within_s + asked.prove_s) / clock.rate + READ_WITHIN_S
        swapped = await bus.ask(unit, asked, Swapped, within_s=within_s)
    show([_told(asked, swapped)])
    if swapped.remark:
        say(swapped.remark)
    return ExitCode.DONE if swapped.is_proved else ExitCode.REFUSED


def _told(asked: SwapModule, swapped: Swapped) -> str:
    state = "with the state of the old one" if swapped.keeps_state else "from a fresh state"
    times = f"{swapped.warming_s:.2f} s beside the old one"
    if swapped.proving_s or swapped.is_proved:
        times += f", {swapped.proving_s:.2f} s and {counted(swapped.rounds, 'round')} to prove itself"
    if swapped.is_proved:
        after = f"; {swapped.cause}" if swapped.cause else ""
        return f"{asked.module}: proved, {asked.class_path} goes on {state} ({times}){after}"
    return f"{asked.module}: returned, the old one goes on ({times}): {swapped.cause}"


async def _unit_of(bus: Bus, module: str) -> str:
    """Return the address of the execution unit that runs a module."""
    listed = await bus.ask(NAMESERVER, ListComponents(type=EXECUTION_UNIT), Components, within_s=REPLY_TIME_S)
    units = [one.address for one in listed.components]
    found = await asyncio.gather(*(_modules_of(bus, unit) for unit in units))
    at = {name: unit for unit, names in zip(units, found, strict=True) for name in names}
    if module not in at:
        known = f"; there is: {', '.join(sorted(at))}" if at else ""
        raise UnknownModule(f"no module {module!r} runs{did_you_mean(module, at)}{known}")
    return at[module]


async def _modules_of(bus: Bus, unit: str) -> list[str]:
    try:
        values = (await bus.ask(unit, AskParameters(), Parameters, within_s=REPLY_TIME_S)).values
    except LinkError:  # it ends just now
        return []
    modules = values.get("modules", [])
    return [str(one["name"]) for one in modules if isinstance(one, dict)] if isinstance(modules, list) else []
