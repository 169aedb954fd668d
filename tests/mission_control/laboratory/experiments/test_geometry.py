"""The one geometry of the experiments."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from backbone.mission.reader import read_mission
from mission_control.laboratory.experiments import geometry
from mission_control.laboratory.experiments.geometry import PASSAGES, WATCHERS, Passage, in_view, is_in_view, seen_along
from scout_model.dimensions import HORIZONTAL_VIEW_RAD

SHIPPED = Path(__file__).parents[4] / "mission.xml"


def test_it_is_that_of_the_shipped_mission() -> None:
    mission = read_mission(SHIPPED)
    (world,) = mission.components
    content = world.parameters["world"]
    assert (content["width_m"], content["depth_m"]) == geometry.ROOM_M
    placed = {scout["name"]: (scout["x_m"], scout["y_m"]) for scout in content["robots"]}
    assert (placed["scout1"], placed["scout2"], placed["scout3"]) == (*WATCHERS[:2], geometry.EXTRAS[0])
    (target,) = content["targets"]
    assert [tuple(point) for point in target["path"]] == list(geometry.PATH)
    assert (target["shape"], target["speed_m_s"]) == ("pioneer", geometry.PIONEER.speed_m_s)
    frequency = next(resource for resource in mission.resources if resource.type == "video_frequency")
    assert frequency.connect_s == geometry.SETTLING_S


def test_the_angle_of_view_is_that_of_the_scout_s_camera() -> None:
    assert pytest.approx(HORIZONTAL_VIEW_RAD) == geometry.VIEW_RAD


def test_a_pioneer_is_in_view_of_the_first_scout_shortly_and_of_the_second_longer() -> None:
    (first,) = in_view(PASSAGES["pioneer"], WATCHERS[0])
    (second,) = in_view(PASSAGES["pioneer"], WATCHERS[1])
    assert first[1] - first[0] == pytest.approx(2.65, abs=0.01)
    assert second[1] - second[0] == pytest.approx(4.45, abs=0.01)


def test_a_person_takes_as_long_as_the_paper_says_and_passes_each_view_twice() -> None:
    person = PASSAGES["person"]
    assert 7.0 <= person.lasts_s / 2 <= 8.0
    assert all(len(in_view(person, place)) == 2 for place in WATCHERS)


def test_nobody_sees_a_scout_that_somebody_drives() -> None:
    for extra in geometry.EXTRAS:
        for watcher in WATCHERS:
            ahead_m = extra[1] - watcher[1]
            beside_m = abs(extra[0] - watcher[0])
            assert ahead_m <= 0 or beside_m > ahead_m * math.tan(geometry.VIEW_RAD / 2) + 0.1, (extra, watcher)


@given(st.floats(0.1, 3.0), st.booleans(), st.sampled_from(WATCHERS), st.floats(-5.0, 100.0))
def test_in_view_is_the_same_said_either_way(
    speed: float, back: bool, watcher: tuple[float, float], at_s: float
) -> None:
    passage = Passage("pioneer", speed, back, 0.2)
    intervals = in_view(passage, watcher)
    assert is_in_view(passage, watcher, at_s) == any(begin <= at_s <= end for begin, end in intervals)
    assert all(0 <= begin < end <= passage.lasts_s for begin, end in intervals)


@given(st.floats(0.1, 3.0), st.sampled_from(WATCHERS))
def test_the_way_back_mirrors_the_way_there(speed: float, watcher: tuple[float, float]) -> None:
    passage = Passage("person", speed, True, 0.2)
    there, back = in_view(passage, watcher)
    assert passage.lasts_s - back[1] == pytest.approx(there[0])
    assert passage.lasts_s - back[0] == pytest.approx(there[1])


@given(st.sampled_from(WATCHERS), st.floats(0.0, 0.3))
def test_more_of_the_target_is_in_view_for_less_time(watcher: tuple[float, float], least_m: float) -> None:
    (wide,) = in_view(PASSAGES["pioneer"], watcher)
    (narrow,) = in_view(PASSAGES["pioneer"], watcher, least_m=least_m)
    assert wide[0] <= narrow[0] < narrow[1] <= wide[1]


def test_what_is_seen_lies_on_the_path() -> None:
    first_m, last_m = seen_along(WATCHERS[0], 5.0)
    half_rad = math.radians(20.0)
    assert first_m == 0.0
    assert last_m == pytest.approx(0.72 + 1.236 * math.tan(half_rad) + 5.0 / math.cos(half_rad))
