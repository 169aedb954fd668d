"""Operators of one server share the model of the mission, and nothing of their own."""

from __future__ import annotations

from ui_console.model.console import SILENT_S, STALE_S, ConsoleModel
from ui_console.model.events import Asked, Granted, PictureSeen
from ui_console.model.team import TeamModel
from ui_console.model.views import AlarmKind


def holding(team: TeamModel, name: str, robot: str) -> ConsoleModel:
    model = ConsoleModel(name, name, team)
    model.apply(Asked(0.0, robot, "capture", 100))
    model.apply(Granted(1.0, robot, {"scout": robot}, {robot: 3}, 99.0, 0.0, False))
    return model


def stale(model: ConsoleModel) -> list[str]:
    return [alarm.subject for alarm in model.alarm_views() if alarm.kind is AlarmKind.STALE_VIDEO]


def test_one_that_sees_well_does_not_end_the_alarm_of_one_that_does_not() -> None:
    team = TeamModel("iros2001")
    anna, ben = holding(team, "anna", "scout1"), holding(team, "ben", "scout2")
    for at_s in (2.0, 4.0, 6.0, 8.0):
        ben.apply(PictureSeen(at_s, at_s, "scout2"))
        ben.apply(PictureSeen(at_s, at_s - 5.0, "scout1"))  # ben also watches the robot anna is blind to
        anna.look(at_s)
        ben.look(at_s)
    assert (stale(anna), stale(ben)) == (["scout1"], [])
    anna.apply(PictureSeen(9.0, 9.0, "scout1"))
    anna.look(9.0)
    ben.look(8.0 + STALE_S / 2)
    assert stale(anna) == []


def test_who_shows_no_pictures_of_its_robot_misses_none() -> None:
    team = TeamModel("iros2001")
    anna = holding(team, "anna", "scout1")
    anna.sees = False
    anna.look(2.0 + SILENT_S)
    assert stale(anna) == []
    anna.sees = True
    anna.look(2.0 + SILENT_S)
    assert stale(anna) == ["scout1"]


def test_what_one_holds_is_no_other_ones() -> None:
    team = TeamModel("iros2001")
    anna, ben = holding(team, "anna", "scout1"), ConsoleModel("ben", "ben", team)
    assert (anna.own(2.0).is_held, ben.own(2.0).is_held) == (True, False)
    assert anna.acknowledge() == 0
