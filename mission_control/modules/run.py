"""Run modules without a mission: connected by name and type, in one unit of this process."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Mapping

from backbone.bus.clock import MissionClock
from backbone.bus.interface import Clock
from mission_control.modules.graph import Graph, Member
from mission_control.modules.module import Module, default_name
from mission_control.modules.orders import WrongModule
from mission_control.modules.unit_schedule import Trigger
from mission_control.modules.units_together import Listener, UnitsTogether

LONGEST_SHOWN = 100  # chosen: a class with its package
UNIT = "unit"  # the name of the only unit


def member_of(module: Module) -> Member:
    """Return a module's place in a graph, under the name of its class.

    Raises:
        WrongModule: It is no module, for example a class in place of its instance.
    """
    given: object = module  # a script has no types
    if not isinstance(given, Module):
        raise WrongModule(f"{given!r:.{LONGEST_SHOWN}} is no module", remedy="Give an instance, such as 'Wave()'.")
    return Member(default_name(type(module)), module.ports())


def connected(
    *modules: Module, frequency_hz: float = 0.0, given: Mapping[str, str] | None = None, start_s: float = 0.0
) -> UnitsTogether:
    """Return the modules in one unit, each under the name of its class.

    Args:
        modules: Modules of different classes.
        frequency_hz: Rounds a second; 0: rounds only when a value is fed.
        given: Key → type of the fed values.
        start_s: Time of the first round.

    Raises:
        GraphRefused: They cannot be connected; it says everything at once.
        WrongModule: One of them is no module.
        ValueError: The frequency is not between 0 and 1000 Hz.
    """
    members = [member_of(module) for module in modules]
    by_name = {member.name: module for member, module in zip(members, modules, strict=True)}
    return UnitsTogether(Graph({UNIT: members}, given), by_name, {UNIT: Trigger(frequency_hz)}, start_s)


def run(
    *modules: Module,
    frequency_hz: float = 10.0,
    for_s: float = math.inf,
    listen: Mapping[str, Listener] | None = None,
) -> UnitsTogether:
    """Run the modules in this process; return them when the time is over.

    Args:
        modules: Modules of different classes.
        frequency_hz: Rounds a second, above 0.
        for_s: Seconds; left out: until the process is interrupted.
        listen: Key → function that is called with each of its values.

    Raises:
        GraphRefused: They cannot be connected; it says everything at once.
        WrongModule: One of them is no module.
        ValueError: The frequency is not between 0 and 1000 Hz.
        NothingToHear: No module produces a key of ``listen``.
    """
    clock = MissionClock.started_now()
    units = connected(*modules, frequency_hz=frequency_hz, start_s=clock.now_s())
    for key, listener in (listen or {}).items():
        units.listen(key, listener)
    asyncio.run(run_units(units, clock, clock.now_s() + for_s))
    return units


async def run_units(units: UnitsTogether, clock: Clock, until_s: float = math.inf) -> None:
    """Run the rounds of all frequencies when they are due, until no further round is due before ``until_s``."""
    while (next_s := units.next_s) < until_s:
        await clock.sleep_until_s(next_s)
        units.tick(clock.now_s())
