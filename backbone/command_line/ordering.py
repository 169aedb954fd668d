"""Orders of a person to a mission that is up: start and stop a component, set an attribute."""

from __future__ import annotations

import json

from backbone.addresses import PLACER
from backbone.command_line.attributes import attributes_of, change
from backbone.command_line.connection import connected
from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode, say, show
from backbone.launcher.start_by_hand import completed
from backbone.mission_log.operators import OperatorAction, login_name, publish_action
from backbone.naming import component_of
from backbone.placer.messages import Ended, Start, Started, StopComponent
from backbone.placer.wishes import START_WITHIN_S
from backbone.spoken import value_text

STOP_WITHIN_S = 20.0  # chosen: longer than the placer takes to end a component that hangs


async def start_component(where: Where, wanted: Start) -> ExitCode:
    """Start the component, print where it runs and why there, and publish the action."""
    async with connected(where) as (bus, clock):
        order, remark = await completed(bus, wanted)
        started = await bus.ask(PLACER, order, Started, within_s=START_WITHIN_S)
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
        ended = await bus.ask(PLACER, StopComponent(name, "by command"), Ended, within_s=STOP_WITHIN_S)
        publish_action(bus, clock, OperatorAction.STOP_COMPONENT, name, f"ended by {ended.by}")
        show([f"{name} ended by {ended.by}"])
    return ExitCode.DONE


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
        if as_json:
            show([json.dumps(shown.to_json())])
        else:
            show(shown.lines() if attribute is None else shown.of(attribute))
    return ExitCode.DONE
