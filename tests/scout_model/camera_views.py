"""A program for the camera tests: draw the published geometry with a backend and save it.

A process can load only one OpenGL, so these pictures come from a process of their own.
Usage: python camera_views.py {egl|osmesa|none} FILE.npz [late]
With "late", mujoco is imported before the backend is set up.
"""

import importlib
import os
import sys

from scout_model import gl_probe

VIEWS = [("pioneer", "scout1"), ("pioneer", "scout2"), ("empty", "scout1"), ("empty", "scout2"), ("pioneer", "scout3")]
THINGS = ("scout1", "scout2", "scout3", "scout4")


def main() -> None:
    backend, file, *options = sys.argv[1:]
    if options == ["late"]:
        os.environ["MUJOCO_GL"] = "disable"
        importlib.import_module("mujoco")
    assert backend in ("egl", "osmesa", "none")
    gl_probe.prepare(backend)  # type: ignore[arg-type]
    import math

    import numpy as np

    from scout_model.camera import Camera
    from scout_model.description import DarkPlace, Furniture, Landmark, Ramp, RobotPlace, Target, WorldDescription
    from scout_model.world import World

    pictures = {}
    for scene, begins in (("pioneer", [(0.72, 3.0), (7.2, 3.0)]), ("empty", [(3.5, 3.0), (4.5, 3.0)])):
        world = World(
            WorldDescription(
                9.0,
                6.0,
                seed=1,
                furniture=[Furniture("table", 2.2, 5.0, 1.6, 0.7, 0.72)],
                robots=[
                    RobotPlace("scout1", 1, 0.72, 1.764, math.pi / 2),
                    RobotPlace("scout2", 2, 7.20, 0.527, math.pi / 2),
                    RobotPlace("scout3", 3, 4.5, 1.2, 2.4),
                ],
                targets=[
                    Target(f"pioneer{number}", "pioneer", [begin, (begin[0] + 0.01, 3.0)], 0.5, begin_s=100.0)
                    for number, begin in enumerate(begins)
                ],
            )
        )
        with Camera(world.mjcf, "paint" if backend == "none" else "gl") as camera:
            camera.show(world.state())
            pictures.update({f"{shown}_{robot}": camera.picture(robot) for shown, robot in VIEWS if shown == scene})
    world = World(
        WorldDescription(
            9.0,
            6.0,
            seed=1,
            furniture=[
                Furniture("desk", 4.0, 5.2, 1.4, 1.2, 0.5, "table"),
                Furniture("step", 5.3, 4.0, 0.5, 0.5, 0.05),
            ],
            ramps=[Ramp("ramp", 3.0, 3.9, 0.8, 0.6, 0.2, math.pi / 2)],
            landmarks=[Landmark("home", 2.0, 2.0, -0.6)],
            dark_places=[DarkPlace("corner", 8.5, 5.5, 1.0, 1.0, 0.6)],
            robots=[
                RobotPlace("scout1", 1, 3.0, 2.9, math.pi / 2),
                RobotPlace("scout2", 2, 4.0, 3.6, math.pi / 2),
                RobotPlace("scout3", 3, 2.8, 1.5, 2.6),
                RobotPlace("scout4", 4, 7.3, 4.3, math.pi / 4),
                RobotPlace("hidden", 5, 8.2, 5.2, 0.0),
            ],
            targets=[Target("carrier", "carrier", [(4.3, 4.4), (5.0, 4.4)], 0.5, begin_s=100.0)],
        )
    )
    with Camera(world.mjcf, "paint" if backend == "none" else "gl") as camera:
        pictures.update({f"things_{robot}": camera.picture(robot) for robot in THINGS})
    np.savez(file, **pictures)


if __name__ == "__main__":
    main()
