"""What the geometry promises."""

from __future__ import annotations

from itertools import pairwise
from random import Random

import pytest
from examples import some

from mission_control.laboratory.experiments.conditions import PUBLISHED, Condition
from mission_control.laboratory.experiments.intervals import wilson
from mission_control.laboratory.experiments.prediction import Bursts, departs_s, predicted

FEW = 800
FEWER = 300  # where rates are far apart


@pytest.mark.parametrize("condition", some(one for one in PUBLISHED if PUBLISHED[one].trials), ids=Condition.title)
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


@pytest.mark.parametrize(("driven", "goals"), [(1.0, (0.95, 0.82, 0.75, 0.60)), (0.25, (0.95, 0.90, 0.85, 0.80))])
def test_better_requests_detect_more_on_the_same_frequency(driven: float, goals: tuple[float, ...]) -> None:
    for extra, goal in enumerate(goals):
        better = predicted(Condition(extra=extra, driven=driven, policy="adaptive"), FEWER)
        assert better >= goal
        assert better > predicted(Condition(extra=extra), FEWER)


@pytest.mark.parametrize("speed_m_s", some([0.35, 0.42, 0.6, 0.75, 0.9]))
def test_better_requests_detect_more_at_every_speed(speed_m_s: float) -> None:
    better, papers = (
        predicted(Condition(extra=2, speed_m_s=speed_m_s, policy=policy), FEWER) for policy in ("adaptive", "paper")
    )
    assert better > papers + 0.1


def test_a_target_departs_within_the_first_round_of_turns() -> None:
    assert departs_s(Condition(extra=1), 0.0) == 0.0
    assert departs_s(Condition(extra=1), 1.0) == pytest.approx(3 * 5.3)


def test_a_target_departs_within_a_round_of_equal_time_once_drawn_times_have_come_apart() -> None:
    condition = Condition(extra=1, policy="adaptive")
    round_s = 2 * 2.0 / 0.8 * 1.1 + 2.3
    assert departs_s(condition, 0.0) == pytest.approx(round_s / 2, rel=0.01)
    assert departs_s(condition, 1.0) == pytest.approx(1.5 * round_s, rel=0.01)


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
