"""The rooms of the missions that come with the project: the papers' figures, and what else there is to see."""

import math
from pathlib import Path

import msgspec
import pytest
from examples import some

from backbone.mission.reader import read_mission
from scout_model.camera import Camera
from scout_model.description import WorldDescription
from scout_model.world import World

PROJECT = Path(__file__).parents[2]
EXAMPLES = sorted((PROJECT / "docs" / "examples").glob("*.xml"))
MISSIONS = [path for path in (PROJECT / "mission.xml", *EXAMPLES) if "<world" in path.read_text()]


@pytest.fixture(autouse=True)
def _classes_beside_a_mission_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(PROJECT / "docs" / "examples")


def world_of(mission: Path) -> World:
    [component] = read_mission(mission).components
    return World(msgspec.convert(component.parameters["world"], WorldDescription))


@pytest.mark.parametrize("mission", some(MISSIONS), ids=lambda path: path.stem)
def test_every_scout_stands_on_its_wheels_and_sees_something(mission: Path) -> None:
    [component] = read_mission(mission).components
    described = msgspec.convert(component.parameters["world"], WorldDescription)
    world = World(described)
    while world.time_s < 2.0:
        world.step_frame()
    with Camera(world.mjcf, "paint") as camera:
        camera.show(world.state())
        for scout in described.robots:
            assert world.is_upright(scout.name)
            if not scout.carried_by:
                x_m, y_m, _ = world.pose(scout.name)
                assert math.dist((x_m, y_m), (scout.x_m, scout.y_m)) < 0.02
            assert camera.picture(scout.name).std() > 3.0


def test_the_person_crosses_in_the_time_of_the_paper() -> None:
    """RAM 2002: it generally takes 7-8 s to walk this distance and then another 7-8 s to walk back."""
    world, arrived_s, back_s = world_of(PROJECT / "docs" / "examples" / "person.xml"), 0.0, 0.0
    while world.time_s < 40.0:
        world.step_frame()
        x_m = world.pose("person")[0]
        if not arrived_s and x_m == pytest.approx(9.0):
            arrived_s = world.time_s
        if arrived_s and x_m == pytest.approx(0.0, abs=1e-6) and not back_s:
            back_s = world.time_s
    assert 7.0 <= arrived_s - 5.0 <= 8.0
    assert 7.0 <= back_s - arrived_s - 8.0 <= 8.0


def test_the_carrier_sets_down_three_scouts_and_leaves() -> None:
    world = world_of(PROJECT / "docs" / "examples" / "deployment.xml")
    while world.time_s < 70.0:
        world.step_frame()
    assert not any(world.is_carried(f"scout{number}") for number in (1, 2, 3))
    assert all(world.is_upright(f"scout{number}") for number in (1, 2, 3))
    assert world.pose("carrier")[0] == pytest.approx(0.4)
