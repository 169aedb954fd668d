"""The analysis against everything that can happen to small sets of streams."""

from __future__ import annotations

import itertools
import random

import pytest
from every_case import small_set, worst_over_all_phasings, worst_over_all_that_can_happen
from examples import share

from backbone.scheduling.response_time import (
    Stream,
    admissible,
    feasible_order,
    remedy,
    utilization,
    worst_response_us,
)


def compare_with_all_phasings(seed: int, sets: int) -> int:
    """Return how many sets the sum test admits though a packet is late."""
    rng = random.Random(seed)
    misled = 0
    for _ in range(sets):
        streams = small_set(rng)
        seen = worst_over_all_phasings(streams)
        for place, worst in enumerate(seen):
            analyzed = worst_response_us(streams, place)
            assert analyzed is None or analyzed == worst, (streams, place)
        late = any(worst > one.deadline_us for worst, one in zip(seen, streams, strict=True))
        admitted = admissible(streams, 1.0)
        assert not (admitted and late), streams
        bounded = all(worst_response_us(streams, place) is not None for place in range(len(streams)))
        assert admitted == (not late and bounded), streams
        misled += late and admissible(streams, 1.0, "sum")
    return misled


def test_over_all_phasings_no_packet_is_later_than_analyzed_and_one_is_as_late() -> None:
    sets = share(250)
    assert compare_with_all_phasings(seed=1, sets=sets) > sets // 5


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_over_all_phasings_of_ten_thousand_sets_no_packet_is_later_than_analyzed_and_one_is_as_late() -> None:
    misled = compare_with_all_phasings(seed=2, sets=10_000)
    print(f"the sum test admits {misled} of 10000 sets that miss a deadline")
    assert misled > 1000


def sporadic_set(rng: random.Random) -> list[Stream]:
    """Return up to three streams with jitter, of so few ticks that all their states can be visited."""
    count = rng.randint(1, 3)
    while True:
        streams = []
        for _ in range(count):
            period = rng.randint(2, 8)
            packet = rng.randint(1, max(1, period - 1))
            streams.append(Stream(period, packet, rng.randint(packet, 2 * period), rng.choice([0, 0, 1, 2, 4])))
        states = 1
        for one in streams:
            states *= one.period_us * (1 + one.jitter_us)
        if utilization(streams) < 0.95 and states < 1000:
            return streams


def compare_with_all_that_can_happen(seed: int, sets: int) -> None:
    rng = random.Random(seed)
    for _ in range(sets):
        streams = sporadic_set(rng)
        analyzed = [worst_response_us(streams, place) for place in range(len(streams))]
        assert analyzed == worst_over_all_that_can_happen(streams), streams


def test_streams_that_release_when_they_like_and_late_are_as_late_as_analyzed_at_the_worst() -> None:
    compare_with_all_that_can_happen(seed=3, sets=300)


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_ten_thousand_sets_that_release_when_they_like_and_late_are_as_late_as_analyzed_at_the_worst() -> None:
    compare_with_all_that_can_happen(seed=4, sets=10_000)


def test_an_order_is_found_exactly_where_one_exists() -> None:
    rng = random.Random(5)
    found = 0
    for _ in range(400):
        streams = [one._replace(jitter_us=rng.choice([0, 0, 1])) for one in small_set(rng)]
        possible = any(admissible(order, 1.0) for order in itertools.permutations(streams))
        order = feasible_order(streams, 1.0)
        assert (order is not None) == possible, streams
        if order is not None:
            assert sorted(order) == [*range(len(streams))]
            assert admissible([streams[number] for number in order], 1.0)
            found += 1
    assert 50 < found < 350


def test_the_remedy_names_the_order_that_fits_where_the_rate_monotonic_one_does_not() -> None:
    quick, urgent = Stream(4, 2, 6, 0), Stream(8, 3, 4, 0)
    assert not admissible([quick, urgent], 1.0)
    assert "urgent, quick" in remedy([("quick", quick), ("urgent", urgent)], 1.0)
    assert remedy([("quick", quick), ("urgent", urgent)], 0.5) == ""
