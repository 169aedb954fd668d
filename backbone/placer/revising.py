"""Makes an exchange last beyond a restart: the placer uses the new class from the component's next start on."""

from __future__ import annotations

from backbone.addresses import PLACER
from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.errors import LinkError, Refusal
from backbone.placer.messages import NotPlaced, ReviseStart, StartRevised

REVISED_WITHIN_S = 6.0  # chosen: the placer waits 5 s for a creator; one that hangs is killed after 3 s
SUCCESSOR_WITHIN_S = 1.5  # chosen: a killed placer is back within one second; a driver's lease lasts 2 s


async def revise_start(bus: Bus, clock: Clock, order: ReviseStart) -> str:
    """Send the placer the order for the component's next start; return a remark for the operator, empty: none.

    If the placer does not answer, the order is sent to its successor, because a placer that hangs is replaced.
    """
    try:
        try:
            await bus.ask(PLACER, order, StartRevised, within_s=REVISED_WITHIN_S)
        except LinkError:
            within_s = SUCCESSOR_WITHIN_S
            await ask_until_answered(bus, clock, PLACER, order, StartRevised, each_s=within_s, within_s=within_s)
    except NotPlaced:  # started by hand
        return ""
    except (LinkError, Refusal) as error:
        told = error.detail if isinstance(error, Refusal) else error
        return (
            f"the next start of {order.name} may use the old class again, so swap again when the placer answers: {told}"
        )
    return ""
