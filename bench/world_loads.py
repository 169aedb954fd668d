"""The measurements of ``world.py`` with one backend; see there. OpenGL must be chosen by the environment."""

from __future__ import annotations

import argparse
import json
import struct
import subprocess
import sys
import time
from typing import Literal

import numpy as np
from measuring import percentile

from scout_model import radio_link
from scout_model.camera import Camera
from scout_model.description import Furniture, RobotPlace, Target, WorldDescription
from scout_model.dimensions import FRAMES_PER_S
from scout_model.video_link import Receiver, Signal
from scout_model.world import World

Backend = Literal["gl", "paint"]
SCOUTS, TRANSMITTING, RENDERERS = 10, 6, 2
PACKET_EVERY = 6  # frames; a radio's five packets a second to each robot
WARM_UP = 60  # frames until all stand on their wheels


def description() -> WorldDescription:
    """Return the papers' room with ten Scouts along the near wall."""
    return WorldDescription(
        9.0,
        6.0,
        seed=1,
        furniture=[Furniture(f"table{number}", 0.9 + 0.9 * number, 5.5, 0.6, 0.5, 0.7) for number in range(9)],
        robots=[
            RobotPlace(f"scout{number}", number, 0.8 * number, 1.0, 0.3 * number) for number in range(1, SCOUTS + 1)
        ],
        targets=[
            Target("pioneer", "pioneer", [(0.0, 3.0), (9.0, 3.0)], 0.5),
            Target("person", "person", [(0.0, 4.0), (9.0, 4.0)], 1.2),
        ],
    )


def drive(world: World, frame: int) -> None:
    """Drive the transmitting Scouts in circles."""
    if frame % PACKET_EVERY == 0:
        for network_id in range(1, TRANSMITTING + 1):
            world.hear(network_id, radio_link.encode_drive(4.0, 6.0))


def physics_factor(frames: int, *, driving: bool) -> float:
    """Return the speed of physics alone, as a multiple of real time."""
    world = World(description())
    for _ in range(WARM_UP):
        world.step_frame()
    begin_s = time.process_time()
    for frame in range(frames):
        if driving:
            drive(world, frame)
        world.step_frame()
    return frames / FRAMES_PER_S / (time.process_time() - begin_s)


def picture_times_s(backend: Backend, frames: int) -> tuple[list[float], list[float]]:
    """Return the times of new pictures, and of pictures that were drawn before, in seconds of this thread."""
    world, new, known = World(description()), [], []
    with Camera(world.mjcf, backend) as camera:
        for frame in range(frames):
            drive(world, frame)
            world.step_frame()
            state = world.state()
            for times_s in (new, known):
                begin_s = time.thread_time()
                camera.show(state)
                camera.picture("scout1")
                times_s.append(time.thread_time() - begin_s)
    return new, known


def render(backend: Backend, robots: list[str]) -> None:
    """Run as a drawing process: read states from standard input until it ends; then print the CPU time."""
    world = World(description())
    length = 8 * len(world.state())
    receivers = {robot: Receiver(1, robot) for robot in robots}
    with Camera(world.mjcf, backend, memo_pictures=0) as camera:
        answer(b".")
        begin_s, frame = time.process_time(), 0
        while len(state := sys.stdin.buffer.read(length)) == length:
            frame += 1
            camera.show(np.frombuffer(state, np.float64))
            for robot, receiver in receivers.items():
                receiver.receive([Signal(camera.picture(robot), robot, motors=0.3)], frame)
        answer(struct.pack("d", time.process_time() - begin_s))


def answer(raw: bytes) -> None:
    """Answer the process that draws with this one."""
    sys.stdout.buffer.write(raw)
    sys.stdout.buffer.flush()


def whole(backend: Backend, frames: int) -> tuple[float, float]:
    """Return the speed with six cameras and twelve bodies, as a multiple of real time, and the number of busy cores."""
    world = World(description())
    names = [f"scout{number}" for number in range(1, TRANSMITTING + 1)]
    program = [sys.executable, __file__, backend, "--render"]
    renderers = [
        subprocess.Popen([*program, *names[first::RENDERERS]], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        for first in range(RENDERERS)
    ]
    try:
        for _ in range(WARM_UP):
            world.step_frame()
        for renderer in renderers:
            assert renderer.stdout is not None
            assert renderer.stdout.read(1) == b"."
        begin_s, cpu_s = time.perf_counter(), -time.process_time()
        for frame in range(frames):
            drive(world, frame)
            world.step_frame()
            state = world.state().tobytes()
            for renderer in renderers:
                assert renderer.stdin is not None
                renderer.stdin.write(state)
                renderer.stdin.flush()
        cpu_s += time.process_time()
    finally:
        for renderer in renderers:
            assert renderer.stdin is not None
            renderer.stdin.close()
    for renderer in renderers:
        assert renderer.stdout is not None
        cpu_s += struct.unpack("d", renderer.stdout.read(8))[0]
        renderer.wait(10.0)
    simulated_s = frames / FRAMES_PER_S
    return simulated_s / (time.perf_counter() - begin_s), cpu_s / simulated_s


def main() -> None:
    """Measure with one backend and print a JSON line, or run as a drawing process."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("backend", choices=["gl", "paint"])
    parser.add_argument("--frames", type=int, default=300)
    parser.add_argument("--render", nargs="+", help="be a drawing process of these robots")
    asked = parser.parse_args()
    if asked.render:
        render(asked.backend, asked.render)
        return
    new, known = picture_times_s(asked.backend, asked.frames // 2)
    factor, cores = whole(asked.backend, asked.frames)
    measured = {
        "physics_standing_factor": round(physics_factor(asked.frames, driving=False)),
        "physics_six_driving_factor": round(physics_factor(asked.frames, driving=True)),
        "ms_a_picture": round(1e3 * percentile(new, 0.5), 2),
        "ms_a_known_picture": round(1e3 * percentile(known, 0.5), 3),
        "real_time_factor": round(factor, 2),
        "pictures_per_s": round(min(FRAMES_PER_S, FRAMES_PER_S * factor), 1),
        "cores_at_real_time": round(cores, 2),
    }
    print(json.dumps(measured))


if __name__ == "__main__":
    main()
