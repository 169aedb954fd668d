"""An exchange lasts beyond a restart: the placer starts the component with its new class from the next start on."""

from __future__ import annotations

from backbone.addresses import PLACER
from backbone.bus.interface import Bus
from backbone.errors import LinkError, Refusal
from backbone.placer.messages import NotPlaced, ReviseStart, StartRevised

REVISED_WITHIN_S = 2.0  # chosen: the placer answers in milliseconds


async def revise_start(bus: Bus, order: ReviseStart) -> str:
    """Have the next life of the component begin as the order says; return what an operator should know, or nothing."""
    try:
        await bus.ask(PLACER, order, StartRevised, within_s=REVISED_WITHIN_S)
    except NotPlaced:  # started by hand
        return ""
    except (LinkError, Refusal) as error:
        return f"a new start of {order.name} has the old class again: {error}"
    return ""
