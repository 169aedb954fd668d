"""A component's claim of its name, before it connects to anything."""

from __future__ import annotations

from backbone.addresses import NAMESERVER
from backbone.bus.interface import Bus, Clock
from backbone.component.asking import ask_until_answered
from backbone.component.messages import ComponentState, LastStop, NameTaken, Register, Registered
from backbone.naming import claim_address
from backbone.operating_system.processes import exists

REGISTER_WITHIN_S = 10.0  # chosen: a restarted hub is back long before, even on a busy machine
REGISTER_AGAIN_S = 0.1  # chosen: the nameserver forgets a name without a claim after a second
REGISTER_EACH_S = 2.0  # chosen: the nameserver answers in milliseconds; after this the question was lost


async def claim_name(bus: Bus, clock: Clock, state: ComponentState) -> LastStop:
    """Register the name and declare its claim, so that the nameserver also sees a death before readiness.

    Returns:
        The last emergency stop of the former component of this name, as the nameserver knows it.

    Raises:
        NameTaken: A living component has the name.
        LinkError: No nameserver answered within ``REGISTER_WITHIN_S``.
    """
    until_s = clock.now_s() + REGISTER_WITHIN_S * clock.rate
    while True:
        try:
            registered = await ask_until_answered(
                bus, clock, NAMESERVER, Register(state), Registered, each_s=REGISTER_EACH_S, within_s=REGISTER_WITHIN_S
            )
            break
        except NameTaken as taken:
            if not _is_of_the_dead(taken, state.host) or clock.now_s() >= until_s:
                raise
        await clock.sleep_s(REGISTER_AGAIN_S * clock.rate)
    bus.declare_alive(claim_address(state.address, state.incarnation))
    return registered.last_stop


def _is_of_the_dead(taken: NameTaken, host: str) -> bool:
    """Return whether the name belongs to a process of this host that was killed before it declared its claim."""
    pid = taken.facts.get("pid", 0)
    return taken.facts.get("host") == host and isinstance(pid, int) and pid > 0 and not exists(pid)
