"""A link is reported while it is too slow for commands, and one late answer is no slow link."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from backbone.launcher.link_speed import ASKED_TIMES, SLOW_S, LinkSpeed

ROUND_TRIPS = st.lists(st.floats(0.0, 2.0), max_size=30)


@given(ROUND_TRIPS)
def test_a_link_is_slow_exactly_while_the_last_round_trips_all_took_long(took_s: list[float]) -> None:
    speed = LinkSpeed("far")
    for number, one_s in enumerate(took_s, start=1):
        before = speed.absence
        assert speed.measured(one_s, float(number)) == (speed.absence is not before)
        last = took_s[max(0, number - ASKED_TIMES) : number]
        assert (speed.absence is not None) == (len(last) == ASKED_TIMES and min(last) >= SLOW_S)
        if before is not None and speed.absence is not None:
            assert speed.absence.since_s == before.since_s


def test_a_slow_link_is_named_with_its_round_trip() -> None:
    speed = LinkSpeed("far")
    assert [speed.measured(0.41, now_s) for now_s in (5.0, 10.0, 15.0, 20.0)] == [False, False, True, False]
    assert speed.absence is not None
    assert (speed.absence.name, speed.absence.since_s, speed.absence.is_running) == ("far", 15.0, True)
    assert "a round trip to the hub takes 0.41 s" in speed.absence.cause
    for now_s in (25.0, 30.0, 35.0):
        speed.measured(0.9, now_s)
    assert "0.90 s" in speed.absence.cause
