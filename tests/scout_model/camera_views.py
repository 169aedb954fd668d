"""A program for the camera tests: draw the published geometry with a backend and save it.

OpenGL must be set up before mujoco is imported, so these pictures come from a process of their own.
Usage: python camera_views.py {egl|osmesa|none} FILE.npz
"""

import sys

from scout_model import gl_probe

VIEWS = [("pioneer", "scout1"), ("pioneer", "scout2"), ("empty", "scout1"), ("empty", "scout2"), ("pioneer", "scout3")]


def main() -> None:
    backend, file = sys.argv[1:]
    assert backend in ("egl", "osmesa", "none")
    gl_probe.prepare(backend)  # type: ignore[arg-type]
    import math

    import numpy as np

    from scout_model.camera import Camera
    from scout_model.description import Furniture, ScoutPlace, Target, WorldDescription
    from scout_model.world import World

    pictures = {}
    for scene, begins in (("pioneer", [(0.72, 3.0), (7.2, 3.0)]), ("empty", [(3.5, 3.0), (4.5, 3.0)])):
        world = World(
            WorldDescription(
                9.0,
                6.0,
                seed=1,
                furniture=[Furniture("table", 2.2, 5.0, 1.6, 0.7, 0.72)],
                scouts=[
                    ScoutPlace("scout1", 1, 0.72, 1.764, math.pi / 2),
                    ScoutPlace("scout2", 2, 7.20, 0.527, math.pi / 2),
                    ScoutPlace("scout3", 3, 4.5, 1.2, 2.4),
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
    np.savez(file, **pictures)


if __name__ == "__main__":
    main()
