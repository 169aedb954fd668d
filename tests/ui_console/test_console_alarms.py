"""Alarms are kept until somebody has seen them, and the unseen ones longest."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from ui_console.alarms import ALARMS_KEPT, AlarmBook, alarm_key
from ui_console.views import AlarmKind

KIND = AlarmKind.LOST
STEPS = st.lists(
    st.tuples(st.sampled_from(["happened", "begin", "end", "acknowledge"]), st.integers(0, 5)), max_size=60
)


def play(steps: list[tuple[str, int]]) -> tuple[AlarmBook, dict[str, str], set[str]]:
    """Return the book, who is unseen by the plain rule, and which conditions are so."""
    book, unseen, active = AlarmBook(), {}, set()
    for at_s, (step, number) in enumerate(steps):
        subject = f"s{number}"
        key = alarm_key(KIND, subject)
        match step:
            case "happened":
                book.happened(KIND, subject, "line", at_s)
                unseen[key] = subject
                active.discard(key)
            case "begin":
                book.begin(KIND, subject, "line", at_s)
                if key not in active:
                    unseen[key] = subject
                active.add(key)
            case "end":
                book.end(KIND, subject, at_s)
                active.discard(key)
            case "acknowledge":
                assert book.acknowledge("anna", key) == (key in unseen)
                unseen.pop(key, None)
    return book, unseen, active


@given(STEPS)
def test_what_is_shown_is_what_is_unseen_or_still_so(steps: list[tuple[str, int]]) -> None:
    book, unseen, active = play(steps)
    views = book.views()
    assert {view.key for view in views} == unseen.keys() | active
    assert {view.key for view in views if not view.acknowledged_by} == unseen.keys()
    assert {view.key for view in views if view.is_active} == active


@given(st.integers(0, 3 * ALARMS_KEPT), st.integers(0, ALARMS_KEPT))
def test_too_many_alarms_drop_seen_ones_before_unseen_ones_and_those_dropped_unseen_are_counted(
    more: int, seen: int
) -> None:
    book = AlarmBook()
    for number in range(seen):
        book.begin(KIND, f"seen{number}", "line", 0.0)
    book.acknowledge("anna")
    for number in range(more):
        book.happened(KIND, f"new{number}", "line", 1.0)
    shown = [view for view in book.views() if not view.acknowledged_by]
    assert len(shown) == min(more, ALARMS_KEPT)
    assert book.forgotten == max(0, more - ALARMS_KEPT)
    assert len(book.views()) <= ALARMS_KEPT


def test_a_condition_that_goes_on_is_one_alarm_and_one_that_comes_back_has_to_be_seen_again() -> None:
    book = AlarmBook()
    book.begin(KIND, "s", "first", 1.0)
    book.begin(KIND, "s", "second", 2.0)
    [view] = book.views()
    assert (view.count, view.line, view.first_s) == (1, "second", 1.0)
    book.acknowledge("anna")
    book.begin(KIND, "s", "third", 3.0)
    assert book.views()[0].acknowledged_by == "anna"
    book.end(KIND, "s", 4.0)
    assert book.views() == []
    book.begin(KIND, "s", "fourth", 5.0)
    [view] = book.views()
    assert (view.count, view.acknowledged_by, view.first_s) == (2, "", 1.0)
