"""The tables of the terminal console: what each shows, and what it says where it shows nothing."""

from __future__ import annotations

from enum import StrEnum

from ui_console.terminal.lines import (
    Row,
    alarm_rows,
    component_rows,
    link_rows,
    log_rows,
    parameter_rows,
    request_rows,
    robot_rows,
    timeline_rows,
    tree_rows,
)
from ui_console.views import ConsoleView


class PanelName(StrEnum):
    """The tables, in the order in which tab goes through them."""

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
    PanelName.SCHEDULE: "nobody asks",
    PanelName.TIMELINE: "nothing was held yet",
    PanelName.ALARMS: "none",
    PanelName.LINKS: "nothing is known yet",
    PanelName.PARAMETERS: "i on a row elsewhere asks for its parameters, e here changes one",
    PanelName.COMPONENTS: "nobody is known yet",
    PanelName.LOG: "nothing yet",
}
FIXED = (PanelName.ROBOTS, PanelName.ALARMS)
"""Tables that are always to be seen; the others take turns between them."""


def table_rows(name: PanelName, view: ConsoleView, columns: int) -> list[Row]:
    """Return the rows of a table.

    Args:
        name: Which.
        view: What the console shows.
        columns: How wide the table is, for what is drawn to scale.
    """
    match name:
        case PanelName.ROBOTS:
            return robot_rows(view.robots, view.now_s)
        case PanelName.TREE:
            return tree_rows(view.tree, view.now_s)
        case PanelName.SCHEDULE:
            return request_rows(view.requests, view.now_s)
        case PanelName.TIMELINE:
            return timeline_rows(view.timeline, columns)
        case PanelName.ALARMS:
            return alarm_rows(view.alarms, view.now_s)
        case PanelName.LINKS:
            return link_rows(view.links, view.hosts)
        case PanelName.PARAMETERS:
            return parameter_rows(view.parameters)
        case PanelName.COMPONENTS:
            return component_rows(view.components)
        case PanelName.LOG:
            return log_rows(view.log)
