"""A moment is understood as a person types it, or refused with what could be typed."""

from __future__ import annotations

import time
from collections.abc import Iterator
from datetime import datetime

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.moments import NoMoment, Now, moment

NOW = Now(1000.0, datetime(2026, 5, 4, 14, 10, 30), rate=2.0)


@pytest.mark.parametrize(
    ("typed", "mission_s"),
    [
        ("5m", 400.0),
        ("1.5s", 997.0),
        ("1h", -6200.0),
        ("123.4", 123.4),
        ("0", 0.0),
        ("14:10", 940.0),
        ("14:10:15", 970.0),
        ("14:11", 1000.0 - 2 * (24 * 3600 - 30)),
    ],
)
def test_ago_time_of_day_and_mission_time_are_told_apart(typed: str, mission_s: float) -> None:
    assert moment(typed, NOW) == pytest.approx(mission_s)


@pytest.mark.parametrize("typed", ["", "soon", "5", "25:00", "14:60", "-5m", "5 m", "1e9", "nan"])
def test_anything_else_is_refused_but_a_plain_number_is_mission_time(typed: str) -> None:
    if typed == "5":
        assert moment(typed, NOW) == 5.0
        return
    with pytest.raises(NoMoment) as refused:
        moment(typed, NOW)
    assert "14:05" in refused.value.remedy


@given(st.floats(0, 1000))
def test_the_time_of_day_of_a_mission_time_leads_back_to_it(at_s: float) -> None:
    shown = NOW.time_of_day(at_s)
    assert NOW.mission_s - (NOW.here - shown).total_seconds() * NOW.rate == pytest.approx(at_s, abs=1e-3)


@pytest.fixture
def in_berlin(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Let local times be those of central Europe, whose clocks go from 2:00 to 3:00 on 29 March 2026."""
    with monkeypatch.context() as patch:
        patch.setenv("TZ", "CET-1CEST,M3.5.0,M10.5.0/3")
        time.tzset()
        yield
    time.tzset()


@pytest.mark.usefixtures("in_berlin")
def test_an_hour_that_the_clocks_leave_out_is_no_time_of_the_mission() -> None:
    now = Now(3600.0, datetime(2026, 3, 29, 3, 30))
    assert now.time_of_day(0.0) == datetime(2026, 3, 29, 1, 30)
    assert moment("01:45", now) == 900.0
