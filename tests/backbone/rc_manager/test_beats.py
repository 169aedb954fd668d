"""Beats: an ARC that hangs loses its RCs, and an RC manager that was paused takes nothing from anyone."""

from __future__ import annotations

from itertools import accumulate

from hypothesis import given
from hypothesis import strategies as st

from backbone.rc_manager.beats import LOOK_MOST_S, Beats
from backbone.rc_manager.messages import BEAT_MISSED_S, BEAT_WITHIN_S, RENEW_EVERY_S

RATES = st.sampled_from([1.0, 4.0, 0.5])


@given(st.lists(st.floats(RENEW_EVERY_S, LOOK_MOST_S), min_size=1, max_size=60), RATES)
def test_an_arc_that_beats_never_hangs(gaps_s: list[float], rate: float) -> None:
    beats = Beats(rate)
    beats.heard("arc", 0.0)
    for now_s in accumulate(gaps_s):
        beats.heard("arc", (now_s - now_s % BEAT_WITHIN_S) * rate)
        assert beats.look(now_s * rate) == {}


@given(st.lists(st.tuples(st.floats(0.0, 0.05), st.floats(0.0, 0.4), st.booleans()), min_size=1, max_size=60))
def test_an_arc_that_beats_after_each_renewal_may_be_late_and_lose_every_other_beat(
    rounds: list[tuple[float, float, bool]],
) -> None:
    beats, now_s, was_lost = Beats(), 0.0, False
    beats.heard("arc", 0.0)
    for over_s, late_s, is_lost in rounds:
        was_lost = is_lost and not was_lost
        if not was_lost:
            beats.heard("arc", now_s + late_s)
        now_s += RENEW_EVERY_S + over_s
        assert beats.look(now_s) == {}


def test_an_arc_that_hangs_is_named_at_the_third_renewal() -> None:
    beats = Beats()
    beats.heard("arc", 0.001)
    assert [[*beats.look(number * RENEW_EVERY_S)] for number in range(1, 4)] == [[], [], ["arc"]]


@given(st.lists(st.floats(0.3, 30.0), min_size=1, max_size=20), RATES)
def test_a_pause_of_the_rc_manager_is_no_silence_of_an_arc(pauses_s: list[float], rate: float) -> None:
    beats, now_s = Beats(rate), 0.0
    for pause_s in pauses_s:
        beats.heard("arc", now_s * rate)
        assert beats.look(now_s * rate) == {}
        now_s += pause_s
        assert beats.look(now_s * rate) == {}, "the beats of the pause were not read yet"


@given(st.floats(0.0, 10.0), RATES)
def test_an_arc_that_hangs_is_found_also_after_a_pause(pause_s: float, rate: float) -> None:
    beats, now_s = Beats(rate), 0.0
    beats.heard("arc", 0.0)
    beats.look(0.0)
    now_s += pause_s
    awake_since_s = now_s
    while not (hung := beats.look(now_s * rate)):
        now_s += RENEW_EVERY_S
        assert now_s < awake_since_s + BEAT_MISSED_S + 2 * RENEW_EVERY_S
    assert hung["arc"] > BEAT_MISSED_S
    assert beats.look((now_s + 60.0) * rate) == {}, "a hung ARC is named once"


def test_an_arc_that_left_is_not_waited_for() -> None:
    beats = Beats()
    beats.heard("arc", 0.0)
    beats.forget("arc")
    beats.forget("never there")
    assert beats.look(0.0) == beats.look(0.5) == beats.look(1.0) == beats.look(1.5) == {}
