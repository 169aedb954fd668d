"""SharedCamera: one renderer and one drawing thread for all simulated framegrabbers of a process that show one world.

A renderer takes much more memory and time to open than its pictures. On a virtual clock the worlds of an experiment
come one after the other, so there a renderer outlives its users.
"""

from __future__ import annotations

import asyncio
import functools
import importlib
from concurrent.futures import ThreadPoolExecutor
from typing import Any, NamedTuple

from scout_model.gl_probe import Backend, prepare

CAMERAS_KEPT = 2  # chosen: enough for one experiment, or for two that alternate
PICTURES_KEPT = 256  # chosen: 20 MB for each of these cameras; the worlds of an experiment pass the same states


class _Key(NamedTuple):
    mjcf: str
    gl: Backend
    paints_first: bool
    lasts: bool


_open: dict[_Key, SharedCamera] = {}


class SharedCamera:
    """The renderer of a world in this process; use ``join`` and ``leave`` in one event loop.

    Attributes:
        thread: The only thread that may open and use the camera.
        users: How many use it.
    """

    def __init__(self, key: _Key) -> None:
        self.thread = ThreadPoolExecutor(1, thread_name_prefix="camera")
        self.users = 0
        self._key = key
        self._camera: Any = None

    @classmethod
    def join(cls, mjcf: str, gl: Backend, *, paints_first: bool, lasts: bool) -> SharedCamera:
        """Return the shared camera of this world, for one more user.

        Args:
            mjcf: Model of the world.
            gl: OpenGL that renders; ``none``: the painter draws.
            paints_first: True: the painter draws also where OpenGL could, unless the pictures would lack something.
            lasts: True: the renderer outlives its users.
        """
        key = _Key(mjcf, gl, paints_first, lasts)
        if (shared := _open.get(key)) is None:
            shared = _open[key] = cls(key)
        shared.users += 1
        return shared

    def opened(self) -> Any:
        """Return the ``scout_model.camera.Camera``; the first call opens it. When: in ``thread``."""
        if self._camera is None:
            self._camera = _lasting_camera(self._key) if self._key.lasts else _new_camera(self._key)
        return self._camera

    async def leave(self) -> None:
        """End the use by one user. After the last one, the camera is closed, unless it lasts."""
        self.users -= 1
        if self.users:
            return
        del _open[self._key]
        try:
            await asyncio.get_running_loop().run_in_executor(self.thread, self._close)
        finally:
            self.thread.shutdown(wait=False)

    def _close(self) -> None:
        if self._camera is not None and not self._key.lasts:
            self._camera.close()


def _new_camera(key: _Key, *memo_pictures: int) -> Any:
    prepare("none")  # the painter and the world's model need MuJoCo, and no OpenGL
    cameras = importlib.import_module("scout_model.camera")
    if key.gl == "none" or (key.paints_first and not cameras.unpainted(key.mjcf)):
        return cameras.Camera(key.mjcf, "paint", *memo_pictures)
    prepare(key.gl)
    return cameras.Camera(key.mjcf, "gl", *memo_pictures)


@functools.lru_cache(maxsize=CAMERAS_KEPT)
def _lasting_camera(key: _Key) -> Any:
    """Return the camera that all worlds of this model share in this process, one after the other on virtual clocks.

    One thread draws all worlds, and a picture depends only on the world's state. So pictures cached for one world are
    valid for the next.
    """
    return _new_camera(key, PICTURES_KEPT)
