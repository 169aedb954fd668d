"""Silence: what counts as a sign of life."""

from __future__ import annotations

import hypothesis.strategies as st
import pytest
from hypothesis import given

from backbone.component.heartbeat import Vitals
from backbone.creator.signs_of_life import STACKS_AFTER_S, SignsOfLife
from backbone.creator.silence import LOOK_EVERY_S, LOOK_MOST_S, Silence

GAPS_S = st.lists(st.floats(0.01, 30.0), min_size=1, max_size=40)


def play(looks: list[tuple[float, Vitals]]) -> list[float]:
    silence = Silence()
    return [silence.look(vitals, at_s) for at_s, vitals in looks]


@given(GAPS_S)
def test_a_process_that_beats_is_never_silent(gaps_s: list[float]) -> None:
    at_s, looks = 0.0, []
    for beats, gap_s in enumerate(gaps_s, start=1):
        at_s += gap_s
        looks.append((at_s, Vitals(beats)))
    assert play(looks) == [0.0] * len(looks)


@given(GAPS_S, st.floats(0.0, 1.0))
def test_silence_never_exceeds_the_time_that_passed_and_grows_only(gaps_s: list[float], share: float) -> None:
    """For any share of its time that the process waited for a processor."""
    at_s = queued_s = 0.0
    looks = [(0.0, Vitals(1))]
    for gap_s in gaps_s:
        at_s, queued_s = at_s + gap_s, queued_s + share * gap_s
        looks.append((at_s, Vitals(1, queued_s=queued_s)))
    silent_s = play(looks)
    assert silent_s == sorted(silent_s)
    assert silent_s[-1] <= at_s + 1e-9
    assert silent_s[-1] <= LOOK_MOST_S * len(gaps_s)


def test_a_stopped_process_is_silent_for_as_long_as_it_is_stopped() -> None:
    looks = [(number * LOOK_EVERY_S, Vitals(7, ran_s=1.0)) for number in range(13)]
    assert play(looks)[-1] == 12 * LOOK_EVERY_S


def test_a_process_that_waits_for_a_processor_is_not_silent() -> None:
    looks = [(float(at_s), Vitals(7, queued_s=float(at_s))) for at_s in range(20)]
    assert play(looks)[-1] == 0.0


def test_a_busy_loop_of_a_process_that_has_begun_to_beat_is_silence() -> None:
    looks = [(number * 0.25, Vitals(7, ran_s=number * 0.25)) for number in range(13)]
    assert play(looks)[-1] == 3.0


def test_a_process_that_imports_before_its_first_beat_shows_life() -> None:
    looks = [(number * 0.25, Vitals(0, ran_s=number * 0.25)) for number in range(100)]
    assert play(looks)[-1] == 0.0


def test_a_supervisor_that_was_paused_calls_nobody_dead() -> None:
    assert play([(0.0, Vitals(7)), (60.0, Vitals(7)), (60.25, Vitals(8))]) == [0.0, LOOK_MOST_S, 0.0]


def test_a_process_is_late_by_the_time_it_was_queued_or_not_looked_at_at_most_by_the_time_that_passed() -> None:
    silence, late_s = Silence(), []
    for at_s, queued_s in ((5.0, 3.0), (5.25, 3.125), (5.5, 3.125), (7.5, 3.25), (7.75, 4.25)):
        silence.look(Vitals(7, queued_s=queued_s), at_s)
        late_s.append(silence.late_s)
    assert late_s == pytest.approx([0.0, 0.125, 0.0, 2.0 - LOOK_MOST_S + 0.125, 0.25])


def test_stacks_are_due_once_in_a_silence_also_before_the_first_beat() -> None:
    """A constructor that waits for ever never beats; its place in the code is the only hint at the bug."""
    signs = SignsOfLife(lambda _directory, _pid: Vitals(0, doing="starts"))
    hangs = [sign.hangs for tick in range(40) for sign in signs.look("", [7], tick * LOOK_EVERY_S)]
    assert hangs.count(True) == 1
    assert hangs.index(True) == pytest.approx(STACKS_AFTER_S / LOOK_EVERY_S, abs=1.0)
