"""Orders of a person to a mission that is up: start and stop a component, set an attribute."""

from __future__ import annotations

import json

from backbone.addresses import NAMESERVER, PLACER
from backbone.bus.interface import Bus
from backbone.command_line.attributes import attributes_of, change
from backbone.command_line.connection import REPLY_TIME_S, connected
from backbone.command_line.where import Where
from backbone.component_database.messages import UnknownType
from backbone.errors import LinkError, Refusal
from backbone.launcher.endings import ExitCode, say, show
from backbone.launcher.start_by_hand import completed, named_in_place_of_its_type
from backbone.mission_log.operators import OperatorAction, login_name, publish_action
from backbone.nameserver.messages import Resolve, Resolved
from backbone.naming import component_of
from backbone.placer.messages import Ended, NotPlaced, Start, Started, StopComponent
from backbone.placer.wishes import START_WITHIN_S
from backbone.spoken import value_text

STOP_WITHIN_S = 20.0  # chosen: longer than the placer takes to end a component that hangs


async def start_component(where: Where, wanted: Start) -> ExitCode:
    """Start the component, print where it runs and why there, and publish the action."""
    async with connected(where) as (bus, clock):
        order, remark = await completed(bus, wanted)
        try:
            started = await bus.ask(PLACER, order, Started, within_s=START_WITHIN_S)
        except UnknownType as refusal:
            raise await named_in_place_of_its_type(bus, refusal, order) from None
        if remark:
            say(remark)
        publish_action(bus, clock, OperatorAction.START_COMPONENT, component_of(started.address), f"a {wanted.type}")
        show([f"{started.address} on {started.host}, process {started.pid}"])
        for reason in started.reasons:
            say(reason)
    return ExitCode.DONE


async def stop_component(where: Where, name: str) -> ExitCode:
    """End the component, print how it ended, and publish the action."""
    async with connected(where) as (bus, clock):
        try:
            ended = await bus.ask(PLACER, StopComponent(name, "by command"), Ended, within_s=STOP_WITHIN_S)
        except NotPlaced as refusal:
            raise await running_otherwise(bus, refusal, name) from None
        publish_action(bus, clock, OperatorAction.STOP_COMPONENT, name, f"ended by {ended.by}")
        show([f"{name} ended by {ended.by}"])
    return ExitCode.DONE


async def running_otherwise(bus: Bus, refusal: NotPlaced, name: str) -> NotPlaced:
    """Return the refusal to stop a component, with another remedy if it runs and no placer started it."""
    try:
        await bus.ask(NAMESERVER, Resolve(name), Resolved, within_s=REPLY_TIME_S)
    except (Refusal, LinkError):
        return refusal
    remedy = "A core service ends with the mission, 'scout-backbone down'; a console ends where it was opened."
    return NotPlaced(f"{name} runs, but the placer did not start it", remedy=remedy, name=name)


async def set_attribute(where: Where, name: str, attribute: str, value: object) -> ExitCode:
    """Set the attribute, print its present values, and publish the action."""
    async with connected(where) as (bus, clock):
        lines = await change(bus, name, attribute, value, login_name())
        publish_action(bus, clock, OperatorAction.SET_PARAMETER, name, f"{attribute} = {value_text(value)}")
        show(lines)
    return ExitCode.DONE


async def print_attributes(where: Where, name: str, attribute: str | None, *, as_json: bool) -> ExitCode:
    """Print one attribute of the name, or all."""
    async with connected(where) as (bus, _):
        shown = await attributes_of(bus, name)
        lines = shown.lines() if attribute is None else shown.of(attribute)
        show([json.dumps(shown.to_json())] if as_json else lines)
    return ExitCode.DONE
