"""Makes an exchange last beyond a restart: the placer uses the new class from the component's next start on."""

from __future__ import annotations

from backbone.addresses import PLACER
from backbone.bus.interface import Bus
from backbone.errors import LinkError, Refusal
from backbone.placer.messages import NotPlaced, ReviseStart, StartRevised

REVISED_WITHIN_S = 2.0  # chosen: the placer answers in milliseconds


async def revise_start(bus: Bus, order: ReviseStart) -> str:
    """Send the placer the order for the component's next start; return a remark for the operator, empty: none."""
    try:
        await bus.ask(PLACER, order, StartRevised, within_s=REVISED_WITHIN_S)
    except NotPlaced:  # started by hand
        return ""
    except (LinkError, Refusal) as error:
        return f"the next start of {order.name} uses the old class again: {error}"
    return ""
