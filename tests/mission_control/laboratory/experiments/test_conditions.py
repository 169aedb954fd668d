"""Conditions, and the mission files made of them."""

from __future__ import annotations

import pytest
from examples import share
from hypothesis import example, given, settings
from hypothesis import strategies as st

from mission_control.laboratory.experiments.conditions import (
    EVERYTHING,
    Condition,
    ImpossibleCondition,
    checked,
    load_conditions,
)
from mission_control.laboratory.experiments.geometry import EXTRAS, WATCHERS
from mission_control.laboratory.experiments.mission_file import mission_of, mission_of_trial, mission_text
from mission_control.laboratory.experiments.trial import draw


@pytest.mark.parametrize(
    ("wrong", "why"),
    [
        ({"active": 0}, "active"),
        ({"active": len(WATCHERS) + 1}, "active"),
        ({"extra": len(EXTRAS) + 1}, "extra"),
        ({"policy": "best"}, "best"),
        ({"speed_m_s": -1.0}, "speed_m_s"),
        ({"speed_m_s": 1e-300}, "speed_m_s"),
        ({"slice_s": 1e-300}, "slice_s"),
        ({"driven": 1.5}, "driven"),
        ({"moon": True}, "moon"),
    ],
)
def test_what_is_impossible_is_refused_by_name(wrong: dict[str, object], why: str) -> None:
    with pytest.raises(ImpossibleCondition, match=why):
        checked(**wrong)


@pytest.mark.parametrize("order", ["active-first", "extra-first", "interleaved"])
@pytest.mark.parametrize("extra", [0, 1, 3])
def test_everybody_has_one_place_in_the_order(order: str, extra: int) -> None:
    condition = checked(order=order, extra=extra)
    assert sorted(condition.in_turn) == sorted(condition.robots)


def test_each_condition_is_a_mission_without_faults() -> None:
    for condition in (*EVERYTHING, *load_conditions(), checked(channels=4, active=5, extra=10)):
        mission = mission_of(condition)
        assert len(mission.behaviors) == condition.active
        assert sum(one.type == "scout" for one in mission.resources) == condition.active + condition.extra


@settings(max_examples=share(20))
@example(5.0, 0.5, 0.00001)
@given(st.floats(0.1, 600.0), st.floats(0.01, 10.0), st.floats(0.0, 10.0))
def test_every_possible_number_is_one_in_the_mission_file(slice_s: float, speed_m_s: float, noise: float) -> None:
    mission = mission_of(checked(slice_s=slice_s, speed_m_s=speed_m_s, noise=noise))
    world = mission.components[0].parameters["world"]
    assert mission.behaviors[0].arc is not None
    assert mission.behaviors[0].arc.minimum_runtime_s == pytest.approx(slice_s, abs=1e-9)
    assert world["targets"][0]["speed_m_s"] == pytest.approx(speed_m_s, abs=1e-9)
    assert world["air"]["noise"] == pytest.approx(noise, abs=1e-9)


def test_all_conditions_of_one_table_share_their_geometry() -> None:
    def watchers(condition: Condition) -> list[str]:
        return [line for line in mission_text(condition).splitlines() if "<robot name=" in line][: condition.active]

    assert len({tuple(watchers(condition)) for condition in EVERYTHING}) == 1


def test_a_trial_s_mission_differs_only_in_seed_and_departure() -> None:
    condition = Condition(extra=1)
    first, second = (mission_of_trial(condition, seed, 3.0).components[0].parameters["world"] for seed in (1, 2))
    assert (first["seed"], second["seed"]) == (1, 2)
    assert {**first, "seed": 0} == {**second, "seed": 0}
    assert first["targets"][0]["begin_s"] == 3.0


def test_phases_are_spread_over_the_whole_round() -> None:
    condition = Condition(extra=3)
    drawn = [draw(condition, 1, number) for number in range(400)]
    assert {one.first for one in drawn} == set(range(5))
    rest = [one.departs_frame / 30.0 for one in drawn]
    assert 0 <= min(rest) < 0.2
    assert 5.0 < max(rest) <= 5.302 + 1 / 30


def test_the_same_seed_draws_the_same() -> None:
    assert draw(Condition(), 3, 7) == draw(Condition(), 3, 7) != draw(Condition(), 4, 7)
