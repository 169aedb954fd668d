"""Two cameras under one ARC: two RCs of one kind with roles of their own, one of which pans."""

from __future__ import annotations

import math
from collections.abc import Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from pool_on_local_network import Pool, a_pool
from rehearsed_missions import assert_each_gets_its_turn
from world_joints import joints

from backbone.bus.clock import run_virtual
from backbone.dependency_database.messages import Resource
from resource_pool.arc_client import ArcClient, Frame, stop_robot
from resource_pool.commands import WrongCommand
from resource_pool.devices.monitor.rc import Monitor
from resource_pool.devices.pan_camera.arcs import TwoCamerasArc
from resource_pool.devices.pan_camera.body import MOST_PAN_RAD, PAN_RAD_S, PanCamera, encode_look
from resource_pool.devices.pan_camera.rc import Look, VideoCamera
from resource_pool.drivers.interface import HardwareFault
from resource_pool.messages import NoSuchAction
from resource_pool.stop_messages import EmergencyStopped
from scout_model import radio_link
from scout_model.description import RobotPlace, WorldDescription
from scout_model.dimensions import COMMAND_TIMEOUT_S, FRAMES_PER_S

TOP = Path(__file__).parents[3]
FOLDER = "resource_pool.devices.pan_camera"
BODY = f"{FOLDER}.body:PanCamera"
ROOM = WorldDescription(
    6.0,
    6.0,
    robots=[
        RobotPlace("scout1", 1, 3.0, 3.0, 0.0),
        RobotPlace("wall_cam", 11, 1.0, 3.0, 0.0, BODY),
        RobotPlace("door_cam", 12, 3.0, 1.0, math.pi / 2, BODY),
    ],
)
FREQUENCIES = {"video_frequency": ["video", "video_b"]}
ON_AIR = {"command_radio": ["radio"], **FREQUENCIES}
HARDWARE = [
    Resource("video_b", "video_frequency", connect_s=0.1),
    Resource("screen1", "monitor", parameters={"camera": "paint"}, links=FREQUENCIES),
    Resource("screen2", "monitor", parameters={"camera": "paint"}, links=FREQUENCIES),
    Resource("wall_cam", "camera", parameters={"network_id": 11, "protocol": f"{FOLDER}.rc:PanProtocol"}, links=ON_AIR),
    Resource(
        "door_cam", "camera", parameters={"network_id": 12, "protocol": f"{FOLDER}.rc:FixedProtocol"}, links=ON_AIR
    ),
]
RCS = ["radio", "video", "video_b", "screen1", "screen2", "wall_cam", "door_cam"]
Seen = dict[str, list[Frame]]
WISH = {"pan": "wall_cam", "fixed": "door_cam"}


def play(mission: Any, scene: Callable[[Pool, ArcClient, Seen], Coroutine[Any, Any, None]]) -> None:
    """Let the scene run with both cameras granted."""

    async def main() -> None:
        async with a_pool(
            mission,
            RCS,
            world=ROOM,
            hardware=HARDWARE,
            rc_classes={"camera": VideoCamera, "monitor": Monitor},
            arc_classes={"two_cameras": TwoCamerasArc},
        ) as pool:
            _person, arc = await pool.console("anna", "two_cameras", "wall_cam", wish=WISH)
            seen: dict[str, list[Frame]] = {"": [], "fixed": []}
            for camera, frames in seen.items():
                arc.frames(frames.append, camera)
            granted = await arc.wait_granted()
            assert (granted.robot, granted.rcs["fixed"]) == ("wall_cam", "door_cam")
            await pool.clock.sleep_s(1.0)
            await scene(pool, arc, seen)

    run_virtual(main())


async def pans_rad(pool: Pool) -> list[float]:
    return await joints(pool, "wall_cam/pan", "door_cam/pan")


def test_one_pans_beside_a_fixed_one_and_both_are_seen(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, seen: Seen) -> None:
        assert {frame.robot for frame in seen[""]} == {"wall_cam"}
        assert {frame.robot for frame in seen["fixed"]} == {"door_cam"}
        before = bytes(seen[""][-1].pixels)
        assert (await arc.command(Look(1.0))).values == {"pan_rad": 1.0}
        await pool.clock.sleep_s(2.0)
        assert await pans_rad(pool) == pytest.approx([1.0, 0.0], abs=0.02)
        assert bytes(seen[""][-1].pixels) != before
        assert (await arc.give("look", {"pan_rad": -99.0})).values == {"pan_rad": -MOST_PAN_RAD}
        await pool.clock.sleep_s(5.0)
        assert await pans_rad(pool) == pytest.approx([-MOST_PAN_RAD, 0.0], abs=0.02)
        assert await pool.pose("wall_cam") == pytest.approx((1.0, 3.0), abs=0.005)
        assert pool.audit["jammed_frames"] == pool.audit["stale_packets"] == 0

    play(local_mission, scene)


def test_the_fixed_one_does_not_pan_and_says_so(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, seen: Seen) -> None:
        with pytest.raises(NoSuchAction, match="no fixed that obeys look"):
            await arc.command(Look(1.0, role="fixed"))
        fixed: Any = pool.running["door_cam"]
        with pytest.raises(HardwareFault, match="door_cam is fixed"):
            await fixed.obey(fixed.holds.holds()[0], Look(1.0))
        with pytest.raises(WrongCommand):
            await arc.command(Look(math.nan))

    play(local_mission, scene)


def test_an_emergency_stop_holds_it_where_it_looks(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient, seen: Seen) -> None:
        await arc.command(Look(2.0))
        await pool.clock.sleep_s(0.5)
        await stop_robot(pool.voice_of("ui_console/ben"), "wall_cam", "cable")
        await pool.clock.sleep_s(0.5)
        stopped_rad = await pans_rad(pool)
        assert 0.2 < stopped_rad[0] < 1.2
        with pytest.raises(EmergencyStopped):
            await arc.command(Look(0.0))
        await pool.clock.sleep_s(1.0)
        assert await pans_rad(pool) == pytest.approx(stopped_rad, abs=0.01)
        assert seen[""][-1].captured_s > pool.clock.now_s() - 0.3

    play(local_mission, scene)


def test_the_example_is_sound() -> None:
    assert_each_gets_its_turn(TOP / "docs/examples/cameras.xml")


def run_for(camera: PanCamera, begin_s: float, seconds: float, repeated: bytes = b"") -> float:
    """Let time pass frame by frame; return where it looks."""
    for frame in range(round(seconds * FRAMES_PER_S)):
        now_s = begin_s + frame / FRAMES_PER_S
        if repeated and frame % 3 == 0:
            camera.hear(repeated, now_s)
        looks_rad = camera.controls(now_s)["pan"]
    return looks_rad


@given(st.floats(-MOST_PAN_RAD, MOST_PAN_RAD))
def test_it_gets_where_it_shall_look_no_faster_than_its_motor(pan_rad: float) -> None:
    camera = PanCamera()
    assert abs(run_for(camera, 0.0, 1.0, encode_look(pan_rad))) <= PAN_RAD_S + 1e-9
    assert run_for(camera, 1.0, 3.0, encode_look(pan_rad)) == pytest.approx(pan_rad, abs=1e-6)
    assert camera.motors == 0.0


def test_silence_stops_it_and_its_transmitter() -> None:
    camera = PanCamera()
    camera.hear(radio_link.encode_transmitter_on("video"), 0.0)
    camera.hear(encode_look(2.0), 0.0)
    looks_rad = run_for(camera, 0.0, 2.0)
    assert looks_rad == pytest.approx(PAN_RAD_S * COMMAND_TIMEOUT_S, abs=0.05)
    assert camera.frequency == ""


@pytest.mark.parametrize("payload", [b"", b"L", encode_look(3.0), encode_look(math.nan), b"J", b"noise"])
def test_what_is_no_packet_of_its_own_changes_nothing(payload: bytes) -> None:
    camera = PanCamera()
    camera.hear(payload, 0.0)
    assert camera.controls(0.1) == {"pan": 0.0}
