"""The fewest causes are found, and a broken run is reported with them."""

from __future__ import annotations

from collections.abc import Sequence

from hypothesis import given
from hypothesis import strategies as st

from mission_control.laboratory.simulation.shrink import smallest


@given(st.sets(st.integers(0, 60), max_size=4))
def test_what_is_needed_is_found_and_nothing_else(needed: set[int]) -> None:
    assert smallest(range(61), lambda some: needed <= {*some}) == sorted(needed)


def test_of_two_ways_to_break_it_one_is_left() -> None:
    found = smallest(range(20), lambda some: {3, 4} <= {*some} or {11} <= {*some})
    assert found in ([3, 4], [11])


def test_it_gives_up_looking_after_so_many_trials_with_something_that_breaks_it() -> None:
    trials: list[Sequence[int]] = []

    def breaks(some: Sequence[int]) -> bool:
        trials.append(some)
        return {*range(0, 100, 3)} <= {*some}

    found = smallest(range(100), breaks, most_trials=20)
    assert {*range(0, 100, 3)} <= {*found}
    assert len(trials) <= 21
