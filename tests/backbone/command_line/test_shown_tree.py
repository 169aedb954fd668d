"""The lines of ``tree``."""

from __future__ import annotations

from backbone.command_line.tree_orders import tree_lines
from backbone.component.messages import ComponentState, LifeState
from backbone.mission.document import outline

MISSION = """<mission name="m"><behaviors><behavior type="sequence" name="root" priority="3">
  <behavior type="patrol" name="round" priority="2"/></behavior></behaviors></mission>"""


def test_a_behavior_whose_robot_a_person_took_names_that_person() -> None:
    there = [
        ComponentState("mission_control/round", "patrol", "base", 9, LifeState.READY, 1.0, "higher by console-7-drive"),
        ComponentState("ui_console/console-7", "console", "base", 8, LifeState.READY, 1.0, user="anna"),
    ]
    assert tree_lines(outline(MISSION.encode()), there) == [
        "  root (sequence, priority 3)  not started",
        "    round (patrol, priority 2)  base, process 9: higher by anna",
    ]
