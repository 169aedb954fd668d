"""Compares quick admission tests for a radio with the exact one, and measures the cost of the exact one.

The sets of periodic packets are random, with deadlines at the next release. The papers' sum of shares, the Liu-Layland
bound and the hyperbolic bound are correct for processors that can be interrupted; a radio cannot interrupt a packet.
Counts the sets that each test admits, and those of them that miss a deadline. Prints one JSON line.
"""

from __future__ import annotations

import argparse
import itertools
import math
import random
import time
from collections.abc import Callable, Sequence

from measuring import report, summary

from backbone.scheduling.response_time import admissible
from backbone.scheduling.streams import Stream, utilization

PERIODS_S = (0.02, 0.2)  # from a stick's commands to a dead man's sign of life
SIZES = (5, 20, 100)
SHARES = (0.3, 1.0)
TIMED_SETS = 40


def random_set(rng: random.Random, count: int, share: float) -> list[Stream]:
    """Return streams in rate-monotonic order that together need this share of the radio."""
    cuts = sorted([0.0, *(rng.random() for _ in range(count - 1)), 1.0])
    streams = []
    for low, high in itertools.pairwise(cuts):
        period_us = round(1e6 * math.exp(rng.uniform(*map(math.log, PERIODS_S))))
        streams.append(Stream(period_us, max(1, int(period_us * share * (high - low))), period_us, 0))
    return sorted(streams)


def sum_of_shares(streams: Sequence[Stream]) -> bool:
    """Admit if the sum of all shares is at most 1."""
    return admissible(streams, 1.0, "sum")


def liu_layland(streams: Sequence[Stream]) -> bool:
    """Admit up to n (2^(1/n) - 1)."""
    return utilization(streams) <= len(streams) * (2 ** (1 / len(streams)) - 1)


def hyperbolic(streams: Sequence[Stream]) -> bool:
    """Admit while the product of 1 + share is at most 2."""
    return math.prod(1 + one.packet_us / one.period_us for one in streams) <= 2


TESTS: dict[str, Callable[[Sequence[Stream]], bool]] = {
    "sum": sum_of_shares,
    "liu_layland": liu_layland,
    "hyperbolic": hyperbolic,
}


def compare(rng: random.Random, sets: int) -> dict[str, dict[str, int]]:
    """Return, for each test, the number of admitted sets, and of those that miss a deadline."""
    counts = {name: {"admitted": 0, "of_them_late": 0} for name in [*TESTS, "exact"]}
    for _ in range(sets):
        streams = random_set(rng, rng.randint(2, 10), rng.uniform(*SHARES))
        in_time = admissible(streams, 1.0)
        counts["exact"]["admitted"] += in_time
        for name, test in TESTS.items():
            if test(streams):
                counts[name]["admitted"] += 1
                counts[name]["of_them_late"] += not in_time
    return counts


def cost(rng: random.Random, size: int) -> dict[str, float]:
    """Return the time of one analysis of so many streams that are all in time; a refusal is quicker."""
    times_s: list[float] = []
    while len(times_s) < TIMED_SETS:
        streams = random_set(rng, size, rng.uniform(*SHARES))
        begun_s = time.perf_counter()
        if admissible(streams, 1.0):
            times_s.append(time.perf_counter() - begun_s)
    return summary(times_s)


def main() -> None:
    """Compare and measure."""
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--sets", type=int, default=5000)
    options.add_argument("--seed", type=int, default=1)
    given = options.parse_args()
    rng = random.Random(given.seed)
    report(
        "admission",
        sets=given.sets,
        seed=given.seed,
        tests=compare(rng, given.sets),
        one_analysis={str(size): cost(rng, size) for size in SIZES},
    )


if __name__ == "__main__":
    main()
