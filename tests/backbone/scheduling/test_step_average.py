"""The average over the last minutes is that of the steps themselves, between 0 and 1, at a cost that does not grow."""

from __future__ import annotations

import pickle

from hypothesis import example, given
from hypothesis import strategies as st

from backbone.scheduling.step_average import LONGEST_S, SLOT_S, SLOTS_KEPT, StepAverage

STEPS = st.lists(
    st.tuples(st.one_of(st.integers(0, 80), st.integers(0, 10_000)), st.integers(0, 8)), min_size=1, max_size=40
).map(lambda pairs: [(pause / 8, value / 8) for pause, value in pairs])
BEGAN_S = 12.5


def integral(steps: list[tuple[float, float]], since_s: float, until_s: float) -> float:
    """Return the integral of a function of steps (time, new value), one interval after the other."""
    times = [*(time_s for time_s, _ in steps), until_s]
    return sum(
        value * max(0.0, min(end_s, until_s) - max(begin_s, since_s))
        for (begin_s, value), end_s in zip(steps, times[1:], strict=True)
    )


@given(STEPS, st.integers(0, 10_000), st.sampled_from([SLOT_S, 60.0, LONGEST_S]))
@example([(0.0, 1.0)], 0, 60.0)
@example([(0.0, 1.0)], 80, 60.0)
def test_it_is_the_average_of_the_steps_since_a_slot_began(steps, rest, last_s):
    average, now_s, done = StepAverage(BEGAN_S), BEGAN_S, [(BEGAN_S, 0.0)]
    for pause_s, value in steps:
        now_s += pause_s
        average.step_to(value, now_s)
        done.append((now_s, value))
        assert len(pickle.dumps(average)) < 300 + 10 * SLOTS_KEPT, "one number a slot"
    now_s += rest / 8
    slots = (now_s - BEGAN_S - last_s) // SLOT_S
    since_s = BEGAN_S + max(0.0, slots) * SLOT_S
    expected = integral(done, since_s, now_s) / (now_s - since_s) if now_s > since_s else steps[-1][1]
    found = average.over(last_s, now_s)
    assert abs(found - expected) < 1e-9
    assert -1e-12 <= found <= 1 + 1e-12
    assert average.over(last_s, now_s) == found, "asking changes nothing"


def test_an_earlier_time_counts_as_the_last_one():
    average = StepAverage(0.0)
    average.step_to(1.0, 4.0)
    average.step_to(0.0, 3.0)
    assert average.over(60.0, 8.0) == 0.0
