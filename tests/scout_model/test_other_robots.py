"""Another kind of robot is one MJCF, one class, and its class path in the mission file."""

import math
import sys
from collections.abc import Iterator
from pathlib import Path

import msgspec
import pytest

from backbone.mission.reader import read_mission
from scout_model import radio_link
from scout_model.camera import Camera
from scout_model.description import SCOUT, RobotPlace, WorldDescription
from scout_model.errors import InvalidWorld, UnknownBody, UnstableBody
from scout_model.robot import Robot, robot_class
from scout_model.scout import Scout, Spring
from scout_model.world import World


@pytest.fixture(autouse=True)
def _robots_can_be_imported(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.syspath_prepend(str(Path(__file__).parent))
    yield
    sys.modules.pop("rover", None)


def world(kind: str = "rover:Rover") -> World:
    places = [
        RobotPlace("rover1", 1, 3.0, 3.0, 0.0, kind),
        RobotPlace("scout1", 2, 5.0, 3.0, 0.0),
        RobotPlace("rover2", 3, 3.0, 4.0, 0.0, kind),
    ]
    return World(WorldDescription(9.0, 6.0, robots=places))


def test_the_scout_is_one_kind_among_others() -> None:
    assert robot_class(SCOUT) is Scout
    assert isinstance(Scout(), Robot)


class Unheard(Scout):
    async def hear(self, payload: bytes, now_s: float) -> None:  # type: ignore[override]
        pass


def test_a_robot_whose_methods_would_not_be_awaited_is_refused() -> None:
    with pytest.raises(InvalidWorld, match="Unheard is no kind of robot: hear is an 'async def'; write it as a 'def'"):
        robot_class(f"{__name__}:Unheard")


def test_a_rover_hears_its_packets_drives_and_stops_beside_scouts() -> None:
    room = world()
    for frame in range(60):
        room.hear(1, radio_link.encode_drive(4.0, 4.0))
        if frame % 5 == 0:
            room.hear(2, radio_link.encode_drive(10.0, 10.0))
        room.step_frame()
    x_m, y_m, heading_rad = room.pose("rover1")
    assert x_m == pytest.approx(3.0 + 4.0 * 0.05 * 2.0, rel=0.08)
    assert (y_m, heading_rad) == pytest.approx((3.0, 0.0), abs=0.01)
    assert room.motors("rover1") == pytest.approx(0.4)
    assert room.pose("scout1")[0] > 5.3
    assert room.pose("rover2")[0] == pytest.approx(3.0, abs=0.01)
    assert room.is_asleep("rover2")
    room.hear(1, radio_link.encode_halt())
    for _ in range(90):
        room.step_frame()
    assert room.is_asleep("rover1")


def test_a_rovers_transmitter_and_camera_are_the_worlds() -> None:
    room = world()
    room.hear(1, radio_link.encode_transmitter_on("video7"))
    room.hear(1, b"noise")
    room.step_frame()
    assert room.transmitting() == {"rover1": "video7"}
    with Camera(room.mjcf, "paint") as camera:
        empty = camera.picture("rover2")
        assert camera.picture("rover1").std() > 10
        assert (camera.picture("rover1") != empty).any()


def test_in_a_mission_file_it_is_one_attribute(tmp_path: Path) -> None:
    small = Path(__file__).parents[1] / "backbone" / "mission" / "small.xml"
    mission = tmp_path / "mission.xml"
    mission.write_text(small.read_text().replace('<robot name="scout1"', '<robot name="scout1" class="rover:Rover"', 1))
    [component] = read_mission(mission).components
    room = World(msgspec.convert(component.parameters["world"], WorldDescription))
    before = room.pose("scout1")
    for _ in range(30):
        room.hear(1, radio_link.encode_drive(-4.0, -4.0))
        room.step_frame()
    assert room.pose("scout1") != pytest.approx(before, abs=0.1)
    with pytest.raises(UnknownBody):
        room.spring("scout1")
    assert room.spring("scout2") is Spring.WOUND


def test_what_only_scouts_have_is_refused_of_a_rover() -> None:
    with pytest.raises(UnknownBody, match="no Scout named 'rover1'"):
        world().spring("rover1")


@pytest.mark.parametrize(
    ("kind", "told"),
    [
        ("rover", "class path"),
        ("rover:Submarine", "Submarine"),
        ("submarine:Submarine", "submarine"),
        ("rover:Bodiless", "body_mjcf"),
        ("rover:RADIUS_M", "no kind of robot"),
        ("rover:Broken", "the body of rover1"),
    ],
)
def test_what_is_no_robot_is_refused_with_its_name(kind: str, told: str) -> None:
    with pytest.raises(InvalidWorld, match=told):
        world(kind)


def test_a_class_that_drives_what_its_body_has_not_is_told_so() -> None:
    with pytest.raises(InvalidWorld, match="'rudder'"):
        world("rover:Driverless").step_frame()


def drives_for_a_second(room: World) -> None:
    for _ in range(30):
        for network_id in (1, 2, 3):
            room.hear(network_id, radio_link.encode_drive(8.0, 8.0))
        room.step_frame()


@pytest.mark.parametrize("given", [math.nan, math.inf, -math.inf, 1e308])
def test_an_impossible_control_ends_the_world_with_its_name(given: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """MuJoCo would go on with all controls at zero: those of the other robots too."""
    room = world("rover:Confused")
    monkeypatch.setattr(sys.modules["rover"].Confused, "gives", given)
    with pytest.raises(UnstableBody, match=r"rover1 \(rover:Confused\) sets its actuator 'left' to"):
        drives_for_a_second(room)


def test_a_body_that_cannot_be_computed_ends_the_world_with_its_name() -> None:
    """MuJoCo would go on with every robot back at its beginning, and with all controls at zero."""
    with pytest.raises(UnstableBody, match=r"rover[13] \(rover:Trembling\) .* joint '(free|left|right)'"):
        drives_for_a_second(world("rover:Trembling"))
