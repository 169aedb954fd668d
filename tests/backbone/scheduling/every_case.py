"""A small sharable RC in every case that can happen to it, tick by tick: what analysis must agree with."""

from __future__ import annotations

import itertools
import math
import random
from collections.abc import Iterator, Sequence

from backbone.scheduling.streams import Stream, utilization

PERIODS = (2, 3, 4, 5, 6, 7, 8, 9, 10, 12)
LONGEST_CYCLE = 60  # ticks after which the streams are in step again
MOST_PHASINGS = 800


def small_set(rng: random.Random, *, most: int = 4) -> list[Stream]:
    """Return streams without jitter, of a few ticks each, that are in step again soon and do not ask for too much."""
    count = rng.randint(1, most)
    while True:
        periods = [rng.choice(PERIODS) for _ in range(count)]
        if math.lcm(*periods) > LONGEST_CYCLE or math.prod(periods) > MOST_PHASINGS:
            continue
        packets = [rng.randint(1, max(1, period // 2)) for period in periods]
        streams = [
            Stream(period, packet, rng.randint(packet, 2 * period), 0)
            for period, packet in zip(periods, packets, strict=True)
        ]
        if utilization(streams) <= 1:
            return streams


def worst_over_all_phasings(streams: Sequence[Stream]) -> list[int]:
    """Return the longest response of each stream over all moments at which they can begin."""
    worst = [0] * len(streams)
    for phases in itertools.product(*(range(one.period_us) for one in streams)):
        for place, response in _responses(streams, phases):
            worst[place] = max(worst[place], response)
    return worst


def _responses(streams: Sequence[Stream], phases: Sequence[int]) -> Iterator[tuple[int, int]]:
    """Send packet after packet until everything has repeated; yield each one's stream and response."""
    end = max(phases) + 2 * math.lcm(*(one.period_us for one in streams))
    release = list(phases)
    packets = [one.packet_us for one in streams]
    periods = [one.period_us for one in streams]
    now = 0
    while now < end:
        for place, at in enumerate(release):
            if at <= now:
                now += packets[place]
                yield place, now - at
                release[place] = at + periods[place]
                break
        else:
            now = min(release)


Queue = tuple[int, int, tuple[int, ...]]
"""Ticks until the stream may release again, how many of its packets can be sent, ages of all that wait."""


def worst_over_all_that_can_happen(streams: Sequence[Stream]) -> list[int]:
    """Return the longest response of each stream if each may release whenever its period allows.

    Every state that can be reached is visited: in each tick each stream may release or not, and what was
    released becomes ready at any time within its jitter.
    """
    worst = [0] * len(streams)
    idle: tuple[int, tuple[Queue, ...]] = (0, tuple((0, 0, ()) for _ in streams))
    seen, todo = {idle}, [idle]
    while todo:
        busy, queues = todo.pop()
        choices = [_choices(one, queue) for one, queue in zip(streams, queues, strict=True)]
        for chosen in itertools.product(*choices):
            after = _tick(streams, busy, chosen, worst)
            if after not in seen:
                seen.add(after)
                todo.append(after)
    return worst


def _choices(one: Stream, queue: Queue) -> list[Queue]:
    """Return what may have become of the queue in this tick, before anything is sent."""
    wait, ready, ages = queue
    found = []
    for waiting in [(wait, ages), (one.period_us, (*ages, 0))] if wait == 0 else [(wait, ages)]:
        must = sum(age >= one.jitter_us for age in waiting[1])
        found += [(waiting[0], can, waiting[1]) for can in range(max(ready, must), len(waiting[1]) + 1)]
    return found


def _tick(
    streams: Sequence[Stream], busy: int, chosen: Sequence[Queue], worst: list[int]
) -> tuple[int, tuple[Queue, ...]]:
    """Send what may be sent and let one tick pass."""
    queues = list(chosen)
    if busy == 0:
        for place, (wait, ready, ages) in enumerate(queues):
            if ready:
                busy = streams[place].packet_us
                worst[place] = max(worst[place], ages[0] + busy)
                queues[place] = wait, ready - 1, ages[1:]
                break
    later = tuple((max(0, wait - 1), ready, tuple([age + 1 for age in ages])) for wait, ready, ages in queues)
    return max(0, busy - 1), later
