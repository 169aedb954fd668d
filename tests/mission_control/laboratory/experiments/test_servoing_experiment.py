"""The servoing experiment: its starts, one trial of it, and that the same seed gives the same."""

from __future__ import annotations

import math

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from typer.testing import CliRunner

from mission_control.laboratory.experiments.cli import app
from mission_control.laboratory.experiments.servoing import (
    BOARD_M,
    FARTHEST_M,
    NEAREST_M,
    OFF_AXIS_RAD,
    ROOM_M,
    STOP_M,
    ServoOrder,
    ServoOutcome,
    ServoTrial,
    draw,
    run_servoing,
    run_trial,
)
from mission_control.vision import servo_law

HIT = ServoTrial(0, 2.0, 10.0, True, 0.02, 3.0, 30.0, 2, 1)


def test_its_place_is_where_the_servo_law_stops() -> None:
    assert STOP_M == servo_law.STOP_M


@given(st.integers(0, 2**31), st.integers(0, 1000))
def test_every_start_is_in_the_room_within_range_and_angle_and_the_same_again(seed: int, number: int) -> None:
    start = draw(seed, number)
    assert start == draw(seed, number)
    ahead_m, aside_m = BOARD_M[0] - start.x_m, start.y_m - BOARD_M[1]
    assert NEAREST_M <= math.hypot(ahead_m, aside_m) <= FARTHEST_M + 1e-9
    assert abs(math.atan2(aside_m, ahead_m)) <= OFF_AXIS_RAD + 1e-9
    assert 0.2 < start.x_m < ROOM_M[0] - 0.2
    assert 0.2 < start.y_m < ROOM_M[1] - 0.2


@pytest.mark.parametrize(
    "missed",
    [
        {"says_arrived": False},
        {"off_m": 0.051},
        {"off_deg": 10.1},
        {"off_deg": -10.1},
    ],
)
def test_a_trial_succeeds_only_within_five_centimeters_and_ten_degrees_and_knowing_it(missed: dict[str, float]) -> None:
    assert HIT.succeeded
    assert not msgspec.structs.replace(HIT, **missed).succeeded


def test_the_outcome_tells_rate_interval_and_every_failure() -> None:
    miss = msgspec.structs.replace(HIT, off_m=0.2, number=1)
    told = ServoOutcome(7, 1.0, (HIT, miss), 1.0).to_json()
    [condition] = told["conditions"]
    assert told["seed"] == 7
    assert told["simulated_s"] == 60.0
    assert (condition["trials"], condition["succeeded"], condition["rate"]) == (2, 1, 0.5)
    assert [failed["number"] for failed in condition["failed"]] == [1]
    assert condition["interval95"][0] < 0.5 < condition["interval95"][1]


@pytest.mark.thorough
def test_a_trial_with_noise_ends_at_its_place_and_the_same_seed_gives_the_same() -> None:
    trial = run_trial(ServoOrder(1, 0, 1.0))
    assert trial.succeeded, trial
    assert run_servoing(trials=1, seed=1, noise=1.0, jobs=1).trials == (trial,)


def test_the_command_refuses_noise_out_of_range() -> None:
    result = CliRunner().invoke(app, ["servoing", "--noise", "11"])
    assert result.exit_code == 2


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_at_least_ninety_five_of_a_hundred_starts_end_within_five_centimeters_and_ten_degrees() -> None:
    outcome = run_servoing(trials=100, seed=1, noise=1.0)
    assert outcome.succeeded >= 95, outcome.to_json()
