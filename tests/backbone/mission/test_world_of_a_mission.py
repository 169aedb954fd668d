"""Everything a mission file can put into a world arrives there; a room's own file travels with the mission."""

import math
from pathlib import Path

import msgspec
import pytest

from backbone.mission import document, world_checks
from backbone.mission.reader import MissionInvalid, read_mission
from backbone.mission.room_files import MAX_BYTES
from backbone.ranges import LONGEST_DOCUMENT, wildness
from scout_model import dimensions
from scout_model.description import DarkPlace, Furniture, Landmark, Ramp, WorldDescription
from scout_model.world import World

SMALL = (Path(__file__).parent / "small.xml").read_text()
HALL = '<mujoco model="hall"><worldbody><geom name="pillar" pos="4 4 1" size="0.2"/></worldbody></mujoco>'
CONTENT = """
    <furniture name="desk" x-m="6" y-m="5" width-m="1.4" depth-m="0.8" height-m="0.7" shape="table"/>
    <ramp name="ramp" x-m="6" y-m="2" length-m="1" width-m="0.5" height-m="0.2" heading-deg="90"/>
    <landmark name="home" x-m="8" y-m="1" heading-deg="180"/>
    <dark name="corner" x-m="0.5" y-m="5.5" width-m="1" depth-m="1" height-m="0.6"/>
    <target name="carrier" shape="carrier" speed-m-s="0.5">
      <point x-m="0.5" y-m="4"/>
      <point x-m="8.5" y-m="4"/>
    </target>
"""


def world_of(tmp_path: Path, mission: str) -> WorldDescription:
    file = tmp_path / "mission.xml"
    file.write_text(mission)
    [component] = read_mission(file).components
    return msgspec.convert(component.parameters["world"], WorldDescription)


def with_content(content: str, room: str = "") -> str:
    begin, end = SMALL.index("<room"), SMALL.index("</world>")
    room_end = SMALL.index("/>", begin)
    return f"{SMALL[:room_end]} {room}/>{SMALL[room_end + 2 : end]}{content}{SMALL[end:]}"


def refusal(tmp_path: Path, mission: str) -> str:
    with pytest.raises(MissionInvalid) as caught:
        world_of(tmp_path, mission)
    [fault] = caught.value.faults
    return f"{fault.message} ({fault.remedy})"


def test_every_thing_of_the_file_is_in_the_world(tmp_path: Path) -> None:
    described = world_of(tmp_path, with_content(CONTENT))
    assert Furniture("desk", 6.0, 5.0, 1.4, 0.8, 0.7, "table") in described.furniture
    assert described.ramps == [Ramp("ramp", 6.0, 2.0, 1.0, 0.5, 0.2, math.pi / 2)]
    assert described.landmarks == [Landmark("home", 8.0, 1.0, math.pi)]
    assert described.dark_places == [DarkPlace("corner", 0.5, 5.5, 1.0, 1.0, 0.6)]
    assert World(described).pose("carrier") == (0.5, 4.0, 0.0)


def test_a_carried_scout_says_who_brings_it(tmp_path: Path) -> None:
    mission = with_content(CONTENT)
    begin = mission.index("<robot")
    end = mission.index("/>", begin)
    carried = f'{mission[:begin]}<robot name="scout1" x-m="3" y-m="4.7" carried-by="carrier"{mission[end:]}'
    described = world_of(tmp_path, carried)
    [scout1] = [scout for scout in described.robots if scout.name == "scout1"]
    assert (scout1.carried_by, scout1.kind) == ("carrier", "scout_model.scout:Scout")
    assert World(described).is_carried("scout1")


def test_the_body_of_a_robot_is_that_of_its_type_unless_the_world_names_another(tmp_path: Path) -> None:
    other = SMALL.replace('<robot name="scout1"', '<robot name="scout1" class="scout_model.scout:Firmware"', 1)
    assert [robot.kind for robot in world_of(tmp_path, other).robots][:2] == [
        "scout_model.scout:Firmware",
        "scout_model.scout:Scout",
    ]


def test_a_file_from_before_other_robots_is_still_read(tmp_path: Path) -> None:
    former = SMALL.replace("<robot ", "<scout ")
    assert world_of(tmp_path, former) == world_of(tmp_path, SMALL)


def test_a_robots_battery_is_the_files_or_its_kinds(tmp_path: Path) -> None:
    described = world_of(tmp_path, SMALL.replace('<robot name="scout1"', '<robot name="scout1" battery-j="450000"', 1))
    assert {scout.name: scout.battery_j for scout in described.robots} == {"scout1": 450_000.0, "scout2": None}
    for wrong in ("0", "-3", "1000000001", "full"):
        text = SMALL.replace('<robot name="scout1"', f'<robot name="scout1" battery-j="{wrong}"', 1)
        assert "battery-j" in refusal(tmp_path, text)


def test_a_room_of_ones_own_travels_with_the_mission(tmp_path: Path) -> None:
    (tmp_path / "rooms").mkdir()
    (tmp_path / "rooms" / "hall.xml").write_text(HALL)
    described = world_of(tmp_path, with_content("", 'mjcf="rooms/hall.xml"'))
    (tmp_path / "rooms" / "hall.xml").unlink()
    assert described.mjcf == HALL
    assert "room/pillar" in World(described).mjcf


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("<mujoco>", "not well-formed XML"),
        ("<robot/>", "begins with <robot>"),
        ('<mujoco><include file="walls.xml"/></mujoco>', "needs the file 'walls.xml' in line 1"),
        ('<mujoco><asset>\n<texture name="t" file="t.png"/></asset></mujoco>', "needs the file 't.png' in line 2"),
        ("<!DOCTYPE mujoco><mujoco/>", "document type declaration"),
        ("<mujoco/>" + " " * MAX_BYTES, "is larger than"),
        ("\udcff", "no UTF-8"),
        ("<\0m\0u\0j\0o\0c\0o\0 \0a\0=\0'\0'\0/\0>\0", "no UTF-8"),
    ],
)
def test_a_room_file_that_cannot_be_used_is_refused_with_a_remedy(tmp_path: Path, content: str, told: str) -> None:
    (tmp_path / "hall.xml").write_bytes(content.encode(errors="surrogateescape"))
    message = refusal(tmp_path, with_content("", 'mjcf="hall.xml"'))
    assert told in message
    assert message.endswith(")")


def test_the_largest_room_and_the_largest_mission_file_fit_into_a_message(tmp_path: Path) -> None:
    (tmp_path / "hall.xml").write_text(HALL + " " * (MAX_BYTES - len(HALL)))
    assert wildness(world_of(tmp_path, with_content("", 'mjcf="hall.xml"')).mjcf) == ""
    assert document.MAX_BYTES <= LONGEST_DOCUMENT


def test_a_folder_is_no_room(tmp_path: Path) -> None:
    assert "is no file" in refusal(tmp_path, with_content("", 'mjcf="."'))


def test_what_a_carrier_and_a_table_are_is_what_the_world_takes_them_for() -> None:
    assert world_checks.NEAREST_SET_DOWN_M == dimensions.NEAREST_SET_DOWN_M
    assert world_checks.FARTHEST_SET_DOWN_M == dimensions.FARTHEST_SET_DOWN_M
    assert world_checks.CARRIER_PLACES == dimensions.CARRIER_PLACES
    just_a_table = Furniture("t", 1.0, 1.0, 0.101, 0.101, 0.031, "table")
    assert World(WorldDescription(9.0, 6.0, furniture=[just_a_table])).mjcf


@pytest.mark.parametrize("has_class", [True, False])
def test_a_body_that_lacks_a_method_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, has_class: bool
) -> None:
    """It is named in the world, or by the class of the robot's RC."""
    monkeypatch.syspath_prepend(tmp_path)
    name = f"own_body_{has_class}".lower()
    (tmp_path / f"{name}.py").write_text(
        "from resource_pool.rcs.scout import Scout\n"
        f"class Rc(Scout):\n    body_class = '{name}:Body'\n"
        "class Body:\n    frequency, motors = '', 0.0\n    def hear(self, payload, now_s): ...\n"
    )
    no_world = 'name="simulated_world" class="backbone.component.component:Component"'
    text = SMALL.replace(no_world, 'name="simulated_world" class="resource_pool.simulated_world:SimulatedWorld"')
    robot = '<robot name="scout1" '
    if has_class:
        text = text.replace(robot, f'{robot}class="{name}:Body" ')
    else:
        text = text.replace('"resource_pool.rcs.scout:Scout"', f'"{name}:Rc"')
    with pytest.raises(MissionInvalid) as caught:
        world_of(tmp_path, text)
    told = {fault.message for fault in caught.value.faults}
    assert told == {f"{name}:Body is no kind of robot: it lacks body_mjcf, controls"}


@pytest.mark.parametrize(
    ("mjcf", "told"),
    [
        ("<mujoco><worldbody>", "cannot be built: XML parse error"),
        (
            "<mujoco><worldbody><body name='body'><freejoint name='free'/></body></worldbody></mujoco>",
            "mass and inertia",
        ),
        ("<mujoco><worldbody><body name='cart'/></worldbody></mujoco>", 'has no <body name="body">'),
    ],
    ids=["no MJCF", "without mass", "without its root"],
)
def test_a_body_that_mujoco_cannot_build_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest, mjcf: str, told: str
) -> None:
    monkeypatch.syspath_prepend(tmp_path)
    name = f"own_mjcf_{request.node.callspec.id.replace(' ', '_').lower()}"
    (tmp_path / f"{name}.py").write_text(
        "from scout_model.scout import Scout\n"
        f"class Body(Scout):\n    @classmethod\n    def body_mjcf(cls):\n        return {mjcf!r}\n"
    )
    no_world = 'name="simulated_world" class="backbone.component.component:Component"'
    text = SMALL.replace(no_world, 'name="simulated_world" class="resource_pool.simulated_world:SimulatedWorld"')
    text = text.replace('<robot name="scout1" ', f'<robot name="scout1" class="{name}:Body" ')
    with pytest.raises(MissionInvalid) as caught:
        world_of(tmp_path, text)
    [fault] = caught.value.faults
    assert told in fault.message
    assert text.splitlines()[fault.line - 1][fault.column - 1 :].startswith("class=")
