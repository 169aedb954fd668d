"""The whole loop: a simulated Scout, its camera, a noisy link, tracker and servo law."""

from __future__ import annotations

import math

import numpy as np
import pytest
from landmark_pictures import BOARD, polar, view, world_with_landmark

from mission_control.vision.servo_law import CREEP_M_S, HALT, STOP_M, Stage
from mission_control.vision.skeleton_tracking import TrackingPhase
from mission_control.vision.visual_servo import VisualServo
from scout_model.camera import Camera
from scout_model.description import AS_THE_PAPERS
from scout_model.radio_link import encode_drive
from scout_model.scout import wheels_rad_s
from scout_model.video_link import Receiver, Signal

FRAME_S = 1 / 30
LATENCY_FRAMES = 2


def servo(seed: int, limit_s: float) -> tuple[VisualServo, float, float]:
    """Play one approach and return the servo, and how far from its place and its heading the Scout ended."""
    rng = np.random.default_rng(seed)
    pose = polar(rng.uniform(1.0, 2.5), rng.uniform(-45.0, 45.0), rng.uniform(-180.0, 180.0))
    world, receiver, servo = world_with_landmark(*pose), Receiver(seed, "A", AS_THE_PAPERS), VisualServo()
    sent = [HALT] * LATENCY_FRAMES
    with Camera(world.mjcf, "paint") as camera:
        while world.time_s < limit_s and servo.stage is not Stage.ARRIVED:
            now = sent.pop(0)
            world.hear(1, encode_drive(*wheels_rad_s(now.forward_m_s, now.turn_rad_s)))
            world.step_frame()
            camera.show(world.state())
            motors = min(1.0, sum(abs(speed) for speed in world.wheel_speeds("scout")) / 35.0)
            signal = Signal(camera.picture("scout"), "scout", motors=motors)
            sent.append(servo.see(receiver.receive([signal], world.frame).picture, FRAME_S).command)
    for _ in range(30):
        world.hear(1, encode_drive(0.0, 0.0))
        world.step_frame()
    x_m, y_m, heading_rad = world.pose("scout")
    return servo, math.hypot(BOARD.x_m - x_m - STOP_M, y_m - BOARD.y_m), abs(heading_rad)


def test_over_a_noisy_link_a_scout_finds_the_board_and_ends_at_its_place() -> None:
    servoed, off_m, off_rad = servo(20, 60.0)
    assert servoed.stage is Stage.ARRIVED
    assert off_m < 0.05
    assert off_rad < math.radians(10.0)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_of_a_hundred_starts_at_least_95_end_at_their_place() -> None:
    ended = [servo(seed, 180.0) for seed in range(100)]
    good = [
        run.stage is Stage.ARRIVED and off_m < 0.05 and off_rad < math.radians(10.0) for run, off_m, off_rad in ended
    ]
    assert sum(good) >= 95


def test_a_standing_robot_on_its_place_arrives_without_moving() -> None:
    servo = VisualServo()
    steps = [servo.see(view(STOP_M), FRAME_S) for _ in range(60)]
    assert servo.stage is Stage.ARRIVED
    assert max(abs(step.command.forward_m_s) for step in steps) <= CREEP_M_S
    assert max(abs(step.command.turn_rad_s) for step in steps) < 0.05


def test_after_it_is_resumed_it_begins_with_acquisition_and_at_rest() -> None:
    servo = VisualServo()
    for _ in range(30):
        step = servo.see(view(1.5, 0.3, -0.2), FRAME_S)
    assert step.stage is Stage.FORWARD
    assert step.command != HALT
    servo.resumed()
    step = servo.see(np.full((240, 320), 128, np.uint8), 3.0)
    assert (step.stage, step.track.phase, step.command, step.pose) == (
        Stage.SEARCHING,
        TrackingPhase.ACQUIRING,
        HALT,
        None,
    )


def test_a_way_driven_between_two_pictures_is_taken_into_account() -> None:
    servo = VisualServo(latency_s=0.0)
    for _ in range(30):
        servo.see(view(1.5), FRAME_S)
    before = servo.see(view(1.5), FRAME_S)
    assert before.pose is not None
    after = servo.see(view(1.5 - before.command.forward_m_s * 0.3), 0.3)
    assert after.pose is not None
    assert before.pose.ahead_m - after.pose.ahead_m == pytest.approx(before.command.forward_m_s * 0.3, abs=0.02)


def test_places_the_target_cannot_be_seen_from_are_refused() -> None:
    for stop_m in (0.2, 2.0, math.nan):
        with pytest.raises(ValueError, match="before the board"):
            VisualServo(stop_m=stop_m)
    with pytest.raises(ValueError, match="latency"):
        VisualServo(latency_s=-0.1)


def test_bad_input_is_refused() -> None:
    servo = VisualServo()
    with pytest.raises(ValueError, match="grey"):
        servo.see(np.zeros((240, 320, 3), np.uint8), FRAME_S)
    with pytest.raises(ValueError, match="before the one before"):
        servo.see(view(1.0), -FRAME_S)
