"""Laws of the gait: no jump, the floor's speed on the floor, standing feet that stand."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise
from statistics import fmean

import pytest
from hypothesis import given
from hypothesis import strategies as st

from resource_pool.robots.walker.gait import (
    ACCELERATION_M_S2,
    LEGS,
    MAX_FORWARD_M_S,
    MAX_TURN_RAD_S,
    RISE_S,
    STANDING,
    TROT,
    TURN_ACCELERATION_RAD_S2,
    WALK,
    Feet,
    Foot,
    Gait,
    GaitParameters,
    ImpossibleGait,
    ImpossibleMove,
    TrunkSpeed,
    clip,
)

DT_S = 0.01
FINE_DT_S = 0.001
moves = st.builds(TrunkSpeed, st.floats(-0.5, 0.5), st.floats(-3.0, 3.0))
some_gaits = st.sampled_from([TROT, WALK]) | st.builds(
    GaitParameters,
    **{name: st.floats(*limits) for name, limits in GaitParameters.RANGES.items()},
    phases=st.tuples(*[st.floats(0.0, 1.0, exclude_max=True)] * 4),
)
scripts = st.lists(st.tuples(moves, st.integers(1, 60)), min_size=1, max_size=6)


def fastest_foot_m_s(gait: GaitParameters) -> float:
    """Return a bound: way in the air, lift, sway, rise into the gait, change of speed, each at its worst at once."""
    swing_s = (1.0 - gait.duty) * gait.period_s
    along = 2.0 * gait.longest_stride_m / swing_s + math.pi * gait.lift_m / swing_s
    home_m = math.dist((gait.half_length_m, gait.half_width_m, gait.height_m), (0.085, 0.08, 0.12))
    radius_m = math.hypot(gait.half_length_m, gait.half_width_m)
    ahead_s = 0.5 * gait.duty * gait.period_s + gait.lead_s
    change = (ACCELERATION_M_S2 + TURN_ACCELERATION_RAD_S2 * radius_m) * ahead_s
    sway = math.tau * gait.sway_m / gait.period_s
    return along + sway + (home_m + gait.lift_m + gait.sway_m) / RISE_S + change


def run(gait: Gait, script: list[tuple[TrunkSpeed, int]], dt_s: float = DT_S) -> list[Feet]:
    feet = []
    for move, steps in script:
        gait.request(move)
        feet += [gait.advance(dt_s) for _ in range(steps)]
    return feet


@given(some_gaits, st.lists(st.tuples(moves, st.integers(1, 400)), min_size=1, max_size=4))
def test_no_request_makes_a_foot_jump(parameters: GaitParameters, script: list[tuple[TrunkSpeed, int]]) -> None:
    bound_m = 1.1 * fastest_foot_m_s(parameters) * FINE_DT_S
    for before, after in pairwise([STANDING, *run(Gait(parameters), script, FINE_DT_S)]):
        assert max(math.dist(one, other) for one, other in zip(before, after, strict=True)) <= bound_m


@pytest.mark.parametrize("parameters", [TROT, WALK])
def test_no_foot_of_a_shipped_gait_is_faster_than_two_and_a_half_metres_a_second(parameters: GaitParameters) -> None:
    assert fastest_foot_m_s(parameters) < 2.5


@pytest.mark.parametrize("parameters", [TROT, WALK])
def test_a_foot_lifts_off_and_touches_down_with_the_floors_speed(parameters: GaitParameters) -> None:
    gait, dt_s = Gait(parameters), 1e-4
    run(gait, [(TrunkSpeed(0.3, 0.5), 100)])
    places = [gait.advance(dt_s) for _ in range(int(parameters.period_s / dt_s))]
    for leg in range(len(LEGS)):
        ways = [[b - a for a, b in zip(one[leg], other[leg], strict=True)] for one, other in pairwise(places)]
        assert max(math.dist(one, other) for one, other in pairwise(ways)) / dt_s < 0.02


@given(some_gaits, scripts)
def test_a_gait_that_is_stopped_ends_in_the_standing_posture(
    parameters: GaitParameters, script: list[tuple[TrunkSpeed, int]]
) -> None:
    gait = Gait(parameters)
    feet = run(gait, [*script, (TrunkSpeed(), 120)])
    assert feet[-1] == STANDING
    assert gait.is_resting
    assert gait.expected == TrunkSpeed()


@given(some_gaits, moves)
def test_a_foot_on_the_floor_has_the_floors_speed(parameters: GaitParameters, move: TrunkSpeed) -> None:
    """Seen from the trunk, the floor moves against the trunk's motion, to which a sway would be added."""
    parameters = replace(parameters, sway_m=0.0)
    gait = Gait(parameters)
    run(gait, [(move, 150)])
    before, phase = gait.advance(DT_S / 100), gait.phase
    after, motion = gait.advance(DT_S / 100), gait.expected
    for leg in range(len(LEGS)):
        on_floor = all((at - parameters.phases[leg]) % 1.0 < parameters.duty for at in (phase, gait.phase))
        if on_floor and gait.phase > phase:
            (x_m, y_m, z_m), (new_x_m, new_y_m, new_z_m) = before[leg], after[leg]
            assert new_z_m == z_m
            assert (new_x_m - x_m) * 100 / DT_S == pytest.approx(
                -motion.forward_m_s + motion.turn_rad_s * y_m, abs=0.02
            )
            assert (new_y_m - y_m) * 100 / DT_S == pytest.approx(-motion.turn_rad_s * x_m, abs=0.02)


@given(some_gaits, moves)
def test_as_many_feet_are_on_the_floor_as_the_duty_says(parameters: GaitParameters, move: TrunkSpeed) -> None:
    gait = Gait(parameters)
    gait.request(TrunkSpeed(0.05, 0.1) if clip(move, parameters) == TrunkSpeed() else move)
    run_in = [gait.advance(DT_S) for _ in range(60)]
    assert run_in
    rounds = [gait.advance(parameters.period_s / 200) for _ in range(200)]
    lowest_m = -parameters.height_m
    share = sum(foot[2] <= lowest_m + 1e-9 for feet in rounds for foot in feet) / (200 * len(LEGS))
    assert share == pytest.approx(parameters.duty, abs=0.02)


@given(moves, some_gaits)
def test_a_request_that_is_too_fast_keeps_its_curve(move: TrunkSpeed, parameters: GaitParameters) -> None:
    given_up = clip(move, parameters)
    assert abs(given_up.forward_m_s) <= MAX_FORWARD_M_S
    assert abs(given_up.turn_rad_s) <= MAX_TURN_RAD_S
    assert clip(given_up, parameters).forward_m_s == pytest.approx(given_up.forward_m_s)
    bounded = TrunkSpeed(
        max(-MAX_FORWARD_M_S, min(MAX_FORWARD_M_S, move.forward_m_s)),
        max(-MAX_TURN_RAD_S, min(MAX_TURN_RAD_S, move.turn_rad_s)),
    )
    assert given_up.forward_m_s * bounded.turn_rad_s == pytest.approx(given_up.turn_rad_s * bounded.forward_m_s)


@given(some_gaits, scripts)
def test_the_expected_motion_changes_no_faster_than_it_may(
    parameters: GaitParameters, script: list[tuple[TrunkSpeed, int]]
) -> None:
    gait = Gait(parameters)
    for move, steps in script:
        gait.request(move)
        for _ in range(steps):
            before = gait.expected
            gait.advance(DT_S)
            assert abs(gait.expected.forward_m_s - before.forward_m_s) <= ACCELERATION_M_S2 * DT_S + 1e-12
            assert abs(gait.expected.turn_rad_s - before.turn_rad_s) <= TURN_ACCELERATION_RAD_S2 * DT_S + 1e-12


def margin_m(feet: list[Foot]) -> float:
    """Return how far the trunk's middle is inside the polygon of these feet, given in the order round it."""
    sides = zip(feet, [*feet[1:], feet[0]], strict=True)
    return min((ax * by - ay * bx) / math.dist((ax, ay), (bx, by)) for (ax, ay, _), (bx, by, _) in sides)


@pytest.mark.parametrize("move", [TrunkSpeed(0.1), TrunkSpeed(-0.1), TrunkSpeed(0.0, 0.7), TrunkSpeed(0.05, -0.4)])
def test_the_walk_swings_the_trunk_over_the_three_feet_on_the_floor(move: TrunkSpeed) -> None:
    with_sway_m, without_m = (mean_margin_m(one, move) for one in (WALK, replace(WALK, sway_m=0.0)))
    assert with_sway_m > 0.0
    assert with_sway_m > without_m + 0.4 * WALK.sway_m


def mean_margin_m(parameters: GaitParameters, move: TrunkSpeed) -> float:
    """Return how far the trunk's middle is inside the triangle of the feet on the floor, on average."""
    round_the_trunk = [LEGS.index(leg) for leg in ("front_right", "front_left", "hind_left", "hind_right")]
    margins_m = []
    for feet in run(Gait(parameters), [(move, 300)])[60:]:
        on_floor = [feet[leg] for leg in round_the_trunk if feet[leg][2] <= -parameters.height_m + 1e-9]
        if len(on_floor) == 3:
            margins_m.append(margin_m(on_floor))
    return fmean(margins_m)


def test_the_trot_lifts_diagonal_feet_together_and_the_walk_one_at_a_time() -> None:
    for parameters, most in ((TROT, 2), (WALK, 1)):
        gait = Gait(parameters)
        for feet in run(gait, [(TrunkSpeed(0.1), 300)])[60:]:
            lifted = [leg for leg, foot in zip(LEGS, feet, strict=True) if foot[2] > -parameters.height_m]
            assert len(lifted) <= most
            assert set(lifted) <= {"front_left", "hind_right"} or set(lifted) <= {"front_right", "hind_left"}


@pytest.mark.parametrize("name", GaitParameters.RANGES)
def test_a_parameter_outside_its_range_is_refused(name: str) -> None:
    least, most = GaitParameters.RANGES[name]
    for value in (least - 0.01, most + 0.01, float("nan")):
        with pytest.raises(ImpossibleGait, match=name):
            GaitParameters(**{name: value})


def test_a_phase_outside_its_range_is_refused() -> None:
    with pytest.raises(ImpossibleGait, match="phases"):
        GaitParameters(phases=(0.0, 0.5, 1.0, 0.0))


@pytest.mark.parametrize("move", [TrunkSpeed(float("nan")), TrunkSpeed(0.0, float("inf"))])
def test_a_request_that_is_no_number_is_refused_and_changes_nothing(move: TrunkSpeed) -> None:
    gait = Gait()
    gait.request(TrunkSpeed(0.1))
    with pytest.raises(ImpossibleMove):
        gait.request(move)
    assert gait.commanded == TrunkSpeed(0.1)
