"""Missing messages of a sender are counted in each of its lives, because each life numbers its messages anew."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator

from hypothesis import given
from hypothesis import strategies as st

from backbone.recording.missing_numbers import missing_numbers
from backbone.recording.reader import Recorded

SENDERS = ("resource_pool/scout1", "backbone/rc_manager")
LONGEST = 12
MANY = 20_000
lives = st.lists(st.sets(st.integers(2, LONGEST)).map(lambda later: [1, *sorted(later)]), max_size=3)


def recorded(source: str, lives: list[list[int]]) -> Iterator[Recorded]:
    """Yield messages with these numbers; after the first of a life, two of an instant stand in the wrong order."""
    for begin, numbers in enumerate(lives):
        for place in range(-1, len(numbers), 2):
            at_s = float(begin * 2 * LONGEST + place)
            for number in reversed(numbers[max(0, place) : place + 2]):
                yield Recorded(f"scout/night/{source}/log", source, "StoryEvent/1", at_s, at_s, at_s, number, "", {})


@given(lives, lives)
def test_what_is_missing_in_a_life_counts_though_another_life_had_that_number(
    first: list[list[int]], second: list[list[int]]
) -> None:
    said = [*recorded(SENDERS[0], first), *recorded(SENDERS[1], second)]
    expected = {source: sum(map(gaps, own)) for source, own in zip(SENDERS, (first, second), strict=True)}
    assert missing_numbers(said) == {source: count for source, count in expected.items() if count}


def test_a_question_from_before_the_begin_is_no_gap_to_the_first_message() -> None:
    """A creator asks once a minute; the answer comes when the recorder is there, the messages between never do."""

    def told(number: int, at_s: float, heard_s: float) -> Recorded:
        return Recorded("scout/night/backbone/base/ask", SENDERS[1], "AwaitEnd/1", at_s, at_s, heard_s, number, "", {})

    said = [told(30, 3.5, 63.6), told(131, 54.3, 54.4), told(132, 55.3, 55.3), told(134, 56.4, 56.4)]
    assert missing_numbers(said) == {SENDERS[1]: 1}


def gaps(numbers: list[int]) -> int:
    return len({*range(1, numbers[-1])} - {*numbers})


def test_the_memory_of_the_count_does_not_grow_with_the_recording() -> None:
    body: dict[str, object] = {}
    said = (
        Recorded("scout/night/resource_pool/scout1/log", SENDERS[0], "StoryEvent/1", n, n, n, n * 2, "", body)
        for n in range(1, MANY + 1)
    )
    tracemalloc.start()
    try:
        assert missing_numbers(said) == {SENDERS[0]: MANY - 1}
        _now, most_bytes = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert most_bytes < MANY
