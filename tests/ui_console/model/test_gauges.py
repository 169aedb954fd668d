"""Gauges: readings as words and shares; a low battery is an alarm until it is charged."""

from __future__ import annotations

import pytest
from console_scenes import SCHEDULE, component, rc
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.abilities import Abilities, FieldForm, ValueKind, field_forms
from backbone.component_database.messages import ComponentType, TypeCount, Types
from backbone.naming import Subsystem
from resource_pool.arc_client import Readings
from resource_pool.robots.rover.report import RoverReport
from ui_console.model.events import Heard
from ui_console.model.gauges import battery_of, gauges
from ui_console.model.team import TeamModel
from ui_console.model.views import AlarmKind

numbers = st.dictionaries(
    st.from_regex(r"[a-z]{1,8}(_share|_rad|_m_s|)", fullmatch=True), st.floats(-2, 2) | st.booleans()
)


def team(*readings: Readings) -> TeamModel:
    model = TeamModel("iros2001")
    model.apply(Heard(5.0, SCHEDULE))
    for one in readings:
        model.apply(Heard(one.at_s, one))
    return model


def batteries(model: TeamModel) -> list[str]:
    return [alarm.line for alarm in model.alarms.views() if alarm.kind is AlarmKind.BATTERY and alarm.is_active]


@given(numbers)
def test_each_value_is_one_gauge_and_shares_come_first(values: dict[str, float | bool]) -> None:
    shown = gauges(Readings("scout1", 1.0, values))
    assert len(shown) == len(values)
    is_share = [gauge.is_share for gauge in shown]
    assert is_share == sorted(is_share, reverse=True)
    assert all(-1.0 <= gauge.share <= 1.0 and gauge.text for gauge in shown)
    assert sum(gauge.flag is not None for gauge in shown) == sum(isinstance(value, bool) for value in values.values())


@given(st.floats(-1e6, 1e6), st.floats(-40, 40), st.floats(0.001, 40))
def test_a_value_with_a_declared_range_has_its_place_there(value: float, least: float, width: float) -> None:
    form = FieldForm("arm_rad", ValueKind.NUMBER, "rad", least, least + width, doc="Of the arm.")
    [gauge] = gauges(Readings("rover1", 1.0, {"arm_rad": value}), [form])
    assert (gauge.name, gauge.doc, gauge.is_share, gauge.flag) == ("arm", "Of the arm.", False, None)
    assert gauge.span == f"{least:.3g} to {least + width:.3g} rad"
    assert gauge.share == pytest.approx(min(1.0, max(0.0, (value - least) / width)))


def test_what_only_keeps_nonsense_away_is_no_range() -> None:
    values = {"left_wheel_m": 12.3, "closed": 0.25, "is_holding": True, "unheard_of": 1.5}
    shown = {gauge.name: gauge for gauge in gauges(Readings("rover1", 1.0, values), field_forms(RoverReport))}
    assert (shown["left wheel"].text, shown["left wheel"].share, shown["left wheel"].span) == ("12.3 m", -1.0, "")
    assert shown["left wheel"].doc.startswith("Way of the left wheel")
    assert (shown["closed"].share, shown["closed"].span, shown["closed"].is_share) == (0.25, "0 to 1", False)
    assert (shown["is holding"].text, shown["is holding"].flag) == ("on", True)
    assert (shown["unheard of"].text, shown["unheard of"].doc) == ("1.5", "")


def test_ranges_are_known_once_the_database_has_told_its_types() -> None:
    model = team(Readings("scout1", 6.0, {"closed": 0.25}))
    assert [gauge.span for robot in model.robots.views(8.0) for gauge in robot.gauges] == [""]
    abilities = Abilities(is_robot=True, reports=field_forms(RoverReport))
    rover = ComponentType("scout", "x:Y", Subsystem.RESOURCE_POOL, abilities=abilities)
    model.apply(Heard(7.0, Types([TypeCount(rover, 1)])))
    assert [gauge.span for robot in model.robots.views(8.0) for gauge in robot.gauges] == ["0 to 1"]


def test_the_robots_row_has_its_gauges_and_their_age() -> None:
    values = {"tilt_rad": 0.25, "battery_share": 0.871}
    robots = {robot.robot: robot for robot in team(Readings("scout1", 6.0, values)).robots.views(8.0)}
    assert [(gauge.name, gauge.text) for gauge in robots["scout1"].gauges] == [
        ("battery", "87 %"),
        ("tilt", "0.25 rad"),
    ]
    assert robots["scout1"].reported_age_s == 2.0
    assert (robots["scout2"].gauges, robots["scout2"].reported_age_s) == ([], -1.0)


def test_a_low_battery_is_an_alarm_until_it_is_charged() -> None:
    low = team(Readings("scout1", 6.0, {"battery_share": 0.19}))
    assert batteries(low) == ["the battery of scout1 is low: 19%"]
    low.apply(Heard(7.0, Readings("scout1", 7.0, {"battery_share": 0.9})))
    assert batteries(low) == []


def test_readings_that_are_older_or_empty_change_nothing() -> None:
    model = team(Readings("scout1", 6.0, {"battery_share": 0.9}), Readings("scout1", 5.0, {"battery_share": 0.1}))
    model.apply(Heard(8.0, Readings("scout1", -1.0)))
    assert batteries(model) == []
    assert next(robot for robot in model.robots.views(8.0) if robot.robot == "scout1").gauges[0].text == "90 %"


def test_a_robot_without_a_battery_reports_none() -> None:
    assert battery_of(Readings("x", 1.0, {"tilt_rad": 1.0})) is None
    assert (rc("x", "lamp", []).is_robot, component("resource_pool/x", "lamp").is_robot) == (False, False)
