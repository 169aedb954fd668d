"""What the geometry promises."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest

from mission_control.experiments.conditions import PUBLISHED, Condition
from mission_control.experiments.intervals import wilson
from mission_control.experiments.prediction import Bursts, predicted

FEW = 800


@pytest.mark.parametrize("condition", [one for one in PUBLISHED if PUBLISHED[one].trials], ids=Condition.title)
def test_it_lies_in_the_interval_of_what_the_papers_counted(condition: Condition) -> None:
    given = PUBLISHED[condition]
    low, high = wilson(given.detected, given.trials)
    assert low <= predicted(condition, FEW) <= high


def test_it_falls_with_load() -> None:
    rates = [predicted(Condition(extra=extra), FEW) for extra in range(6)]
    assert all(later < earlier + 0.02 for earlier, later in pairwise(rates))
    assert rates[5] < rates[0] / 2


def test_two_channels_without_noise_and_extra_robots_miss_nothing() -> None:
    assert predicted(Condition(channels=2, noise=0.0), FEW) == 1.0


def test_noise_costs_detections() -> None:
    assert predicted(Condition(noise=4.0), FEW) < predicted(Condition(), FEW) < predicted(Condition(noise=0.0), FEW)


def test_the_same_condition_gives_the_same_number() -> None:
    first = predicted(Condition(extra=2), 100)
    predicted.cache_clear()
    assert predicted(Condition(extra=2), 100) == first


def test_bad_frames_come_in_bursts_of_the_papers_length_and_share() -> None:
    bursts = Bursts(1.0, Random(1))
    frames = [bursts.next_is_bad() for _ in range(40_000)]
    begun = sum(now and not before for before, now in pairwise(frames))
    assert sum(frames) / len(frames) == pytest.approx(0.25, abs=0.02)
    assert sum(frames) / begun / 15.0 == pytest.approx(0.15, abs=0.01)


def test_without_noise_no_frame_is_bad() -> None:
    bursts = Bursts(0.0, Random(1))
    assert not any(bursts.next_is_bad() for _ in range(1000))
