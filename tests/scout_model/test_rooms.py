"""What stands in a room, looks as it should, and is refused where it makes no sense."""

import math
from collections.abc import Callable

import cv2
import mujoco
import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from scout_model import dimensions, radio_link
from scout_model.camera import Camera, unpainted
from scout_model.description import DarkPlace, Furniture, Landmark, Ramp, RobotPlace, Target, WorldDescription
from scout_model.errors import InvalidWorld
from scout_model.world import World

Picture = NDArray[np.uint8]
NORTH = math.pi / 2
OWN_ROOM = """
<mujoco model="hall">
  <option timestep="0.01" gravity="0 0 -1"/>
  <asset>
    <material name="brick" rgba="0.6 0.6 0.6 1"/>
    <mesh name="tetra" vertex="0 0 0  0.4 0 0  0 0.4 0  0 0 0.4"/>
  </asset>
  <worldbody>
    <geom name="wall" type="box" pos="4 5 1" size="4 0.05 1" material="brick"/>
    <geom name="pillar" type="cylinder" pos="4 3 0.5" size="0.2 0.5" rgba="0.1 0.1 0.1 1"/>
    <geom name="log" type="capsule" fromto="2 4 0.1 2.6 4 0.1" size="0.1" rgba="0.9 0.9 0.9 1"/>
    <geom name="stone" type="ellipsoid" pos="5.4 3.6 0.1" size="0.3 0.2 0.15"/>
    <geom name="tetra" type="mesh" mesh="tetra" pos="3.3 3.2 0"/>
    <body name="lamp" pos="5 4 0"><geom name="lamp" type="sphere" size="0.15" pos="0 0 0.15"/></body>
  </worldbody>
</mujoco>
"""


def scout(x_m: float, y_m: float, heading_rad: float = NORTH, name: str = "scout1", network_id: int = 1) -> RobotPlace:
    return RobotPlace(name, network_id, x_m, y_m, heading_rad)


def view(world: World, robot: str = "scout1") -> Picture:
    with Camera(world.mjcf, "paint") as camera:
        camera.show(world.state())
        return camera.picture(robot)


def described(**parts: object) -> WorldDescription:
    parts.setdefault("robots", [scout(4.0, 2.0)])
    return WorldDescription(9.0, 6.0, **parts)  # type: ignore[arg-type]


def drive(world: World, frames: int, speed_rad_s: float = 10.0) -> None:
    for frame in range(frames):
        if frame % 6 == 0:
            world.hear(1, radio_link.encode_drive(speed_rad_s, speed_rad_s))
        world.step_frame()


def test_under_a_table_it_is_darker_than_under_the_sky() -> None:
    table = Furniture("desk", 4.0, 5.4, 1.6, 1.2, 0.4, "table")
    lit = view(World(described(robots=[scout(4.0, 5.3)])))
    dark = view(World(described(robots=[scout(4.0, 5.3)], furniture=[table])))
    assert dark.mean() < 0.4 * lit.mean()


def test_the_way_to_a_table_gets_darker_step_by_step() -> None:
    table = Furniture("desk", 4.0, 5.2, 1.6, 1.5, 0.4, "table")
    seen = [view(World(described(robots=[scout(4.0, y_m)], furniture=[table]))).mean() for y_m in (2.0, 3.0, 4.0, 4.8)]
    assert seen == sorted(seen, reverse=True)
    away = view(World(described(robots=[scout(4.0, 3.0, -NORTH)], furniture=[table]))).mean()
    assert seen[1] < away


def test_a_scout_drives_under_a_table_and_not_through_its_legs() -> None:
    table = Furniture("desk", 4.0, 3.0, 1.0, 0.6, 0.4, "table")
    free, blocked = World(described(furniture=[table])), World(described(furniture=[table], robots=[scout(3.52, 2.0)]))
    drive(free, 240)
    drive(blocked, 240)
    assert free.position_m("scout1")[1] > 3.4
    assert blocked.position_m("scout1")[1] < 2.72


def test_a_robot_in_a_dark_place_is_seen_darker_and_lit_again_outside() -> None:
    dark = DarkPlace("corner", 4.0, 4.0, 1.0, 1.0, 0.5)
    watcher, other = scout(4.0, 3.3), scout(4.0, 3.6, 0.0, "scout2", 2)
    world = World(described(robots=[watcher, other], dark_places=[dark]))
    shadowless = World(described(robots=[watcher, other]))
    wheel = slice(150, 175), slice(150, 170)
    assert view(world)[wheel].mean() == pytest.approx(dimensions.DARKNESS * view(shadowless)[wheel].mean(), rel=0.2)
    with Camera(world.mjcf, "paint") as camera, Camera(shadowless.mjcf, "paint") as lit:
        for _ in range(120):
            for room in (world, shadowless):
                room.hear(2, radio_link.encode_drive(15.0, 15.0))
                room.step_frame()
        assert world.position_m("scout2")[0] > 4.6
        camera.show(world.state())
        lit.show(shadowless.state())
        assert np.array_equal(camera.picture("scout2"), lit.picture("scout2"))


def test_furniture_in_a_dark_place_is_dark_too() -> None:
    crate, dark = Furniture("crate", 4.0, 3.0, 0.4, 0.4, 0.3), DarkPlace("corner", 4.0, 3.0, 0.5, 0.5, 0.4)
    levels = [
        view(World(described(furniture=[crate], dark_places=places)))[100:118, 150:170].mean()
        for places in ([], [dark])
    ]
    assert levels[1] == pytest.approx(dimensions.DARKNESS * levels[0], rel=0.15)


def test_a_ramp_leads_up_in_its_own_direction() -> None:
    ramp = Ramp("ramp", 4.0, 3.0, 1.0, 0.6, 0.2, NORTH)
    world = World(described(ramps=[ramp]))
    drive(world, 150)
    _, y_m, z_m = world.position_m("scout1")
    assert 2.7 < y_m < 3.5
    assert z_m == pytest.approx((y_m - 2.5) * 0.2 + dimensions.WHEEL_RADIUS_M, abs=0.01)
    assert (view(World(described(ramps=[ramp]))) != view(World(described()))).sum() > 5000


def blobs(picture: Picture) -> list[tuple[float, float, float]]:
    """Dark discs on the white board: column, row, width in pixels, from left to right."""
    rows, columns = np.nonzero(picture > 150)
    inside = np.zeros_like(picture)
    board = slice(rows.min(), rows.max() + 1), slice(columns.min(), columns.max() + 1)
    inside[board] = picture[board] < 60
    _, _, extents, middles = cv2.connectedComponentsWithStats(inside)
    found = zip(middles[1:], extents[1:], strict=True)
    return sorted(
        (float(column), float(row), float(extent[cv2.CC_STAT_WIDTH]))
        for (column, row), extent in found
        if extent[cv2.CC_STAT_AREA] > 50
    )


def test_a_landmark_shows_its_four_blobs_where_a_pinhole_sees_them() -> None:
    """A metre before the board, face to face; the camera is 19 mm ahead of the axle and 26 mm high, tilted up."""
    world = World(described(landmarks=[Landmark("home", 4.0, 3.0, -NORTH)]))
    middle = np.zeros((240, 320), np.uint8)
    middle[60:200, 80:240] = view(world)[60:200, 80:240]
    seen = blobs(middle)
    assert len(seen) == 4
    focal_px = dimensions.PICTURE_WIDTH_PX / 2 / math.tan(dimensions.HORIZONTAL_VIEW_RAD / 2)
    expected = []
    for right_m, height_m in dimensions.BLOBS_M:
        up_rad = math.atan2(height_m - 0.026, 1.0 - 0.019) - dimensions.CAMERA_TILT_RAD
        column = 159.5 + focal_px * right_m / (1.0 - 0.019)
        expected.append((column, 119.5 - focal_px * math.tan(up_rad)))
    for (column, row, width_px), (wanted_column, wanted_row) in zip(seen, sorted(expected), strict=True):
        assert column == pytest.approx(wanted_column, abs=1.5)
        assert row == pytest.approx(wanted_row, abs=2.5)
        assert width_px == pytest.approx(focal_px * dimensions.BLOB_DIAMETER_M / 0.981, abs=2.5)


def test_a_landmark_is_blank_from_behind_and_stops_who_runs_into_it() -> None:
    world = World(described(landmarks=[Landmark("home", 4.0, 3.0, NORTH)]))
    picture = view(world)
    middle = picture[115:125, 150:170]
    assert np.ptp(middle) < 10
    drive(world, 240)
    assert world.position_m("scout1")[1] < 3.0


def test_a_room_of_ones_own_takes_the_place_of_walls_and_marks() -> None:
    world = World(described(mjcf=OWN_ROOM))
    model = mujoco.MjModel.from_xml_string(world.mjcf)
    names = {model.geom(geom).name for geom in range(model.ngeom)}
    assert {"room/wall", "room/pillar", "room/log", "room/stone", "room/tetra", "room/lamp", "floor"} <= names
    assert not any(name.startswith(("wall_", "poster_", "line_")) for name in names)
    assert model.opt.timestep == pytest.approx(dimensions.STEP_S)
    assert model.opt.gravity[2] == pytest.approx(-9.81)
    assert view(world)[:, 150:170].min() < 60
    drive(world, 180)
    assert world.position_m("scout1")[1] < 2.85


def test_a_floor_and_a_lamp_of_ones_own_take_the_place_of_floor_and_sun() -> None:
    own = """<mujoco><worldbody>
      <light name="ceiling" type="directional" castshadow="false" dir="0 0.3 -1" diffuse="0.8 0.8 0.8"/>
      <geom name="concrete" type="plane" size="0 0 1" rgba="0.9 0.9 0.9 1"/>
      <geom name="far" type="box" pos="4 5 1" size="4 0.05 1"/>
    </worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(World(described(mjcf=own)).mjcf)
    assert {model.geom(geom).name for geom in range(model.ngeom)} >= {"room/concrete", "room/far"}
    assert "floor" not in {model.geom(geom).name for geom in range(model.ngeom)}
    assert [model.light(light).name for light in range(model.nlight)] == ["room/ceiling"]


@pytest.mark.parametrize(
    ("mjcf", "told"),
    [
        ("<mujoco", "cannot read"),
        ("<robot/>", "no MJCF"),
        ("<mujoco><worldbody><geom type='pyramid'/></worldbody></mujoco>", "cannot read"),
        ("<mujoco><asset><mesh name='m' file='m.stl'/></asset></mujoco>", "'m.stl'"),
        ("<mujoco><worldbody><geom name='g' type='box' size='-1 1 1'/></worldbody></mujoco>", "cannot build"),
        ("<mujoco><worldbody><body name='b'/><body name='b'/></worldbody></mujoco>", "b"),
        (
            "<mujoco><asset><hfield name='h' nrow='2' ncol='2' size='1 1 1 1' elevation='0 1 0 1'/></asset>"
            "<worldbody><geom name='hill' type='hfield' hfield='h'/></worldbody></mujoco>",
            "'hill'",
        ),
    ],
)
def test_a_broken_room_is_refused_with_what_is_wrong(mjcf: str, told: str) -> None:
    with pytest.raises(InvalidWorld, match=told) as refusal:
        World(described(mjcf=mjcf))
    assert refusal.value.remedy in str(refusal.value)


@pytest.mark.parametrize(
    "parts",
    [
        {"furniture": [Furniture("t", 1.0, 1.0, 1.0, 1.0, 0.7, "sofa")]},
        {"furniture": [Furniture("t", 1.0, 1.0, 1.0, 1.0, 0.02, "table")]},
        {"furniture": [Furniture("t", 1.0, 1.0, 0.08, 1.0, 0.7, "table")]},
        {"ramps": [Ramp("r", 1.0, 1.0, 0.0, 1.0, 0.2)]},
        {"ramps": [Ramp("r", 1.0, 1.0, 1.0, 1.0, 0.2, math.nan)]},
        {"dark_places": [DarkPlace("d", 1.0, 1.0, 1.0, -1.0, 0.2)]},
        {"landmarks": [Landmark("l", math.inf, 1.0)]},
        {"landmarks": [Landmark("l", 1.0, 1.0), Landmark("l", 2.0, 1.0)]},
        {"landmarks": [Landmark("scout1", 1.0, 1.0)]},
        {"landmarks": [Landmark("world", 1.0, 1.0)]},
        {"targets": [Target("world", "person", [(1.0, 1.0), (2.0, 1.0)], 1.0)]},
    ],
)
def test_things_that_make_no_sense_are_refused(parts: dict[str, object]) -> None:
    with pytest.raises(InvalidWorld):
        World(described(**parts))


@pytest.mark.parametrize("name", ["floor", "sun", "line_1", "wall_north", "skirting_west", "poster_north_0", "room"])
@pytest.mark.parametrize(
    "thing",
    [
        lambda name: {"furniture": [Furniture(name, 2.0, 2.0, 0.4, 0.4, 0.4)]},
        lambda name: {"furniture": [Furniture(name, 2.0, 2.0, 0.4, 0.4, 0.4, "table")]},
        lambda name: {"ramps": [Ramp(name, 2.0, 2.0, 0.4, 0.4, 0.1)]},
        lambda name: {"landmarks": [Landmark(name, 2.0, 2.0)]},
        lambda name: {"dark_places": [DarkPlace(name, 2.0, 2.0, 0.4, 0.4, 0.4)]},
        lambda name: {"robots": [scout(4.0, 2.0, name=name)]},
        lambda name: {"targets": [Target(name, "person", [(1.0, 1.0), (2.0, 1.0)], 1.0)]},
    ],
)
def test_a_thing_may_be_named_as_a_part_of_the_room(name: str, thing: Callable[[str], dict[str, object]]) -> None:
    assert World(described(**thing(name))).frame == 0


@pytest.mark.parametrize("shape", ["pioneer", "person", "carrier"])
def test_a_target_passes_the_same_places_at_the_same_times_in_every_world(shape: str) -> None:
    """IROS 2001, section 5.1: chosen for its ability to repeatedly travel over a path at an identical speed."""
    ways = []
    for others in ([], [scout(2.0, 3.05, 0.0)]):
        target = Target("target", shape, [(0.5, 3.0), (8.5, 3.0)], 0.5, begin_s=0.5)
        world, way = World(described(robots=others, targets=[target])), []
        for _ in range(150):
            world.step_frame()
            way.append(world.pose("target"))
        ways.append(way)
    assert ways[0] == ways[1]
    speeds_m_s = np.diff([x_m for x_m, _, _ in ways[0]])[20:] * dimensions.FRAMES_PER_S
    assert speeds_m_s == pytest.approx(0.5, abs=1e-9)


@pytest.mark.parametrize(
    ("asset", "part", "lacks"),
    [
        ("", '<geom type="box" size="1 1 1" rgba="0.2 0.2 0.2 1"/>', []),
        ("", '<geom type="box" size="1 1 1" rgba="1 0 0 0"/>', []),
        ("", '<geom type="box" size="1 1 1" rgba="1 0 0 0.5" group="3"/>', []),
        ("", '<geom type="box" size="1 1 1" rgba="1 0 0 0.5"/>', ["transparent geoms"]),
        ('<material name="m"/>', '<geom type="sphere" size="1" material="m"/>', ["materials"]),
        ('<material name="m"/>', '<geom type="sphere" size="1" material="m" group="3"/>', []),
        ("", '<light type="directional"/>', []),
        ("", "<light/>", ["lamps"]),
        ("", '<site size="0.1"/>', ["sites"]),
        ("", '<site size="0.1" group="4"/>', []),
    ],
)
def test_what_the_painter_cannot_show_is_known_before_it_draws(asset: str, part: str, lacks: list[str]) -> None:
    mjcf = f"<mujoco><asset>{asset}</asset><worldbody>{part}</worldbody></mujoco>"
    assert unpainted(World(described(mjcf=mjcf, robots=[])).mjcf) == lacks


def test_a_thing_without_any_opacity_is_not_painted() -> None:
    """OpenGL leaves it out, too; rooms have such things to collide with."""
    room = '<mujoco><worldbody><geom type="box" size="1 0.2 1" pos="4 4 1" rgba="%s"/></worldbody></mujoco>'
    clear, black = (view(World(described(mjcf=room % rgba))) for rgba in ("0 0 0 0", "0 0 0 1"))
    empty = view(World(described(mjcf="<mujoco><worldbody/></mujoco>")))
    assert (clear == empty).all()
    assert (black != empty).any()


def test_shapes_that_the_painter_has_not_are_known_before_it_draws() -> None:
    """Rooms are refused with them; the body of a robot may have them."""
    mjcf = """<mujoco>
      <visual><headlight diffuse="0 0 0"/></visual>
      <asset><hfield name="hills" nrow="2" ncol="2" size="1 1 1 1" elevation="0 0 0 1"/></asset>
      <worldbody><geom type="hfield" hfield="hills"/></worldbody>
    </mujoco>"""
    assert unpainted(mjcf) == ["height fields and signed distance fields"]


sizes_m = st.floats(0.11, 2.0)
places_m = st.tuples(st.floats(0.5, 8.5), st.floats(0.5, 5.5))
turns_rad = st.floats(-math.pi, math.pi)


@st.composite
def rooms(draw: st.DrawFn) -> WorldDescription:
    places = iter(draw(st.lists(places_m, min_size=6, max_size=6)))
    shapes = draw(st.lists(st.sampled_from(["box", "table"]), min_size=2, max_size=2))
    return described(
        robots=[scout(*next(places), draw(turns_rad))],
        furniture=[
            Furniture(f"f{number}", *next(places), draw(sizes_m), draw(sizes_m), draw(sizes_m), shape)
            for number, shape in enumerate(shapes)
        ],
        ramps=[Ramp("ramp", *next(places), draw(sizes_m), draw(sizes_m), draw(sizes_m), draw(turns_rad))],
        landmarks=[Landmark("home", *next(places), draw(turns_rad))],
        dark_places=[DarkPlace("dark", *next(places), draw(sizes_m), draw(sizes_m), draw(sizes_m))],
    )


@given(rooms())
@settings(max_examples=share(15))
def test_whatever_may_be_described_is_built_stepped_and_seen(description: WorldDescription) -> None:
    world = World(description)
    assert world.mjcf == World(description).mjcf
    world.step_frame()
    assert np.isfinite(world.state()).all()
    assert view(world).shape == (240, 320)
    assert unpainted(world.mjcf) == []
