"""Declared orders: the orders that start the hardware and the execution units of a mission file."""

from __future__ import annotations

from backbone.mission.model import MissionDescription
from backbone.placer.messages import Start


def hardware_orders(description: MissionDescription) -> list[Start]:
    """Return the orders of the further components, such as a simulated world, then those of the RCs."""
    further = [Start(c.type, c.name, c.parameters, c.host, process=c.process) for c in description.components]
    rcs = [Start(r.type, r.name, r.rc_parameters(), r.host, process=r.process) for r in description.resources]
    return [*further, *rcs]


def unit_orders(description: MissionDescription) -> list[Start]:
    """Return the orders of the execution units."""
    return [Start(u.type, u.name, u.parameters, u.host, process=u.process) for u in description.units]
