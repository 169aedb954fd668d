"""Inventory of a mission that is up, for a person: component types with their abilities, resources with their use."""

from __future__ import annotations

import asyncio
import json

from rich.console import RenderableType

from backbone.addresses import NAMESERVER, RC_MANAGER
from backbone.bus.interface import Bus
from backbone.command_line.connection import REPLY_TIME_S, connected
from backbone.command_line.inventory_screen import (
    ResourceUse,
    changes_table,
    counted_for,
    resource_json,
    resource_uses,
    resources_table,
    type_json,
    type_tables,
    types_table,
)
from backbone.command_line.tables import console_of_width, print_on
from backbone.command_line.where import Where
from backbone.component_database.messages import TypeCount, UnknownType
from backbone.launcher.endings import ExitCode, say, show
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import did_you_mean
from backbone.picture.look import types_of
from backbone.picture.mission import MissionPicture
from backbone.printable import printable_all
from backbone.rc_manager.messages import AskSchedule, AskUtilization
from backbone.scheduling.requests import UnknownRc
from backbone.scheduling.views import Schedule, Utilization


async def print_types(where: Where, name: str, *, as_json: bool, width: int | None) -> ExitCode:
    """Print all component types, or one with its commands and reports.

    Raises:
        UnknownType: The mission has no type of this name.
    """
    async with connected(where) as (bus, _):
        types = await types_of(bus)
        chosen = [_named(name, types)] if name else types
        if as_json:
            show([json.dumps({"mission": bus.mission, "types": [type_json(one) for one in chosen]})])
        else:
            _draw(width, type_tables(chosen[0]) if name else types_table(chosen))
    return ExitCode.DONE


async def print_resources(where: Where, name: str, *, changes: bool, as_json: bool, width: int | None) -> ExitCode:
    """Print the resources with their utilization, and the shares before and after each re-planning.

    Args:
        name: The only resource to print; empty: all.

    Raises:
        UnknownRc: The mission has no resource of this name.
    """
    async with connected(where) as (bus, clock):
        picture, uses = await resources_of(bus, clock.now_s(), changes=changes)
    uses = _only(name, uses) if name else uses
    if as_json:
        shown = [resource_json(picture, one) for one in uses]
        show([json.dumps({"mission": picture.mission, "at_s": picture.at_s, "resources": shown})])
        return ExitCode.DONE
    _draw(width, resources_table(picture, uses))
    if changes:
        _draw(width, changes_table(picture, uses))
    if remark := counted_for(uses, picture.at_s):
        say(remark)
    return ExitCode.DONE


async def resources_of(bus: Bus, now_s: float, *, changes: bool) -> tuple[MissionPicture, list[ResourceUse]]:
    """Return a picture with components and schedule, and the resources with their utilization."""
    listing, schedule, used = await asyncio.gather(
        bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S),
        bus.ask(RC_MANAGER, AskSchedule(), Schedule, within_s=REPLY_TIME_S),
        bus.ask(RC_MANAGER, AskUtilization(changes), Utilization, within_s=REPLY_TIME_S),
    )
    picture = MissionPicture(bus.mission, now_s)
    picture.take(printable_all(listing))
    picture.take(printable_all(schedule))
    return picture, resource_uses(picture, printable_all(used).rcs)


def _named(name: str, types: list[TypeCount]) -> TypeCount:
    found = next((one for one in types if one.component_type.name == name), None)
    if found is None:
        hint = did_you_mean(name, [one.component_type.name for one in types])
        raise UnknownType(f"no component type {name!r} exists{hint}", type=name)
    return found


def _only(name: str, uses: list[ResourceUse]) -> list[ResourceUse]:
    found = [one for one in uses if one.rc.rc == name]
    if not found:
        raise UnknownRc(f"no resource {name!r} exists{did_you_mean(name, [one.rc.rc for one in uses])}", name=name)
    return found


def _draw(width: int | None, shown: RenderableType) -> None:
    print_on(console_of_width(width), shown)
