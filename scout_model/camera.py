"""The robots' cameras: draw pictures of a world from its MJCF and its state.

Two backends draw the same scene: ``gl`` renders with MuJoCo's classic OpenGL renderer, ``paint`` needs no OpenGL
(``scout_model.painter``). Draw in the process that needs the picture, not in the one that runs physics: a state vector
of a few hundred bytes is enough.

A picture that was drawn before comes from a cache. The cache's key is the poses of the camera and of all moving bodies
in its view, so a robot elsewhere does not matter. States are rounded before drawing: a picture depends only on the
rounded state, not on the first of the states that round to it.

For ``gl``, this process must call ``scout_model.gl_probe.prepare`` first. A camera may be used only in the thread that
created it.
"""

from __future__ import annotations

import math
import os
from collections import OrderedDict
from types import TracebackType
from typing import Literal, Protocol

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from scout_model.composition import model_of
from scout_model.dimensions import DARKNESS, PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX
from scout_model.errors import RenderingUnavailable, StateMismatch, UnknownBody
from scout_model.painter import Painter, only_opengl_shows
from scout_model.world import STATE

MEMO_PICTURES = 16  # chosen: 1.2 MB; a standing robot's view while nothing moves, for each of some robots
MORE_GEOMS = 200  # chosen: tendons and rangefinders of a robot of one's own; MuJoCo's default of 10 000 takes 10 MB

_STATE_DECIMALS = 5  # chosen: a hundredth of a millimetre, a fiftieth of a pixel at the nearest
_MARGIN_M = 0.002  # chosen: a line is drawn up to a pixel wider than its true width
_SEEN_GROUPS = 2  # the greatest visible geom group, see room.xml
_DARK = "dark/"  # prefix of the names of dark sites


def unpainted(mjcf: str) -> list[str]:
    """Return what pictures of a world with this ``World.mjcf`` have by ``gl`` and would lack by ``paint``."""
    return only_opengl_shows(model_of(mjcf))


class _Drawing(Protocol):
    def draw(self, data: mujoco.MjData, camera: int) -> NDArray[np.uint8]: ...

    def close(self) -> None: ...


class _GlDrawing:
    """Pictures by MuJoCo's classic renderer; the settings that make it fast are in ``room.xml``."""

    def __init__(self, model: mujoco.MjModel) -> None:
        if os.environ.get("MUJOCO_GL") not in ("egl", "osmesa"):
            raise RenderingUnavailable("MUJOCO_GL names no OpenGL that draws without a screen")
        try:
            most = model.ngeom + model.nsite + MORE_GEOMS
            self._renderer = mujoco.Renderer(model, PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX, most)
        except (mujoco.FatalError, AttributeError, ImportError, RuntimeError) as error:
            raise RenderingUnavailable(f"MuJoCo has no OpenGL in this process: {error}") from error
        self._colors = np.empty((PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX, 3), np.uint8)
        flags = self._renderer.scene.flags
        for flag in (mujoco.mjtRndFlag.mjRND_SHADOW, mujoco.mjtRndFlag.mjRND_REFLECTION):
            flags[flag] = False

    def draw(self, data: mujoco.MjData, camera: int) -> NDArray[np.uint8]:
        self._renderer.update_scene(data, camera)
        self._renderer.render(out=self._colors)
        return np.asarray(cv2.cvtColor(self._colors, cv2.COLOR_RGB2GRAY), np.uint8)

    def close(self) -> None:
        self._renderer.close()


class Camera:
    """The cameras of all robots of one world; until the first ``show`` they show the world as built.

    Args:
        mjcf: ``World.mjcf``.
        backend: ``gl`` or ``paint``.
        memo_pictures: Size of the cache in pictures of 77 kB; 0: no cache.

    Attributes:
        lacks: What the pictures lack that they would have by ``gl``.

    Raises:
        RenderingUnavailable: ``gl``, but this process has no OpenGL.
    """

    def __init__(self, mjcf: str, backend: Literal["gl", "paint"], memo_pictures: int = MEMO_PICTURES) -> None:
        self._model = model_of(mjcf)
        self._data = mujoco.MjData(self._model)
        self._cameras = {
            self._model.camera(camera).name.rpartition("/")[0]: camera for camera in range(self._model.ncam)
        }
        self._drawing: _Drawing
        self.lacks = list[str]()
        match backend:
            case "gl":
                self._drawing = _GlDrawing(self._model)
            case "paint":
                self._drawing, self.lacks = Painter(self._model), only_opengl_shows(self._model)
            case _:
                raise ValueError(f"no backend {backend!r}; there are 'gl' and 'paint'")
        self._movers = _Movers(self._model)
        # MuJoCo's arrays stay where they are; each look-up of one in its data makes a new array of it.
        self._eyes_m = self._data.cam_xpos
        self._shade = _Shade(self._model)
        self._memo: OrderedDict[bytes, NDArray[np.uint8]] = OrderedDict()
        self._memo_pictures = memo_pictures
        self.drawn = 0
        """How many pictures were drawn, not found in the memo."""
        self._shown = b""
        self._pictures: dict[int, NDArray[np.uint8]] = {}  # those of this state
        self._length = mujoco.mj_stateSize(self._model, STATE)
        state = np.empty(self._length)
        mujoco.mj_getState(self._model, self._data, state, STATE)
        self.show(state)

    def __enter__(self) -> Camera:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def show(self, state: NDArray[np.float64]) -> None:
        """Set the state of the world for the following pictures.

        Args:
            state: ``World.state()`` of a world with this MJCF.

        Raises:
            StateMismatch: The vector's length is not that of this world's states.
        """
        if state.shape != (self._length,):
            raise StateMismatch(f"a state of shape {state.shape}, this world's have {self._length} numbers")
        # Adding zero turns a negative zero into a positive one, because their bits differ.
        rounded = state.round(_STATE_DECIMALS) + 0.0
        if (shown := rounded.tobytes()) == self._shown:
            return
        self._shown = shown
        self._pictures.clear()
        mujoco.mj_setState(self._model, self._data, rounded, STATE)
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
        self._shade.fall(self._data)

    def picture(self, robot: str) -> NDArray[np.uint8]:
        """Return the picture of this robot's camera: grey levels 0 to 255, shape (240, 320), row 0 on top; read-only.

        Raises:
            UnknownBody: No robot with a camera has this name.
        """
        camera = self._camera_of(robot)
        picture = self._pictures.get(camera)
        if picture is None:
            picture = self._remembered(camera)
            if self._memo_pictures:
                self._pictures[camera] = picture
        return picture

    def _remembered(self, camera: int) -> NDArray[np.uint8]:
        seen = self._movers.seen(self._data, camera, self._shade.is_dark)
        picture = self._memo.get(seen)
        if picture is not None:
            self._memo.move_to_end(seen)
            return picture
        picture = self._drawing.draw(self._data, camera)
        picture.flags.writeable = False
        self.drawn += 1
        self._memo[seen] = picture
        while len(self._memo) > self._memo_pictures:
            self._memo.popitem(last=False)
        return picture

    def position_m(self, robot: str) -> tuple[float, float, float]:
        """Return the position of this robot's camera: x, y, z in metres.

        Raises:
            UnknownBody: No robot with a camera has this name.
        """
        x_m, y_m, z_m = self._eyes_m[self._camera_of(robot)].tolist()
        return x_m, y_m, z_m

    def _camera_of(self, robot: str) -> int:
        if robot not in self._cameras:
            raise UnknownBody(f"no robot named {robot!r} has a camera")
        return self._cameras[robot]

    def close(self) -> None:
        """Free the graphics context; may be called again."""
        self._drawing.close()


class _Movers:
    """The visible moving bodies, each with a bounding sphere of its visible geoms."""

    def __init__(self, model: mujoco.MjModel) -> None:
        seen = model.geom_group <= _SEEN_GROUPS
        moves = (model.body_weldid != 0) | (model.body_mocapid[model.body_rootid] >= 0)
        geoms = [np.flatnonzero(seen & moves[model.geom_bodyid] & (model.geom_bodyid == n)) for n in range(model.nbody)]
        self._bodies = np.array([body for body in range(model.nbody) if len(geoms[body])], np.intp)
        self._roots = model.body_rootid[self._bodies]
        self._middles_m = np.array([model.geom_pos[geoms[body]].mean(axis=0) for body in self._bodies]).reshape(-1, 3)
        radii_m = [
            (np.linalg.norm(model.geom_pos[geoms[body]] - middle_m, axis=1) + model.geom_rbound[geoms[body]]).max()
            for body, middle_m in zip(self._bodies, self._middles_m, strict=True)
        ]
        self._reach_m = np.array(radii_m).reshape(-1, 1) + _MARGIN_M
        self._outwards = [_outwards(math.radians(fovy_deg) / 2) for fovy_deg in model.cam_fovy.tolist()]

    def seen(self, data: mujoco.MjData, camera: int, is_dark: NDArray[np.bool_]) -> bytes:
        """Return a cache key: equal exactly if this camera and the moving bodies in its view have the same poses."""
        bodies, eye_m, axes = self._bodies, data.cam_xpos[camera], data.cam_xmat[camera].reshape(3, 3)
        middles_m = np.einsum("nij,nj->ni", data.xmat[bodies].reshape(-1, 3, 3), self._middles_m) + data.xpos[bodies]
        outside_m = (middles_m - eye_m) @ (axes @ self._outwards[camera])
        in_view = (outside_m < self._reach_m).all(axis=1)
        shown = bodies[in_view]
        return b"".join(
            (
                camera.to_bytes(4, "little"),
                eye_m.tobytes(),
                axes.tobytes(),
                shown.tobytes(),
                data.xpos[shown].tobytes(),
                data.xquat[shown].tobytes(),
                is_dark[self._roots[in_view]].tobytes(),
            )
        )


def _outwards(down_rad: float) -> NDArray[np.float64]:
    """Return the normals of the planes around a camera's view, in its frame: right, left, top, bottom and behind.

    Args:
        down_rad: Half of its vertical view.
    """
    across_rad = math.atan(math.tan(down_rad) * PICTURE_WIDTH_PX / PICTURE_HEIGHT_PX)
    across, up = math.cos(across_rad), math.cos(down_rad)
    behind = [math.sin(across_rad), math.sin(across_rad), math.sin(down_rad), math.sin(down_rad), 1.0]
    return np.array([[across, -across, 0.0, 0.0, 0.0], [0.0, 0.0, up, -up, 0.0], behind])


class _Shade:
    """Darkens moving bodies while they are in a dark place; the room's own shade is part of its MJCF."""

    def __init__(self, model: mujoco.MjModel) -> None:
        self._model = model
        self._colors = model.geom_rgba.copy()
        moves = (model.body_weldid != 0) | (model.body_mocapid >= 0)
        self._roots = np.array(sorted(set(model.body_rootid[moves])))  # np.unique would import numpy.ma, 2 MB
        self._root_of_geom = model.body_rootid[model.geom_bodyid]
        sites = [site for site in range(model.nsite) if model.site(site).name.startswith(_DARK)]
        self._low_m = model.site_pos[sites] - model.site_size[sites]
        self._high_m = model.site_pos[sites] + model.site_size[sites]
        self.is_dark = np.zeros(model.nbody, np.bool_)

    def fall(self, data: mujoco.MjData) -> None:
        """Make robots and targets as dark as their present place."""
        if not len(self._low_m):
            return
        middles_m = data.xpos[self._roots][:, np.newaxis]
        is_dark = ((self._low_m <= middles_m) & (middles_m <= self._high_m)).all(axis=2).any(axis=1)
        if np.array_equal(is_dark, self.is_dark[self._roots]):
            return
        self.is_dark[self._roots] = is_dark
        colors = self._colors.copy()
        colors[self.is_dark[self._root_of_geom], :3] *= DARKNESS
        self._model.geom_rgba[:] = colors
