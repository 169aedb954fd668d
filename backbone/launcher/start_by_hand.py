"""``start``: completes an operator's order with the mission's declaration of the component.

A behavior is completed with its place in the present tree. If the mission file does not declare an RC, the declaration
of another resource of its type completes it: driver, sharing and links. The operator gives the RC's own parameters (an
address, a channel).
"""

from __future__ import annotations

import msgspec

from backbone.addresses import DEPENDENCY_DATABASE, LAUNCHER
from backbone.bus.interface import Bus
from backbone.component_database.messages import UnknownType
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.errors import Refusal
from backbone.placer.messages import AskDeclared, DeclaredOrder, Start

REPLY_TIME_S = 2.0  # chosen: an acceptable wait for a person at a terminal


class OtherType(Refusal):
    """The mission declares a component of this name, of another type."""

    code = "start.other_type"
    remedy = "Start the component with its own type, or choose another name."


async def completed(bus: Bus, order: Start) -> tuple[Start, str]:
    """Return the order completed from the mission's component of this name, and a remark for the operator.

    Raises:
        OtherType: The component of this name has another type.
        LinkError: The dependency database or the launcher did not answer.
    """
    found = await bus.ask(DEPENDENCY_DATABASE, AskResources(), Resources, within_s=REPLY_TIME_S)
    if not order.name or any(order.name == each.name or order.type == each.type for each in found.resources):
        return complete(order, found.resources)
    declared = (await bus.ask(LAUNCHER, AskDeclared(order.name), DeclaredOrder, within_s=REPLY_TIME_S)).order
    return (order if declared is None else as_declared(order, declared)), ""


async def named_in_place_of_its_type(bus: Bus, refusal: UnknownType, order: Start) -> UnknownType:
    """Return the refusal of an order's type, with the order that the operator meant if the mission has such a name."""
    found = await bus.ask(DEPENDENCY_DATABASE, AskResources(), Resources, within_s=REPLY_TIME_S)
    declared = (await bus.ask(LAUNCHER, AskDeclared(order.type), DeclaredOrder, within_s=REPLY_TIME_S)).order
    kinds = [
        *(each.type for each in found.resources if each.name == order.type),
        *([declared.type] if declared else []),
    ]
    if not kinds:
        return refusal
    remedy = f"Write: scout-backbone start {kinds[0]} --name {order.type}"
    return UnknownType(f"{order.type} is the name of a component, whose type is {kinds[0]}", remedy=remedy)


def complete(order: Start, resources: list[Resource]) -> tuple[Start, str]:
    """Return the result of ``completed`` for an RC and these resources; an order of another component as it is.

    Example:
        >>> complete(Start("scout", "scout9"), [Resource("scout1", "scout")])[1]
        'scout9 is not in the mission file: it is like scout1, and can be claimed until it is stopped'
    """
    resource = next((each for each in resources if each.name == order.name), None)
    if resource is None:
        return _like_another(order, [each for each in resources if each.type == order.type])
    declared = Start(resource.type, resource.name, resource.rc_parameters(), resource.host, process=resource.process)
    return as_declared(order, declared), ""


def as_declared(order: Start, declared: Start) -> Start:
    """Return the order completed from its declaration.

    Raises:
        OtherType: The declared component has another type.

    Example:
        >>> as_declared(Start("wait", "w", host="field"), Start("wait", "w", {"seconds": 2}, "base")).parameters
        {'seconds': 2}
    """
    if declared.type != order.type:
        raise OtherType(f"{declared.name} is a {declared.type} in the mission, not a {order.type}")
    return msgspec.structs.replace(
        order,
        parameters={**declared.parameters, **order.parameters},
        host=order.host or declared.host,
        process=order.process or declared.process,
    )


def _like_another(order: Start, others: list[Resource]) -> tuple[Start, str]:
    if not others:
        return order, ""
    model = msgspec.structs.replace(others[0], parameters={})
    whole = msgspec.structs.replace(order, parameters={**model.rc_parameters(), **order.parameters})
    name = order.name or "it"
    return whole, f"{name} is not in the mission file: it is like {model.name}, and can be claimed until it is stopped"
