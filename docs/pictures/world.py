"""Draws the pictures of rooms and camera views, and the landmark to print: ``.venv/bin/python docs/pictures/world.py``.

``rooms.jpg`` shows the example missions' rooms from above, ``views.jpg`` what Scouts in them see, drawn by OpenGL
and, below, by the painter. ``landmark.svg`` is the landmark at its true size, to be printed on paper of A3.
"""

from __future__ import annotations

import math
from pathlib import Path

from scout_model.gl_probe import prepare, probe

SUPPORT = probe()
prepare(SUPPORT.backend)

import cv2  # noqa: E402  mujoco must not be imported before the process is prepared for OpenGL
import msgspec  # noqa: E402
import mujoco  # noqa: E402
import numpy as np  # noqa: E402
from numpy.typing import NDArray  # noqa: E402

from backbone.mission.reader import read_mission  # noqa: E402
from scout_model.camera import Camera  # noqa: E402
from scout_model.description import WorldDescription  # noqa: E402
from scout_model.dimensions import (  # noqa: E402
    BLOB_DIAMETER_M,
    BLOBS_M,
    BOARD_HEIGHT_M,
    BOARD_WIDTH_M,
    HORIZONTAL_VIEW_RAD,
)
from scout_model.world import World  # noqa: E402

HERE = Path(__file__).parent
PROJECT = HERE.parents[1]
EXAMPLES = PROJECT / "docs" / "examples"
ROOMS = [
    ("IROS 2001, figure 3", PROJECT / "mission.xml", 14.0),
    ("RAM 2002, figure 9", EXAMPLES / "person.xml", 8.0),
    ("deployment.xml", EXAMPLES / "deployment.xml", 24.0),
    ("own-room.xml", EXAMPLES / "own-room.xml", 0.0),
]
VIEWS = [
    ("the Pioneer passes", PROJECT / "mission.xml", "scout1", 6.6),
    ("a person passes", EXAMPLES / "person.xml", "scout2", 11.0),
    ("over the box", EXAMPLES / "deployment.xml", "scout4", 1.0),
    ("under the desk", EXAMPLES / "deployment.xml", "scout3", 40.0),
    ("up the ramp", EXAMPLES / "deployment.xml", "scout2", 40.0),
    ("a room of one's own", EXAMPLES / "own-room.xml", "scout1", 0.0),
]
WIDTH_PX, HEIGHT_PX, QUALITY = 640, 440, 80
VIEW_DISTANCE_M = 3.0  # how far a field of view is drawn
INK = (40, 40, 200)
Image = NDArray[np.uint8]


def world_of(mission: Path) -> World:
    """Return the world of a mission file."""
    return World(described(mission))


def described(mission: Path) -> WorldDescription:
    """Return the description of a mission file's world."""
    [component] = read_mission(mission).components
    return msgspec.convert(component.parameters["world"], WorldDescription)


def after(world: World, time_s: float) -> World:
    """Let time pass."""
    while world.time_s < time_s:
        world.step_frame()
    return world


def titled(picture: Image, title: str) -> Image:
    """Return the picture with its title above it."""
    bar = np.full((26, picture.shape[1], 3), 255, np.uint8)
    cv2.putText(bar, title, (6, 18), cv2.FONT_HERSHEY_SIMPLEX, 0.5, (0, 0, 0), 1, cv2.LINE_AA)
    return np.asarray(np.vstack([bar, picture]), np.uint8)


class FromAbove:
    """A camera under the ceiling, at such a height that the room fills the picture."""

    def __init__(self, description: WorldDescription) -> None:
        self._middle_m = description.width_m / 2, description.depth_m / 2
        half_rad = math.radians(45.0) / 2
        share = HEIGHT_PX / WIDTH_PX
        self._height_m = max(description.depth_m / 2, description.width_m / 2 * share) * 1.12 / math.tan(half_rad)

    def draw(self, world: World) -> Image:
        """Return the room in color."""
        model = mujoco.MjModel.from_xml_string(world.mjcf)
        model.vis.global_.offwidth, model.vis.global_.offheight = WIDTH_PX, HEIGHT_PX
        model.vis.global_.fovy = 45.0
        model.vis.quality.offsamples = 4
        data = mujoco.MjData(model)
        state = mujoco.mjtState
        parts = state.mjSTATE_QPOS | state.mjSTATE_MOCAP_POS | state.mjSTATE_MOCAP_QUAT
        mujoco.mj_setState(model, data, world.state(), parts)
        mujoco.mj_forward(model, data)
        camera = mujoco.MjvCamera()
        camera.lookat[:] = (*self._middle_m, 0.0)
        camera.distance, camera.azimuth, camera.elevation = self._height_m, 90.0, -90.0
        with mujoco.Renderer(model, HEIGHT_PX, WIDTH_PX) as renderer:
            renderer.update_scene(data, camera)
            return np.asarray(cv2.cvtColor(renderer.render(), cv2.COLOR_RGB2BGR), np.uint8)

    def pixel(self, x_m: float, y_m: float) -> tuple[int, int]:
        """Return where a place on the floor is in the picture."""
        scale = HEIGHT_PX / 2 / math.tan(math.radians(45.0) / 2) / self._height_m
        east_m, north_m = x_m - self._middle_m[0], y_m - self._middle_m[1]
        return round(WIDTH_PX / 2 + east_m * scale), round(HEIGHT_PX / 2 - north_m * scale)


def plan(mission: Path, time_s: float) -> Image:
    """Return a room from above, with fields of view and paths."""
    description = described(mission)
    above, world = FromAbove(description), after(World(description), time_s)
    picture = above.draw(world)
    for scout in description.robots:
        x_m, y_m, heading_rad = world.pose(scout.name)
        eye = above.pixel(x_m, y_m)
        for side_rad in (-HORIZONTAL_VIEW_RAD / 2, HORIZONTAL_VIEW_RAD / 2):
            direction_rad = heading_rad + side_rad
            end = x_m + VIEW_DISTANCE_M * math.cos(direction_rad), y_m + VIEW_DISTANCE_M * math.sin(direction_rad)
            cv2.line(picture, eye, above.pixel(*end), INK, 1, cv2.LINE_AA)
        cv2.circle(picture, eye, 5, INK, -1, cv2.LINE_AA)
        cv2.putText(picture, scout.name, (eye[0] + 8, eye[1] + 12), cv2.FONT_HERSHEY_SIMPLEX, 0.42, INK, 1, cv2.LINE_AA)
    for target in description.targets:
        points = np.array([above.pixel(*point) for point in target.path], np.int32)
        cv2.polylines(picture, [points], False, (160, 90, 20), 1, cv2.LINE_AA)
    return picture


def views() -> Image:
    """Return what Scouts see, by OpenGL above and by the painter below."""
    columns = []
    for title, mission, robot, time_s in VIEWS:
        world = after(world_of(mission), time_s)
        column = []
        for backend in ("gl", "paint"):
            with Camera(world.mjcf, backend) as camera:  # type: ignore[arg-type]
                camera.show(world.state())
                column.append(cv2.cvtColor(camera.picture(robot), cv2.COLOR_GRAY2BGR))
        columns.append(titled(np.asarray(np.vstack(column), np.uint8), title))
    half = len(columns) // 2
    return np.asarray(np.vstack([np.hstack(columns[:half]), np.hstack(columns[half:])]), np.uint8)


def landmark() -> str:
    """Return the landmark as SVG in millimetres."""
    width_mm, height_mm, radius_mm = 1000 * BOARD_WIDTH_M, 1000 * BOARD_HEIGHT_M, 500 * BLOB_DIAMETER_M
    discs = "\n".join(
        f'  <circle cx="{width_mm / 2 + 1000 * right_m:g}" cy="{height_mm - 1000 * up_m:g}" r="{radius_mm:g}"/>'
        for right_m, up_m in BLOBS_M
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width_mm:g}mm" height="{height_mm:g}mm" '
        f'viewBox="0 0 {width_mm:g} {height_mm:g}">\n'
        f'  <rect width="{width_mm:g}" height="{height_mm:g}" fill="white" stroke="silver" stroke-width="0.3"/>\n'
        f"{discs}\n</svg>\n"
    )


def main() -> None:
    """Draw all three."""
    rooms = [titled(plan(mission, time_s), title) for title, mission, time_s in ROOMS]
    above = np.vstack([np.hstack(rooms[:2]), np.hstack(rooms[2:])])
    for name, picture in (("rooms.jpg", above), ("views.jpg", views())):
        cv2.imwrite(str(HERE / name), picture, [cv2.IMWRITE_JPEG_QUALITY, QUALITY])
    (HERE / "landmark.svg").write_text(landmark())


if __name__ == "__main__":
    main()
