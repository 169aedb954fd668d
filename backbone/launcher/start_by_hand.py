"""``start``: completes an operator's order with the mission file's declaration of the component.

If the file does not declare an RC, the declaration of another resource of its type completes it: driver, sharing and
links. The operator gives the RC's own parameters (an address, a channel).
"""

from __future__ import annotations

import msgspec

from backbone.addresses import DEPENDENCY_DATABASE
from backbone.bus.interface import Bus
from backbone.dependency_database.messages import AskResources, Resource, Resources
from backbone.errors import Refusal
from backbone.placer.messages import Start

REPLY_TIME_S = 2.0  # chosen: an acceptable wait for a person at a terminal


class OtherType(Refusal):
    """The mission file has a resource of this name, of another type."""

    code = "start.other_type"
    remedy = "Start the resource with its own type, or choose another name."


async def completed(bus: Bus, order: Start) -> tuple[Start, str]:
    """Return the order completed from the mission file's resource of this name, and a remark for the operator.

    Raises:
        OtherType: The resource of this name has another type.
        LinkError: The dependency database did not answer.
    """
    found = await bus.ask(DEPENDENCY_DATABASE, AskResources(), Resources, within_s=REPLY_TIME_S)
    return complete(order, found.resources)


def complete(order: Start, resources: list[Resource]) -> tuple[Start, str]:
    """Return the result of ``completed`` for these resources.

    Example:
        >>> complete(Start("scout", "scout9"), [Resource("scout1", "scout")])[1]
        'scout9 is not in the mission file: it is like scout1, and can be claimed until it is stopped'
    """
    resource = next((each for each in resources if each.name == order.name), None)
    if resource is None:
        return _like_another(order, [each for each in resources if each.type == order.type])
    if resource.type != order.type:
        raise OtherType(f"{resource.name} is a {resource.type} in the mission file, not a {order.type}")
    whole = msgspec.structs.replace(
        order,
        parameters={**resource.rc_parameters(), **order.parameters},
        host=order.host or resource.host,
        process=order.process or resource.process,
    )
    return whole, ""


def _like_another(order: Start, others: list[Resource]) -> tuple[Start, str]:
    if not others:
        return order, ""
    model = msgspec.structs.replace(others[0], parameters={})
    whole = msgspec.structs.replace(order, parameters={**model.rc_parameters(), **order.parameters})
    name = order.name or "it"
    return whole, f"{name} is not in the mission file: it is like {model.name}, and can be claimed until it is stopped"
