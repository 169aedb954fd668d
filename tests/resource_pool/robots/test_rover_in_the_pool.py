"""A rover under its ARC, on its radio beside a Scout: it moves, it grips, and it stops like every robot."""

from __future__ import annotations

import math
from collections.abc import Callable, Coroutine
from contextlib import AbstractAsyncContextManager
from typing import Any

import pytest
from pool_on_local_network import Pool, a_pool
from world_joints import joints

from backbone.bus.clock import run_virtual
from backbone.component.abilities import ValueKind
from backbone.dependency_database.messages import Resource
from resource_pool.arc_client import ArcClient, lift_stop, stop_robot
from resource_pool.commands import Drive, Jump, Move, SwitchTransmitter, WrongCommand
from resource_pool.messages import COMMAND_TIMEOUT_S, NoSuchAction
from resource_pool.robots.rover.arcs import RoverCaptureArc, RoverDriveArc
from resource_pool.robots.rover.body import LIFT_M, PADDLES_M, TOP_M_S, TOP_RAD_S
from resource_pool.robots.rover.link import (
    Bumpers,
    GripPacket,
    MovePacket,
    Packet,
    RoverReply,
    StopPacket,
    decode,
    encode_reply,
)
from resource_pool.robots.rover.rc import Grip, RoverRc
from resource_pool.robots.rover.report import report_of
from resource_pool.stop_messages import EmergencyStopped
from scout_model.description import RobotPlace, WorldDescription
from scout_model.radio_link import HaltPacket, Safe, TransmitterOn

BODY = "resource_pool.robots.rover.body:Rover"
PROTOCOL = "resource_pool.robots.rover.rc:RoverProtocol"
ROOM = WorldDescription(
    9.0, 6.0, robots=[RobotPlace("scout1", 1, 2.0, 2.0, 0.0), RobotPlace("rover1", 7, 2.0, 4.0, 0.0, BODY)]
)
HARDWARE = [
    Resource("rover1", "rover", parameters={"network_id": 7, "protocol": PROTOCOL}, links={"command_radio": ["radio"]})
]
OPERATOR = "ui_console/console-1"
EVERYTHING = ["rover1", "scout1", "radio", "video", "grabber"]


def rover_pool(mission: Any, rcs: list[str]) -> AbstractAsyncContextManager[Pool]:
    return a_pool(
        mission,
        rcs,
        world=ROOM,
        hardware=HARDWARE,
        rc_classes={"rover": RoverRc},
        arc_classes={"rover_drive": RoverDriveArc, "rover_capture": RoverCaptureArc},
    )


def play(mission: Any, scene: Callable[[Pool, ArcClient], Coroutine[Any, Any, None]]) -> None:
    """Let the scene run with a rover that is granted for driving."""

    async def main() -> None:
        async with rover_pool(mission, ["rover1", "scout1", "radio"]) as pool:
            arc = await pool.arc(await pool.owner("walker"), "rover_drive", "rover1")
            granted = await arc.wait_granted()
            assert granted.robot == "rover1"
            await scene(pool, arc)

    run_virtual(main())


async def move_for(pool: Pool, arc: ArcClient, seconds: float, *speeds: float) -> None:
    for _ in range(round(seconds / 0.1)):
        await arc.move(*speeds)
        await pool.clock.sleep_s(0.1)


def sent(pool: Pool) -> list[Packet]:
    """Return what went on the air for the rover."""
    return [decode(heard.payload) for heard in pool.radio_driver.heard_by(7)]


async def gripper(pool: Pool) -> tuple[float, float]:
    """Return how far its paddles are closed and its lift is up."""
    paddles_m, lift_m = await joints(pool, "rover1/left_paddle", "rover1/lift")
    return paddles_m / PADDLES_M, lift_m / LIFT_M


def test_it_moves_as_commanded(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        assert (await arc.move(0.5, 0.25)).values == {"forward_m_s": 0.5, "turn_rad_s": 0.25}
        await move_for(pool, arc, 1.0, 0.5)
        began_m, _ = await pool.pose("rover1")
        await move_for(pool, arc, 2.0, 0.5)
        there_m, _ = await pool.pose("rover1")
        assert there_m - began_m == pytest.approx(1.0, rel=0.05)
        assert pool.audit["packets_for_no_robot"] == pool.audit["stale_packets"] == 0

    play(local_mission, scene)


def test_it_grips_while_it_drives_and_drives_on(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        await arc.move(0.3)
        await pool.clock.sleep_s(0.1)
        applied = await arc.give("grip", {"closed": 1.0, "lift": 0.5})
        assert (applied.rc, applied.command, applied.values) == ("rover1", "grip", {"closed": 1.0, "lift": 0.5})
        await pool.clock.sleep_s(0.2)
        packets = sent(pool)
        assert packets.count(GripPacket(1.0, 128 / 255)) == 1
        assert packets[-1] == MovePacket(0.3, 0.0)

    play(local_mission, scene)


def test_the_gripper_closes_and_keeps_its_grip_when_the_grant_ends(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        assert await gripper(pool) == pytest.approx((0.0, 0.0), abs=0.02)
        await arc.give("grip", {"closed": 1.0, "lift": 1.0})
        await pool.clock.sleep_s(6.0)
        assert await gripper(pool) == pytest.approx((1.0, 1.0), abs=0.05)
        await arc.idle()
        await pool.clock.sleep_s(1.0)
        assert sent(pool)[-1] == Safe()
        assert await gripper(pool) == pytest.approx((1.0, 1.0), abs=0.05)

    play(local_mission, scene)


@pytest.mark.parametrize(
    ("given", "applied"),
    [
        (Move(50.0, -50.0), {"forward_m_s": TOP_M_S, "turn_rad_s": -TOP_RAD_S}),
        (Move(-50.0), {"forward_m_s": -TOP_M_S, "turn_rad_s": 0.0}),
        (Grip(7.0, -1.0), {"closed": 1.0, "lift": 0.0}),
    ],
)
def test_what_is_beyond_its_limits_is_clipped(local_mission: Any, given: Any, applied: dict[str, float]) -> None:
    async def scene(_pool: Pool, arc: ArcClient) -> None:
        assert (await arc.command(given)).values == applied

    play(local_mission, scene)


def test_what_is_no_number_is_refused_and_it_stands(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        for wrong in (Move(math.nan), Move(0.1, math.inf), Grip(math.nan, 0.0)):
            with pytest.raises(WrongCommand):
                await arc.command(wrong)
        await pool.clock.sleep_s(0.2)
        assert sent(pool) == []

    play(local_mission, scene)


def test_it_has_no_command_of_a_scout(local_mission: Any) -> None:
    async def scene(_pool: Pool, arc: ArcClient) -> None:
        for missing in (Drive(1.0, 1.0), Jump(), SwitchTransmitter(True, "video")):
            with pytest.raises(NoSuchAction):
                await arc.command(missing)
        with pytest.raises(NoSuchAction, match="no command jump; it has: move, halt, grip"):
            await arc.give("jump", {})

    play(local_mission, scene)


def test_silence_stops_it(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        await move_for(pool, arc, 1.0, 0.5)
        await pool.clock.sleep_s(COMMAND_TIMEOUT_S + 1.0)
        assert sent(pool)[-1] == HaltPacket()
        stood_m = await pool.pose("rover1")
        await pool.clock.sleep_s(1.0)
        assert await pool.pose("rover1") == pytest.approx(stood_m, abs=1e-3)
        assert pool.running["rover1"].statistics()["command_timeouts"] == 1

    play(local_mission, scene)


def test_an_emergency_stop_stops_it_and_refuses_wheels_and_gripper(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        await move_for(pool, arc, 1.0, 0.5)
        await arc.give("grip", {"closed": 1.0, "lift": 1.0})
        stop = await stop_robot(pool.voice_of(OPERATOR), "rover1", "child in the room", "anna")
        assert (stop.is_stopped, stop.is_confirmed) == (True, True)
        await pool.clock.sleep_s(0.5)
        stood_m, gripped = await pool.pose("rover1"), await gripper(pool)
        assert max(gripped) < 0.5
        assert sent(pool)[-1] == StopPacket()
        for refused in (arc.move(0.5), arc.give("grip", {"closed": 1.0, "lift": 0.0})):
            with pytest.raises(EmergencyStopped):
                await refused
        await arc.halt()
        await pool.clock.sleep_s(1.0)
        assert await pool.pose("rover1") == pytest.approx(stood_m, abs=1e-3)
        assert await gripper(pool) == pytest.approx(gripped, abs=0.01)
        assert sent(pool)[-1] == HaltPacket()

    play(local_mission, scene)


def test_after_a_stop_is_lifted_its_gripper_moves_although_no_wheel_was_commanded(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        operator = pool.voice_of(OPERATOR)
        arc.heard_stop(await lift_stop(operator, await stop_robot(operator, "rover1", "child in the room")))
        await arc.give("grip", {"closed": 1.0, "lift": 1.0})
        await pool.clock.sleep_s(6.0)
        assert min(await gripper(pool)) > 0.95

    play(local_mission, scene)


def test_a_stop_without_a_holder_is_not_confirmed_while_the_gripper_may_still_move(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        operator = pool.voice_of(OPERATOR)
        await arc.give("grip", {"closed": 1.0, "lift": 1.0})
        await arc.idle()
        await pool.clock.sleep_s(1.0)
        before = await gripper(pool)
        assert not (await stop_robot(operator, "rover1", "a hand in the gripper")).is_confirmed
        await pool.clock.sleep_s(5.0)
        assert min(await gripper(pool)) > min(before) + 0.1
        at_rest = await gripper(pool)
        assert (await stop_robot(operator, "rover1", "a hand in the gripper")).is_confirmed
        await pool.clock.sleep_s(1.0)
        assert await gripper(pool) == pytest.approx(at_rest, abs=0.01)

    play(local_mission, scene)


def test_a_scout_and_a_rover_share_one_radio(local_mission: Any) -> None:
    async def scene(pool: Pool, arc: ArcClient) -> None:
        scout = await pool.arc(await pool.owner("other"), "drive", "scout1")
        await scout.wait_granted()
        assert arc.granted is not None
        began = {robot: await pool.pose(robot) for robot in ("rover1", "scout1")}
        for _ in range(20):
            await arc.move(0.4)
            await scout.move(-0.2)
            await pool.clock.sleep_s(0.1)
        moved_m = {robot: (await pool.pose(robot))[0] - began[robot][0] for robot in began}
        assert moved_m["rover1"] > 0.5
        assert moved_m["scout1"] < -0.3
        assert pool.audit["packets_for_no_robot"] == pool.audit["stale_packets"] == 0
        assert not any(late for name, late in pool.running["radio"].statistics().items() if "overruns" in name)

    play(local_mission, scene)


def test_its_video_is_captured_under_its_own_kind_of_arc(local_mission: Any) -> None:
    async def main() -> None:
        async with rover_pool(local_mission, EVERYTHING) as pool:
            arc = await pool.arc(await pool.owner("watcher"), "rover_capture", "rover1")
            await arc.wait_granted()
            await pool.clock.sleep_s(0.3)
            assert TransmitterOn("video") in sent(pool)
            assert pool.grabber_driver.frequency == "video"
            await arc.give("grip", {"closed": 1.0, "lift": 0.0})
            await arc.idle()
            await pool.clock.sleep_s(1.0)
            assert sent(pool)[-1] == Safe()

    run_virtual(main())


def test_its_abilities_have_the_limits_of_its_body() -> None:
    abilities = RoverRc.abilities()
    forms = {form.word: form for form in abilities.commands}
    assert {word: [field.name for field in form.fields] for word, form in forms.items()} == {
        "move": ["forward_m_s", "turn_rad_s"],
        "halt": [],
        "grip": ["closed", "lift"],
        "switch_transmitter": ["on", "frequency"],
    }
    assert [(field.least, field.most) for field in forms["move"].fields] == [
        (-TOP_M_S, TOP_M_S),
        (-TOP_RAD_S, TOP_RAD_S),
    ]
    assert [(field.least, field.most) for field in forms["grip"].fields] == [(0.0, 1.0)] * 2
    assert [word for word, form in forms.items() if form.moves] == ["move", "grip"]
    assert abilities.is_robot


def test_each_value_of_its_report_can_be_a_gauge() -> None:
    reports = RoverRc.abilities().reports
    assert {field.kind for field in reports} == {ValueKind.NUMBER, ValueKind.FLAG}
    assert all(field.doc for field in reports)
    units = {field.name: field.unit for field in reports}
    assert [units[name] for name in ("sonar_3_m", "yaw_rad_s", "left_m_s2", "battery_share")] == [
        "m",
        "rad/s",
        "m/s²",
        "",
    ]


def test_its_answer_is_read_as_its_report() -> None:
    answered = RoverReply(
        battery=1.0,
        left_m=1.25,
        right_m=-2.5,
        sonars_cm=(100, 200, 300, 400, 500, 500, 500, 500),
        bumpers=Bumpers(front=False, left_tip=True, right_tip=False, rear=True),
        is_blocked=True,
        gyroscope_rad_s=(0.1, 0.2, 0.3),
        acceleration_m_s2=(-1.0, 2.0),
        closed=0.0,
        lift=1.0,
        is_holding=False,
    )
    report = report_of(encode_reply(answered))
    assert (report.battery_share, report.closed, report.lift) == (1.0, 0.0, 1.0)
    assert (report.left_wheel_m, report.right_wheel_m) == (1.25, -2.5)
    assert (report.front_bumper, report.left_tip, report.right_tip, report.rear_bumper) == (False, True, False, True)
    assert (report.is_blocked, report.is_holding) == (True, False)
    assert (report.roll_rad_s, report.pitch_rad_s, report.yaw_rad_s) == (0.1, 0.2, 0.3)
    assert (report.forward_m_s2, report.left_m_s2) == (-1.0, 2.0)
    sonars_m = [getattr(report, f"sonar_{number}_m") for number in range(8)]
    assert sonars_m == pytest.approx([1.0, 2.0, 3.0, 4.0, 5.0, 5.0, 5.0, 5.0])
