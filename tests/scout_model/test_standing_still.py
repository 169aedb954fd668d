"""A robot that stands still costs nothing and stays the same, bit for bit."""

import numpy as np
import pytest
from examples import share
from hypothesis import given, settings
from hypothesis import strategies as st

from scout_model import radio_link
from scout_model.description import RobotPlace, Target, WorldDescription
from scout_model.world import World

PLACES = [RobotPlace(f"scout{number}", number, 1.0 + 0.5 * number, 2.0, 0.3 * number) for number in range(1, 5)]
SETTLED_S = 3


def settled(*targets: Target) -> World:
    world = World(WorldDescription(9.0, 6.0, robots=PLACES, targets=list(targets)))
    for _ in range(30 * SETTLED_S):
        world.step_frame()
    return world


def test_a_world_of_standing_scouts_has_the_same_state_frame_after_frame() -> None:
    world = settled()
    assert all(world.is_asleep(place.name) for place in PLACES)
    before = world.state()
    for _ in range(90):
        world.step_frame()
        assert world.state().tobytes() == before.tobytes()


def test_who_transmits_or_is_told_to_halt_stands_as_still() -> None:
    world = settled()
    before = world.state()
    for frame in range(60):
        world.hear(1, radio_link.encode_transmitter_on("video1"))
        world.hear(2, radio_link.encode_drive(0.0, -0.0) if frame % 2 else radio_link.encode_halt())
        world.step_frame()
    assert world.transmitting() == {"scout1": "video1"}
    assert np.array_equal(world.state(), before)


def test_a_command_wakes_one_robot_and_no_other() -> None:
    world = settled()
    before = {place.name: world.position_m(place.name) for place in PLACES}
    for _ in range(30):
        world.hear(2, radio_link.encode_drive(5.0, 5.0))
        world.step_frame()
    assert [place.name for place in PLACES if not world.is_asleep(place.name)] == ["scout2"]
    assert [name for name, position_m in before.items() if world.position_m(name) != position_m] == ["scout2"]
    for _ in range(30 * SETTLED_S):
        world.step_frame()
    assert world.is_asleep("scout2")


def test_a_jump_wakes_it_too() -> None:
    world = settled()
    world.hear(1, radio_link.encode_jump())
    heights_m = []
    for _ in range(30):
        world.hear(1, radio_link.encode_drive(0.0, 0.0))
        world.step_frame()
        heights_m.append(world.position_m("scout1")[2])
    assert max(heights_m) > 0.3


def test_a_blow_and_a_bump_wake_it() -> None:
    world = settled(Target("pioneer", "pioneer", [(2.0, 0.5), (2.0, 5.5)], 0.5, begin_s=float(SETTLED_S)))
    world.strike("scout1", (0.0, 0.0, 1.0), (0.0, 0.0, 0.0))
    standing = world.position_m("scout2")
    world.step_frame()
    assert not world.is_asleep("scout1")
    for _ in range(120):
        world.step_frame()
    assert world.position_m("scout2") != standing


packets = st.one_of(
    st.builds(radio_link.encode_drive, st.floats(-20, 20), st.floats(-20, 20)),
    st.sampled_from([radio_link.encode_halt(), radio_link.encode_jump(), radio_link.encode_safe()]),
)


@given(st.lists(st.tuples(st.integers(0, 40), st.integers(1, 4), packets), max_size=8))
@settings(max_examples=share(6))
def test_the_same_packets_at_the_same_frames_give_the_same_state(heard: list[tuple[int, int, bytes]]) -> None:
    states = []
    for _ in range(2):
        world = World(WorldDescription(9.0, 6.0, robots=PLACES))
        for pause, network_id, payload in heard:
            for _ in range(pause):
                world.step_frame()
            world.hear(network_id, payload)
        for _ in range(60):
            world.step_frame()
        states.append(world.state().tobytes())
    assert states[0] == states[1]


@given(st.lists(st.tuples(st.integers(0, 150), st.integers(1, 4), packets), max_size=3), st.floats(0.0, 6.0))
@settings(max_examples=share(10))
def test_a_frame_in_which_nothing_moves_is_as_if_it_were_stepped(
    heard: list[tuple[int, int, bytes]], begin_s: float
) -> None:
    """A target passes robots closely, walks into one of them, and rests."""
    target = Target("pioneer", "pioneer", [(1.0, 2.6), (3.4, 2.6), (3.0, 1.0)], 1.0, begin_s=begin_s, rest_s=60.0)
    place_targets = World.__dict__["_place_targets"]

    def and_forget(world: World) -> bool:
        vars(world)["_stands"] = False
        return bool(place_targets(world))

    def course() -> list[tuple[bytes, list[bytes]]]:
        world = World(WorldDescription(9.0, 6.0, 1, robots=PLACES, targets=[target]))
        after = []
        for pause, network_id, payload in [*heard, (360, 1, radio_link.encode_halt())]:
            for frame in range(pause):
                if frame % 30 == 20:  # a robot answers who has sent it something
                    world.hear(1 + frame // 30 % len(PLACES), radio_link.encode_transmitter_on("video1"))
                world.step_frame()
                after.append((world.state().tobytes(), [world.reply(place.network_id) for place in PLACES]))
            world.hear(network_id, payload)
        return after

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(World, "_place_targets", and_forget)
        stepped = course()
    assert course() == stepped
