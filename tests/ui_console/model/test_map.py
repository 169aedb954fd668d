"""The map: where bodies are and were, how old that is, what robots see, and what their radio does."""

from __future__ import annotations

import math

import pytest
from console_scenes import SCHEDULE, component
from hypothesis import given
from hypothesis import strategies as st

from backbone.component.abilities import Abilities, CameraForm
from backbone.component.messages import Statistics
from backbone.component_database.messages import ComponentType, TypeCount, Types
from backbone.naming import Subsystem
from resource_pool.arc_client import FloorPlan, FloorShape, Pose, PoseSource, ShapeKind
from ui_console.model.events import Heard, Said
from ui_console.model.floor_pick import NoFloorThere
from ui_console.model.map import STALE_S, TRAIL_POINTS, BodyView
from ui_console.model.team import TeamModel

PLAN = FloorPlan(6.0, 4.0, [FloorShape("table", ShapeKind.FURNITURE, 1.0, 2.0, 0.8, 0.4, 0.3)])
CAMERA = CameraForm(forward_m=0.0, height_m=0.2, tilt_rad=0.0, across_rad=math.radians(40.0))
TYPES = Types(
    [
        TypeCount(ComponentType(name, "x:Y", Subsystem.RESOURCE_POOL, abilities=abilities), 1)
        for name, abilities in (("scout", Abilities(camera=CAMERA)), ("capture", Abilities(gives_pictures=True)))
    ]
)


def team(*said: Said) -> TeamModel:
    made = TeamModel("iros2001")
    for message in (SCHEDULE, *said):
        made.apply(Heard(8.0, message))
    return made


def pose(at_s: float, x_m: float, y_m: float = 1.0, body: str = "scout1", **more: object) -> Pose:
    return Pose(body, at_s, x_m, y_m, 0.5, **more)  # type: ignore[arg-type]


def body(made: TeamModel, now_s: float, name: str = "scout1") -> BodyView:
    return next(view for view in made.map.views(now_s) if view.name == name)


def test_the_source_and_spread_of_a_place_are_told_and_an_old_place_is_marked_with_its_age() -> None:
    made = team(pose(8.0, 1.0, source=PoseSource.LANDMARK, spread_m=0.05), pose(8.0, 3.0, body="guest"))
    fresh = body(made, 8.0 + STALE_S)
    assert (fresh.source, fresh.spread_m, fresh.is_robot) == ("by a landmark", 0.05, True)
    assert (fresh.is_stale, fresh.age_s) == (False, 0.0)
    old = body(made, 20.0)
    assert (old.is_stale, old.age_s) == (True, 12.0)
    assert not body(made, 8.0, "guest").is_robot


def test_a_message_older_than_the_last_one_moves_nothing() -> None:
    made = team(pose(9.0, 2.0), pose(8.5, 1.0))
    assert body(made, 9.0).x_m == 2.0


@given(st.lists(st.tuples(st.floats(0, 10), st.floats(0, 10)), min_size=1, max_size=300))
def test_a_trail_is_bounded_and_ends_near_the_body(way: list[tuple[float, float]]) -> None:
    made = team(*(pose(8.0 + 0.1 * number, *at) for number, at in enumerate(way)))
    view = body(made, 40.0)
    assert 2 <= len(view.trail) <= 2 * TRAIL_POINTS
    assert math.dist(view.trail[-2:], way[-1]) < 0.07
    assert body(team(*(pose(8.0 + number, 1.0) for number in range(9))), 20.0).trail == [1.0, 1.0], "it stands"


def test_a_robot_sees_while_its_holder_gets_pictures() -> None:
    made = team(pose(8.0, 1.0), pose(8.0, 1.0, body="scout2"), TYPES)
    assert body(made, 8.0).sees_rad == 0.0, "the kind of its holder is not known"
    made.apply(Heard(8.0, component("resource_pool/watch1-capture", "capture")))
    assert body(made, 8.0).sees_rad == CAMERA.across_rad
    assert body(made, 8.0, "scout2").sees_rad == 0.0, "nobody holds it"


def test_what_its_radio_loses_stands_with_the_robot() -> None:
    made = team(pose(8.0, 1.0))
    assert body(made, 8.0).link == ""
    made.apply(Heard(8.0, Statistics({"overruns_watch1-capture": 2.0}), "resource_pool/radio"))
    assert body(made, 8.0).link == "radio: 2 packets late or lost"


def test_what_the_holder_of_a_robot_does_stands_with_the_robot_whoever_ordered_it() -> None:
    made = team(pose(8.0, 1.0), pose(8.0, 1.0, body="scout2"))
    assert body(made, 8.0).does == ""
    made.apply(Heard(8.0, component("mission_control/watch1", "go_to", feedback="goes to 3, 2: 1.4 m left")))
    assert body(made, 8.0).does == "goes to 3, 2: 1.4 m left"
    assert body(made, 8.0, "scout2").does == "", "nobody holds it"


def test_without_a_plan_the_floor_holds_every_body_and_a_plan_takes_its_place() -> None:
    assert team().map.floor is None
    made = team(pose(8.0, 3.4, 0.2))
    assert made.map.floor == FloorPlan(4.0, 2.0)
    assert made.map.floor is made.map.floor
    made.apply(Heard(9.0, PLAN))
    assert made.map.floor is PLAN
    made.apply(Heard(9.0, FloorPlan(0.0, 0.0, PLAN.shapes)))
    assert made.map.floor == FloorPlan(4.0, 2.0, PLAN.shapes), "a plan without an extent"


def test_a_point_in_a_picture_is_where_the_robot_stood_when_the_picture_was_taken() -> None:
    made = team(TYPES, PLAN, *(Pose("scout1", 8.0 + number, 1.0 + number, 1.0, 0.0) for number in range(3)))
    early, late = (made.map.pick("scout1", 159.5, 200.0, (320, 240), at_s) for at_s in (8.1, 12.0))
    assert early[0] == pytest.approx(late[0] - 2.0)
    assert early[1] == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("said", "robot", "why"),
    [
        ([TYPES], "scout1", "no localizer knows"),
        ([pose(8.0, 1.0)], "scout1", "declares no camera"),
        ([TYPES, FloorPlan(1.2, 1.2), pose(8.0, 1.0)], "scout1", "outside of the room"),
        ([TYPES, pose(8.0, 1.0, body="nobody")], "nobody", "declares no camera"),
    ],
)
def test_where_no_place_can_be_told_the_refusal_says_why(said: list[Said], robot: str, why: str) -> None:
    with pytest.raises(NoFloorThere, match=why):
        team(*said).map.pick(robot, 159.5, 180.0, (320, 240), 8.0)
