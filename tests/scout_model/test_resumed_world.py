"""A world whose process fell continues where it was, with the robots at rest."""

import math

import msgspec
import pytest

from scout_model import dimensions, radio_link
from scout_model.description import RobotPlace, Target, WorldDescription
from scout_model.world import World, WorldMemory

CARRIER = Target("carrier", "carrier", [(0.5, 3.0), (6.5, 3.0)], 0.5, begin_s=1.0, rest_s=2.0)
ROOM = WorldDescription(
    9.0,
    6.0,
    robots=[
        RobotPlace("scout1", 1, 2.0, 1.5, math.pi / 2),
        RobotPlace("scout2", 2, 2.5, 3.6, math.pi / 2, carried_by="carrier"),
    ],
    targets=[CARRIER, Target("person", "person", [(7.0, 1.0), (7.0, 5.0)], 0.5)],
)
BODIES = ("scout1", "scout2", "person", "carrier")
SET_DOWN_S = 10.0


def drive(world: World, seconds: float) -> None:
    for frame in range(round(seconds * dimensions.FRAMES_PER_S)):
        if frame % 6 == 0:
            world.hear(1, radio_link.encode_drive(8.0, 5.0))
        world.step_frame()


def wait(world: World, seconds: float) -> None:
    for _ in range(round(seconds * dimensions.FRAMES_PER_S)):
        world.step_frame()


def resumed(memory: WorldMemory, room: WorldDescription = ROOM) -> World:
    world = World(room)
    world.resume(msgspec.msgpack.decode(msgspec.msgpack.encode(memory), type=WorldMemory))
    return world


@pytest.mark.parametrize("after_s", [0.0, 0.5, 3.0, SET_DOWN_S])
def test_bodies_continue_where_they_were(after_s: float) -> None:
    """Also a person on the way, and a Scout that a carrier still holds or has set down."""
    former = World(ROOM)
    drive(former, after_s)
    world = resumed(former.memory())
    assert world.frame == former.frame
    for body in BODIES:
        assert world.pose(body) == pytest.approx(former.pose(body), abs=1e-9)
    assert world.is_carried("scout2") == former.is_carried("scout2") == (after_s < SET_DOWN_S)
    wait(former, 2.0)
    wait(world, 2.0)
    assert math.dist(world.pose("scout1")[:2], former.pose("scout1")[:2]) < 0.15  # the former one coasted to a stop
    for body in ("scout2", "person", "carrier"):
        assert world.pose(body) == pytest.approx(former.pose(body), abs=0.01)


def test_its_robots_obey_again() -> None:
    former = World(ROOM)
    drive(former, 2.0)
    world = resumed(former.memory())
    begin = world.pose("scout1")
    drive(world, 2.0)
    assert math.dist(world.pose("scout1")[:2], begin[:2]) > 0.2


def test_a_battery_keeps_its_charge() -> None:
    room = msgspec.structs.replace(ROOM, robots=[msgspec.structs.replace(ROOM.robots[0], battery_j=200.0)])
    former = World(room)
    drive(former, 5.0)
    memory = former.memory()
    assert 0.0 < memory.charges["scout1"] < 1.0
    world = resumed(memory, room)
    assert world.memory().charges["scout1"] == pytest.approx(memory.charges["scout1"])
    wait(world, 5.0)
    assert world.memory().charges["scout1"] < memory.charges["scout1"]


def test_an_empty_battery_stays_empty() -> None:
    memory = WorldMemory(30, {}, {"scout1": 0.0})
    world = resumed(memory)
    begin = world.pose("scout1")
    drive(world, 2.0)
    assert world.memory().charges["scout1"] == 0.0
    assert math.dist(world.pose("scout1")[:2], begin[:2]) < 0.01


def test_robots_that_it_does_not_know_begin_at_their_places() -> None:
    world = resumed(WorldMemory(30, {"scout1": [1.0, 2.0], "gone": [0.0] * 7}, {"gone": 0.5}))
    assert world.pose("scout1")[:2] == pytest.approx((2.0, 1.5), abs=0.01)
