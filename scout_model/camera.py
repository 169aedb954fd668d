"""The Scouts' cameras: pictures of a world, from its MJCF and its state.

Two backends draw the same scene: ``gl`` renders with MuJoCo's classic OpenGL renderer, ``paint``
needs no OpenGL (``scout_model.painter``).  Draw where a picture is wanted, not where physics runs:
a state vector of a few hundred bytes is enough.

For ``gl``, ``scout_model.gl_probe.prepare`` must have run in this process before anything imported
mujoco, this module included.  A camera belongs to the thread that made it.
"""

from __future__ import annotations

import os
from types import TracebackType
from typing import Literal, Protocol

import cv2
import mujoco
import numpy as np
from numpy.typing import NDArray

from scout_model.dimensions import PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX
from scout_model.errors import RenderingUnavailable, StateMismatch, UnknownBody
from scout_model.painter import Painter
from scout_model.world import STATE


class _Drawing(Protocol):
    def draw(self, data: mujoco.MjData, camera: int) -> NDArray[np.uint8]: ...

    def close(self) -> None: ...


class _GlDrawing:
    """Pictures by MuJoCo's classic renderer; what makes it fast stands in ``room.xml``."""

    def __init__(self, model: mujoco.MjModel) -> None:
        if os.environ.get("MUJOCO_GL") not in ("egl", "osmesa"):
            raise RenderingUnavailable("MUJOCO_GL names no OpenGL that draws without a screen")
        try:
            self._renderer = mujoco.Renderer(model, PICTURE_HEIGHT_PX, PICTURE_WIDTH_PX)
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
    """The cameras of all Scouts of one world, showing it as built until the first ``show``.

    Args:
        mjcf: ``World.mjcf``.
        backend: ``gl`` or ``paint``.

    Raises:
        RenderingUnavailable: ``gl``, but this process has no OpenGL.
    """

    def __init__(self, mjcf: str, backend: Literal["gl", "paint"]) -> None:
        self._model = mujoco.MjModel.from_xml_string(mjcf)
        self._data = mujoco.MjData(self._model)
        self._cameras = {
            self._model.camera(camera).name.rpartition("/")[0]: camera for camera in range(self._model.ncam)
        }
        self._drawing: _Drawing
        match backend:
            case "gl":
                self._drawing = _GlDrawing(self._model)
            case "paint":
                self._drawing = Painter(self._model)
            case _:
                raise ValueError(f"no backend {backend!r}; there are 'gl' and 'paint'")
        self._place()

    def __enter__(self) -> Camera:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def show(self, state: NDArray[np.float64]) -> None:
        """Let the following pictures show the world in this state.

        Args:
            state: ``World.state()`` of a world with this MJCF.

        Raises:
            StateMismatch: It has not the length of this world's states.
        """
        length = mujoco.mj_stateSize(self._model, STATE)
        if state.shape != (length,):
            raise StateMismatch(f"a state of shape {state.shape}, this world's have {length} numbers")
        mujoco.mj_setState(self._model, self._data, state, STATE)
        self._place()

    def picture(self, robot: str) -> NDArray[np.uint8]:
        """Return what this Scout's camera sees: grey levels 0 to 255, shape (240, 320), row 0 on top.

        Raises:
            UnknownBody: No Scout has this name.
        """
        camera = self._cameras.get(robot)
        if camera is None:
            raise UnknownBody(f"no Scout named {robot!r}")
        return self._drawing.draw(self._data, camera)

    def close(self) -> None:
        """Free the graphics context; may be called again."""
        self._drawing.close()

    def _place(self) -> None:
        mujoco.mj_kinematics(self._model, self._data)
        mujoco.mj_camlight(self._model, self._data)
