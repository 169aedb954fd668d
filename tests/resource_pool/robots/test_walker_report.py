"""What consoles draw of a walker: its commands with the limits of its gait, its report as single values."""

from __future__ import annotations

import pytest

from backbone.component.abilities import ValueKind
from resource_pool.robots.walker.gait import MAX_FORWARD_M_S, MAX_TURN_RAD_S, TrunkSpeed
from resource_pool.robots.walker.link import Status, encode_status
from resource_pool.robots.walker.motion import MotionControl
from resource_pool.robots.walker.rc import WalkerRc
from resource_pool.robots.walker.report import report_of


def test_its_abilities_have_the_limits_of_its_gait() -> None:
    abilities = WalkerRc.abilities()
    forms = {form.word: form for form in abilities.commands}
    assert list(forms) == ["move", "halt", "switch_transmitter"]
    assert [(field.least, field.most) for field in forms["move"].fields] == [
        (-MAX_FORWARD_M_S, MAX_FORWARD_M_S),
        (-MAX_TURN_RAD_S, MAX_TURN_RAD_S),
    ]
    assert abilities.is_robot
    assert abilities.body_class == "resource_pool.robots.walker.body:Walker"


def test_each_value_of_its_report_can_be_a_gauge() -> None:
    reports = WalkerRc.abilities().reports
    assert {field.kind for field in reports} == {ValueKind.NUMBER, ValueKind.FLAG}
    assert all(field.doc for field in reports)
    units = {field.name: field.unit for field in reports}
    assert [units[name] for name in ("expected_m_s", "turn_rad_s", "hind_left_knee_rad", "phase")] == [
        "m/s",
        "rad/s",
        "rad",
        "",
    ]


def test_its_status_and_its_state_of_motion_are_one_report() -> None:
    angles_rad = tuple(number / 100 for number in range(12))
    payload = encode_status(Status(1.0, 0.1, -0.2, 0.5, angles_rad, (True, False, True, False)))
    control = MotionControl()
    control.request(TrunkSpeed(0.2, 0.4))
    control.step(0.0)
    report = report_of(payload, control.state())
    assert (report.battery_share, report.roll_rad, report.pitch_rad, report.turn_rad_s) == (1.0, 0.1, -0.2, 0.5)
    assert (report.commanded_m_s, report.commanded_rad_s, report.expected_m_s) == (0.2, 0.4, 0.0)
    assert (report.front_left_foot, report.front_right_foot) == (True, False)
    assert (report.hind_left_foot, report.hind_right_foot) == (True, False)
    assert report.front_left_abduction_rad == 0.0
    assert (report.front_right_knee_rad, report.hind_right_knee_rad) == pytest.approx((0.05, 0.11))
