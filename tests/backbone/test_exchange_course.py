"""The course of an exchange, whatever happens in which order."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.exchange_course import ExchangeCourse, ExchangePhase, ExchangeRules, hand_over

EVENTS = st.lists(st.tuples(st.sampled_from(["switch", "fail", "time", "raise"]), st.floats(0, 2)), max_size=12)
ORDER = {
    ExchangePhase.WARMING: (ExchangePhase.WARMING, ExchangePhase.PROVING, ExchangePhase.PROVED, ExchangePhase.RETURNED),
    ExchangePhase.PROVING: (ExchangePhase.PROVING, ExchangePhase.PROVED, ExchangePhase.RETURNED),
    ExchangePhase.PROVED: (ExchangePhase.PROVED,),
    ExchangePhase.RETURNED: (ExchangePhase.RETURNED,),
}


def raise_it() -> None:
    raise ValueError("planted")


@given(EVENTS, st.floats(0, 3), st.floats(0.1, 3))
def test_it_never_goes_back_and_is_over_when_its_times_are(
    events: Sequence[tuple[str, float]], prove_s: float, ready_s: float
) -> None:
    changes: list[ExchangePhase] = []
    course = ExchangeCourse(ExchangeRules(prove_s, ready_s), lambda: changes.append(course.phase), 0.0)
    now_s, seen = 0.0, [course.phase]
    for event, pause_s in events:
        now_s += pause_s
        match event:
            case "switch":
                course.switch(now_s)
            case "fail":
                course.fail(now_s, "because")
            case "time":
                course.let_pass(now_s)
            case "raise":
                course.tried(now_s, raise_it)
        seen.append(course.phase)
        assert course.new_works is (course.phase in (ExchangePhase.PROVING, ExchangePhase.PROVED))
        assert (course.ended_s is not None) is course.is_over
        assert bool(course.cause) is (course.phase is ExchangePhase.RETURNED)
    assert all(after in ORDER[before] for before, after in itertools.pairwise(seen))
    assert len(changes) == len(set(changes)), "each change is told once"
    for _ in range(2):
        now_s = max(now_s, course.due_s)
        course.let_pass(now_s)
    assert course.is_over
    told = course.answer(now_s)
    assert told.is_proved is course.new_works
    assert told.warming_s >= 0
    assert told.proving_s >= 0


class Kept:
    hands_over = frozenset({"marks", "same"})

    def __init__(self) -> None:
        self.marks: list[int] = []
        self.same = self.marks


class AlsoKept(Kept):
    pass


class OtherNames(Kept):
    hands_over = frozenset({"marks"})


class OtherKind(Kept):
    def __init__(self) -> None:
        super().__init__()
        self.same = ()  # type: ignore[assignment]


def test_what_both_name_is_handed_over_as_a_copy() -> None:
    old, new = Kept(), AlsoKept()
    old.marks.append(1)
    assert hand_over(old, new)
    old.marks.append(2)
    assert new.marks == [1]
    assert new.same is new.marks, "what is shared stays shared"


@pytest.mark.parametrize("kind", [OtherNames, OtherKind, object])
def test_nothing_is_handed_over_to_a_class_that_declares_otherwise(kind: type) -> None:
    old, new = Kept(), kind()
    old.marks.append(1)
    assert not hand_over(old, new)
    assert getattr(new, "marks", []) == []


def test_none_stands_for_a_value_of_any_class() -> None:
    old, new = Kept(), AlsoKept()
    new.marks = None  # type: ignore[assignment]
    assert hand_over(old, new)
    assert new.marks == []
