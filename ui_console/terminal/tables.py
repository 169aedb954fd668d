"""The tables of the terminal console, each with its text for an empty table."""

from __future__ import annotations

from enum import StrEnum


class PanelName(StrEnum):
    """The tables, in the order of the tab key."""

    ROBOTS = "robots"
    TREE = "tree"
    SCHEDULE = "schedule"
    TIMELINE = "timeline"
    ALARMS = "alarms"
    LINKS = "links"
    PARAMETERS = "parameters"
    COMPONENTS = "components"
    LOG = "log"


NOTHING = {
    PanelName.ROBOTS: "no robot is known yet",
    PanelName.TREE: "no behavior is known yet",
    PanelName.SCHEDULE: "no requests",
    PanelName.TIMELINE: "nothing was held yet",
    PanelName.ALARMS: "none",
    PanelName.LINKS: "nothing is known yet",
    PanelName.PARAMETERS: "i on a row elsewhere asks for its parameters, e here changes one",
    PanelName.COMPONENTS: "no component is known yet",
    PanelName.LOG: "nothing yet",
}
FIXED = (PanelName.ROBOTS, PanelName.ALARMS)
"""Tables that are always on the screen; only one of the others is shown at a time."""
