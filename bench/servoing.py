"""Servoing in the loop without a bus: a simulated Scout, its camera, the air, the tracker and the servo law.

Each trial begins up to 2.5 m from the board, up to 45 degrees off its zero-angle line, with any heading. It succeeds if
the robot reports its arrival and truly stands within 5 cm and 10 degrees of its place. Prints a table and one JSON
line.
"""

from __future__ import annotations

import argparse
import math
import time
from dataclasses import dataclass

import numpy as np
from measuring import percentile, report
from numpy.typing import NDArray

from mission_control.vision.servo_law import HALT, STOP_M, SpeedCommand, Stage
from mission_control.vision.visual_servo import VisualServo
from scout_model.camera import Camera
from scout_model.description import CLEAN_AIR, AirDescription, Landmark, RobotPlace, WorldDescription
from scout_model.dimensions import FRAMES_PER_S, WHEEL_SPEED_LIMIT_RAD_S
from scout_model.radio_link import encode_drive
from scout_model.scout import wheels_rad_s
from scout_model.video_link import Receiver, Signal
from scout_model.world import World

ROOM_M = (6.0, 8.0)
BOARD = Landmark("home", 5.5, 4.0, math.pi)
NEAREST_M, FARTHEST_M = 1.0, 2.5
OFF_AXIS_RAD = math.radians(45.0)
WITHIN_M, WITHIN_RAD = 0.05, math.radians(10.0)
LIMIT_S = 180.0
LATENCY_FRAMES = 2  # from a frame's capture until its command arrives


@dataclass(frozen=True)
class Trial:
    """The result of one approach; angles in radians."""

    seed: int
    range_m: float
    off_axis_rad: float
    stage: Stage
    took_s: float
    aside_m: float
    ahead_m: float
    heading_rad: float
    approaches: int
    tracked: float

    @property
    def succeeded(self) -> bool:
        """Whether it ended at its place."""
        is_there = math.hypot(self.aside_m, self.ahead_m) <= WITHIN_M and abs(self.heading_rad) <= WITHIN_RAD
        return self.stage is Stage.ARRIVED and is_there


def run(seed: int, air: AirDescription, *, limit_s: float = LIMIT_S) -> Trial:
    """Simulate one approach."""
    rng = np.random.default_rng(seed)
    range_m = float(rng.uniform(NEAREST_M, FARTHEST_M))
    off_axis_rad = float(rng.uniform(-OFF_AXIS_RAD, OFF_AXIS_RAD))
    ahead_m, left_m = range_m * math.cos(off_axis_rad), range_m * math.sin(off_axis_rad)
    place = RobotPlace("scout", 1, BOARD.x_m - ahead_m, BOARD.y_m + left_m, float(rng.uniform(-math.pi, math.pi)))
    world = World(WorldDescription(*ROOM_M, seed=seed, robots=[place], landmarks=[BOARD]))
    receiver, servo = Receiver(seed, "A", air), VisualServo()
    sent: list[SpeedCommand] = [HALT] * LATENCY_FRAMES
    frames = tracked = 0
    step = None
    with Camera(world.mjcf, "paint") as camera:
        while world.time_s < limit_s and servo.stage is not Stage.ARRIVED:
            now = sent.pop(0)
            world.hear(1, encode_drive(*wheels_rad_s(now.forward_m_s, now.turn_rad_s)))
            world.step_frame()
            camera.show(world.state())
            step = servo.see(_received(receiver, world, camera), 1 / FRAMES_PER_S)
            sent.append(step.command)
            frames += 1
            tracked += step.pose is not None
        for _ in range(FRAMES_PER_S):
            world.hear(1, encode_drive(0.0, 0.0))
            world.step_frame()
    x_m, y_m, heading_rad = world.pose("scout")
    return Trial(
        seed,
        range_m,
        off_axis_rad,
        servo.stage,
        world.time_s - 1.0,
        y_m - BOARD.y_m,
        BOARD.x_m - x_m - STOP_M,
        heading_rad,
        servo.approaches,
        tracked / frames,
    )


def _received(receiver: Receiver, world: World, camera: Camera) -> NDArray[np.uint8]:
    speeds = world.wheel_speeds("scout")
    motors = min(1.0, sum(abs(speed) for speed in speeds) / 2 / WHEEL_SPEED_LIMIT_RAD_S)
    return receiver.receive([Signal(camera.picture("scout"), "scout", motors=motors)], world.frame).picture


def table_line(trial: Trial) -> str:
    """Return the line of this trial in the table."""
    off_axis_deg, heading_deg = math.degrees(trial.off_axis_rad), math.degrees(trial.heading_rad)
    return (
        f"{trial.seed:5d} from {trial.range_m:.2f} m {off_axis_deg:+4.0f}°: {trial.stage} in {trial.took_s:5.1f} s,"
        f" {trial.approaches} approaches, tracked {trial.tracked:4.0%}, aside {trial.aside_m * 100:+5.1f} cm,"
        f" ahead {trial.ahead_m * 100:+5.1f} cm, heading {heading_deg:+5.1f}°{'' if trial.succeeded else ' FAILED'}"
    )


def main() -> None:
    """Run the trials and print their results."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--trials", type=int, default=20)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--noise", type=float, default=1.0, help="scale of the air's noise: 0 none, 1 as the papers")
    parser.add_argument("--table", action="store_true", help="print every trial")
    chosen = parser.parse_args()
    air = CLEAN_AIR if chosen.noise == 0 else AirDescription(noise=chosen.noise)
    began_s, trials = time.process_time(), []
    for number in range(chosen.trials):
        trial = run(chosen.seed + number, air)
        trials.append(trial)
        if chosen.table:
            print(table_line(trial), flush=True)
    took_s = [trial.took_s for trial in trials]
    simulated_s = sum(took_s)
    report(
        "servoing",
        trials=len(trials),
        seed=chosen.seed,
        noise=chosen.noise,
        succeeded=sum(trial.succeeded for trial in trials),
        median_s=round(percentile(took_s, 0.5), 1),
        longest_s=round(max(took_s), 1),
        median_off_cm=round(100 * percentile([math.hypot(t.aside_m, t.ahead_m) for t in trials], 0.5), 1),
        reapproached=sum(trial.approaches > 1 for trial in trials),
        tracked=round(sum(t.tracked * t.took_s for t in trials) / simulated_s, 3),
        times_real_time=round(simulated_s / (time.process_time() - began_s), 1),
    )


if __name__ == "__main__":
    main()
