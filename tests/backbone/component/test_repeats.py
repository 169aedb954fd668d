"""What is said again and again is counted; nothing is written without bound, and nothing is hidden for long."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from backbone.component.repeats import BURST, MOST_PLACES, WINDOW_S, Repeats

HERE, THERE = ("here.py", 1), ("there.py", 2)


def test_the_same_line_is_written_once_and_counted_until_the_window_is_over() -> None:
    repeats = Repeats()
    assert [repeats.is_new(HERE, "late", 0.0) for _ in range(513)] == [True] + [False] * 512
    assert repeats.due(WINDOW_S - 0.1) == []
    assert repeats.due(WINDOW_S) == ["repeated 512 times within 10 s, the last time as: late"]
    assert repeats.due(2 * WINDOW_S) == []
    assert repeats.is_new(HERE, "late", WINDOW_S), "a new window"


def test_lines_that_all_differ_are_written_up_to_a_burst() -> None:
    repeats = Repeats()
    assert sum(repeats.is_new(HERE, f"random bytes {number}", 0.0) for number in range(1000)) == BURST
    assert repeats.due(WINDOW_S) == [f"repeated {1000 - BURST} times within 10 s, the last time as: random bytes 999"]


def test_other_places_are_not_held_up() -> None:
    repeats = Repeats()
    for _ in range(1000):
        repeats.is_new(HERE, "late", 0.0)
    assert repeats.is_new(THERE, "late", 0.0)


def test_what_is_counted_is_told_at_the_end_too() -> None:
    repeats = Repeats()
    for _ in range(3):
        repeats.is_new(HERE, "late", 0.0)
    assert repeats.rest() == ["repeated 2 times within 10 s, the last time as: late"]
    assert repeats.rest() == []


def test_of_too_many_places_the_oldest_is_told_and_forgotten() -> None:
    repeats = Repeats()
    for number in range(2 * MOST_PLACES):
        repeats.due(0.0)
        for _ in range(2):
            repeats.is_new(("generated.py", number), "late", 0.0)
    assert len(repeats.due(0.0)) <= 1
    assert len(repeats.rest()) == MOST_PLACES


@given(st.lists(st.tuples(st.sampled_from([HERE, THERE]), st.sampled_from("abc"), st.floats(0.0, 9.0)), max_size=200))
def test_law_every_line_is_written_or_counted(heard: list[tuple[tuple[str, int], str, float]]) -> None:
    repeats, now_s, written, told = Repeats(), 0.0, 0, []
    for place, line, later_s in heard:
        now_s += later_s
        told += repeats.due(now_s)
        written += repeats.is_new(place, line, now_s)
    told += repeats.rest()
    assert written + sum(int(line.split()[1]) for line in told) == len(heard)
