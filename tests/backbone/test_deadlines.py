"""Deadlines: a miss is found once, a return is found once, and the count is that of too long silences."""

import math

from hypothesis import given
from hypothesis import strategies as st

from backbone.deadlines import FIRST_S, Deadlines

WITHIN_S = 0.5
gaps = st.lists(st.floats(0.001, 3.0), max_size=50)


@given(gaps, st.floats(0.001, 0.4))
def test_each_too_long_silence_is_missed_once_and_met_once(given_gaps: list[float], look_s: float) -> None:
    now_s = 100.0
    deadlines = Deadlines({"ball": WITHIN_S}, now_s)
    assert deadlines.came("ball", now_s) is None
    silences = 0
    for gap_s in given_gaps:
        told, at_s = list[str](), now_s
        while (at_s := at_s + look_s) < now_s + gap_s:
            told += deadlines.newly_missed(at_s)
        due_s, now_s = now_s + WITHIN_S, now_s + gap_s
        is_late = now_s >= due_s
        silences += is_late
        late_s = deadlines.came("ball", now_s)
        assert told in ([], ["ball"])
        assert (late_s is not None) == is_late
        assert late_s is None or math.isclose(late_s, now_s - due_s)
        assert deadlines.missed["ball"] == silences
        assert not deadlines.late


@given(st.floats(0.001, 100.0))
def test_who_wakes_when_it_is_next_misses_nothing_and_wakes_for_nobody_who_is_late(most_s: float) -> None:
    deadlines = Deadlines({"ball": most_s, "map": 2 * most_s}, 0.0)
    told = list[str]()
    while (at_s := deadlines.next_s) < math.inf:
        assert deadlines.newly_missed(math.nextafter(at_s, 0.0)) == []
        told += deadlines.newly_missed(at_s)
        assert len(told) <= 2
    assert sorted(told) == sorted(deadlines.late) == ["ball", "map"]


def test_the_first_message_has_time_until_a_mission_is_up() -> None:
    deadlines = Deadlines({"ball": WITHIN_S}, 0.0)
    assert deadlines.newly_missed(FIRST_S - 0.01) == []
    assert deadlines.newly_missed(FIRST_S) == ["ball"]


def test_a_key_without_a_deadline_is_never_late() -> None:
    deadlines = Deadlines({}, 0.0)
    assert deadlines.came("map", 1e6) is None
    assert deadlines.next_s == math.inf
