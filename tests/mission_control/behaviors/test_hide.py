"""Hiding: the search in a played room, then the behavior in the simulated one, taken over on the way."""

from __future__ import annotations

import math

import msgspec
import numpy as np
import pytest
from behaviors_at_work import FEW_MOMENTS, MANY_MOMENTS, Person, at_work, driving, example, filmed_at, pose, wait_until
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from backbone.bus.clock import run_virtual
from mission_control.behaviors.dark_search import (
    VIEW_COLUMNS,
    VIEW_ROWS,
    DarkSearch,
    Glimpse,
    SearchStage,
    glimpse,
    is_same_view,
    sectors,
)
from mission_control.behaviors.hide import Hide, HideParameters
from mission_control.behaviors.motion import STILL, FloorPoint, Motion, Position, turned
from mission_control.messages import BehaviorStatus

NAME, ROBOT = "hide-scout4", "scout4"
STEP_S = 0.1
PATTERN = np.random.default_rng(5).uniform(-12.0, 12.0, (VIEW_ROWS, 2))
DARK, RADIUS_M = FloorPoint(3.0, 3.0), 0.7


class PlayedRoom:
    """A round dark place in an endless bright plain; the view turns with the robot and changes as it moves."""

    def __init__(self, position: Position) -> None:
        self.position, self.now_s = position, 0.0

    def seen(self) -> Glimpse:
        at = self.position
        to_dark_rad = abs(DARK.bearing_rad(at))
        ahead = 100.0 - 50.0 * math.exp(-((to_dark_rad / 0.5) ** 2)) if self.distance_m > RADIUS_M else 60.0
        near = Position(at.x_m + 0.18 * math.cos(at.heading_rad), at.y_m + 0.18 * math.sin(at.heading_rad), 0.0)
        angles = at.heading_rad + np.linspace(0.35, -0.35, VIEW_COLUMNS)
        rows = [np.sin((5 + row) * angles + x * at.x_m + y * at.y_m) for row, (x, y) in enumerate(PATTERN)]
        ground = 30.0 if DARK.distance_m(near) < RADIUS_M else 110.0
        return Glimpse(ahead, ground, (100 + 60 * np.array(rows)).astype(np.float32))

    @property
    def distance_m(self) -> float:
        return DARK.distance_m(self.position)

    def obey(self, told: Motion) -> None:
        at = self.position
        half_rad = at.heading_rad + told.turn_rad_s * STEP_S / 2
        gone_m = told.forward_m_s * STEP_S
        self.now_s += STEP_S
        self.position = Position(
            at.x_m + gone_m * math.cos(half_rad),
            at.y_m + gone_m * math.sin(half_rad),
            turned(at.heading_rad + told.turn_rad_s * STEP_S),
        )


def dark_search(looks: int = 0) -> DarkSearch:
    return DarkSearch(dark_level=60.0, leg_m=0.6, speed_m_s=0.2, looks=looks)


def go_on(search: DarkSearch, room: PlayedRoom, lasts_s: float) -> None:
    until_s = room.now_s + lasts_s
    while room.now_s < until_s and not search.is_final:
        room.obey(search.decide(room.seen(), room.now_s))


near_the_dark = st.builds(Position, st.floats(1.5, 4.5), st.floats(1.5, 4.5), st.floats(-math.pi, math.pi))


@settings(max_examples=share(12))
@given(near_the_dark)
def test_from_anywhere_near_it_ends_in_the_dark_and_looks_out(begin: Position) -> None:
    search, room = dark_search(), PlayedRoom(begin)
    go_on(search, room, 600.0)
    assert search.stage is SearchStage.HIDDEN
    assert room.distance_m < RADIUS_M
    assert search.decide(room.seen(), room.now_s) == STILL


@settings(max_examples=share(20))
@given(
    near_the_dark,
    st.lists(st.tuples(st.floats(0.0, 30.0), st.floats(0.0, 20.0), st.none() | near_the_dark), max_size=4),
)
def test_suspended_and_moved_at_any_moment_it_ends_in_the_dark_and_forgets_no_look(
    begin: Position, disturbances: list[tuple[float, float, Position | None]]
) -> None:
    search, room = dark_search(), PlayedRoom(begin)
    for after_s, lasts_s, left_at in disturbances:
        go_on(search, room, after_s)
        looks = search.looks
        search.interrupt()
        room.now_s += lasts_s
        room.position = room.position if search.is_final else left_at or room.position
        assert search.looks == looks
    go_on(search, room, 900.0)
    assert search.stage is SearchStage.HIDDEN
    assert room.distance_m < RADIUS_M


def test_a_look_around_goes_on_over_many_short_slices_if_the_robot_is_not_moved() -> None:
    search, room = dark_search(), PlayedRoom(Position(1.5, 1.5, 0.0))
    while search.looks == 0:
        go_on(search, room, 2.0)
        search.interrupt()
        room.now_s += 10.0
        assert room.now_s < 120.0
    assert search.stage in (SearchStage.TURN, SearchStage.GO)


@pytest.mark.parametrize("picture_rate_hz", [1.0, 2.0, 3.0, 4.0, 15.0])
def test_a_look_around_is_one_turn_at_any_picture_rate(picture_rate_hz: float) -> None:
    """A robot obeys a motion for half a second, or until the next picture."""
    search, turned_rad, pictures = dark_search(), 0.0, 0
    seen = PlayedRoom(Position(60.0, 60.0, 0.0)).seen()
    while search.stage is SearchStage.LOOK:
        motion = search.decide(seen, pictures / picture_rate_hz)
        turned_rad, pictures = turned_rad + motion.turn_rad_s * min(0.5, 1 / picture_rate_hz), pictures + 1
    assert 2 * math.pi <= turned_rad < 2 * math.pi + 1.0


def test_a_robot_that_was_carried_away_looks_around_anew() -> None:
    search, room = dark_search(), PlayedRoom(Position(1.5, 1.5, 0.0))
    go_on(search, room, 12.0)
    assert search.stage in (SearchStage.TURN, SearchStage.GO)
    search.interrupt()
    room.position = Position(4.2, 1.4, 2.0)
    go_on(search, room, 2.0)
    assert search.stage is SearchStage.LOOK
    assert search.looks == 1


def test_where_it_is_nowhere_dark_it_gives_up_after_its_looks() -> None:
    search, room = dark_search(looks=3), PlayedRoom(Position(60.0, 60.0, 0.0))
    go_on(search, room, 120.0)
    assert search.stage is SearchStage.FAILED
    assert search.looks == 3


@settings(max_examples=share(30))
@given(arrays(np.uint8, (60, 80)))
def test_a_glimpse_stays_between_the_darkest_and_the_brightest_pixel(picture: np.ndarray) -> None:
    seen = glimpse(picture)
    for level in (seen.ahead, seen.ground, *seen.view.ravel()):
        assert picture.min() - 0.01 <= level <= picture.max() + 0.01


def test_what_is_no_picture_is_refused() -> None:
    with pytest.raises(ValueError, match="40 by 15"):
        glimpse(np.zeros((10, 10), np.uint8))


@settings(max_examples=share(30))
@given(st.integers(-8, 8), st.integers(0, 2**32 - 1))
def test_a_view_that_turned_a_few_degrees_is_the_same_and_another_place_is_not(shift: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    around = rng.uniform(0, 255, (VIEW_ROWS, 60)).astype(np.float32)
    before, now = around[:, 10:50], around[:, 10 + shift : 50 + shift]
    assert is_same_view(before, now + rng.normal(0, 3, now.shape).astype(np.float32))
    assert not is_same_view(before, rng.uniform(0, 255, before.shape).astype(np.float32))


def test_sectors_come_darkest_first_and_only_those_that_were_seen() -> None:
    seen = [(0.1, 90.0, 0.0), (1.8, 40.0, 0.0), (1.9, 50.0, 0.0), (4.0, 60.0, 0.0)]
    ways = sectors(seen)
    assert len(ways) == 3
    assert abs(ways[0] - 1.85) < 0.35
    assert sectors(seen, brightest=True) == ways[::-1]


take_overs = st.lists(st.tuples(st.floats(3.0, 15.0), st.floats(0.2, 2.0)), min_size=1, max_size=2)


def play(disturbances: list[tuple[float, float]]) -> None:
    async def scene() -> None:
        person = Person()
        async with at_work(filmed_at(example(NAME), 10.0), person) as running:
            behavior = running.component(NAME)
            assert isinstance(behavior, Hide)
            await wait_until(running, lambda: behavior.statistics()["times_resumed"], 10.0)
            looks = 0.0
            for after_s, lasts_s in disturbances:
                await running.clock.sleep_s(after_s)
                await person.take_over(ROBOT, driving(4.0, -4.0, lasts_s))
                assert behavior.statistics()["looks"] >= looks
                looks = behavior.statistics()["looks"]
            await wait_until(running, lambda: behavior.status.is_final, 240.0)
            assert behavior.status is BehaviorStatus.SUCCESS, behavior.payload
            assert behavior.statistics()["times_suspended"] >= len(disturbances)
            at = await pose(running, ROBOT)
            assert at.x_m > 7.4
            assert at.y_m < 1.6

    run_virtual(scene())


@FEW_MOMENTS
@given(take_overs)
def test_in_the_world_it_hides_in_the_dark_corner_also_when_taken_over(disturbances: list[tuple[float, float]]) -> None:
    play(disturbances)


@pytest.mark.slow
@pytest.mark.timeout(1800)
@MANY_MOMENTS
@given(take_overs)
def test_in_the_world_it_hides_from_many_more_moments(disturbances: list[tuple[float, float]]) -> None:
    play(disturbances)


@pytest.mark.parametrize(
    ("given", "complaint"),
    [
        ({"dark_level": 0.0}, "> 0.0 - at .*dark_level"),
        ({"leg_m": 0.0}, "> 0.0 - at .*leg_m"),
        ({"speed_m_s": 1.0}, "<= 0.3 - at .*speed_m_s"),
        ({"looks": -1}, ">= 0 - at .*looks"),
    ],
)
def test_parameters_that_mean_nothing_are_refused_with_the_remedy(given: dict[str, object], complaint: str) -> None:
    with pytest.raises(msgspec.ValidationError, match=complaint):
        msgspec.convert(given, HideParameters)
