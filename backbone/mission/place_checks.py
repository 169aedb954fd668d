"""Checks that the places to which behaviors go are in their room.

Pure: elements and facts in, faults out. The class of a behavior marks the parameters that are coordinates. The room of
a localizer that is no shipped one, and has no room of the mission file, is unknown.
"""

from __future__ import annotations

from backbone.mission.document import Element
from backbone.mission.report import Report
from backbone.mission.tables import ROOM, Tables, parameters

LOCALIZER = "localizer"
"""Parameter that names the component whose room it is."""
SIDES = {"width": ("x", "width-m", "width_m"), "depth": ("y", "depth-m", "depth_m")}
"""Side of the room → its axis, the attribute of <room>, the parameter of a localizer with a room of its own."""


def check_places(behavior: Element, tables: Tables, report: Report) -> None:
    """Report coordinates outside the room of the behavior's localizer."""
    facts, given = tables.facts_of(behavior.text("type")), parameters(behavior)
    written = {one.text("name"): one for one in behavior.all("parameter")}
    for one in () if facts is None else facts.parameters:
        at_m, side = given.get(one.name), one.schema.get("along", "")
        if side not in SIDES or not isinstance(at_m, int | float) or not one.accepts(at_m):
            continue
        extent_m = _extent_m(side, str(given.get(LOCALIZER, "")), tables)
        if extent_m is not None and not 0 <= at_m <= extent_m:
            axis, _, _ = SIDES[side]
            report.fault(
                written[one.name].place_of("value"),
                f"{behavior.text('name')} would go outside the room: {axis} at {at_m:g} m",
                f"The room goes from 0 to {extent_m:g} m along {axis}",
            )


def _extent_m(side: str, localizer: str, tables: Tables) -> float | None:
    """Return how far the room of this localizer goes; None: it is unknown."""
    _, attribute, own = SIDES[side]
    name, world = localizer.rpartition("/")[2], tables.world
    if name in tables.resources:
        facts = tables.facts_of(tables.resources[name].text("type"))
        if facts is None or ROOM not in facts.given:
            return None
        if own_m := parameters(tables.resources[name]).get(own, 0):
            return own_m if isinstance(own_m, int | float) else None
    elif world is None or name != world.text("name"):
        return None
    room = None if world is None else world.first("room")
    return None if room is None else room.number(attribute)
