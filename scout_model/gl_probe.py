"""Determine whether this machine can render, without importing mujoco in this process.

If MUJOCO_GL names a backend that does not work, importing mujoco raises errors of many kinds or ends the process.
Therefore each candidate is tried in a child process. Afterwards ``prepare`` sets this process up.
"""

from __future__ import annotations

import contextlib
import fcntl
import importlib
import logging
import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import msgspec

from scout_model import gl_known
from scout_model.gl_known import GlTrial, OpenGl

log = logging.getLogger(__name__)

Backend = OpenGl | Literal["none"]

MISSING_PACKAGES = "libegl1 libopengl0 libgl1-mesa-dri"  # measured on bare Debian 12: all three are needed
TRIAL_TIME_S = 20.0  # chosen: a trial takes half a second; a hanging driver must not hang a mission

FOUND_FILE = "gl_support.json"

_IN_SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader", "software rasterizer")  # as OpenGL reports them
_CANDIDATES: tuple[OpenGl, ...] = ("egl", "osmesa")  # OSMesa last: newer Mesa versions lack it
_CHOOSER = "mujoco.rendering.classic.gl_context"  # at its import it chooses the OpenGL that MUJOCO_GL names
_MUJOCO_GL: dict[Backend, str] = {"egl": "egl", "osmesa": "osmesa", "none": "disable"}


@dataclass(frozen=True, slots=True)
class GlSupport:
    """The OpenGL support of this machine.

    Attributes:
        backend: The OpenGL backend that works; ``none``: no backend works.
        renderer: Its name, such as ``llvmpipe (LLVM 15.0.6, 256 bits)``; empty without OpenGL.
        missing_packages: Debian packages that make rendering possible; empty if OpenGL works.
    """

    backend: Backend
    renderer: str
    missing_packages: str

    @property
    def has_card(self) -> bool:
        """Whether a graphics card renders, and not the processor."""
        return self.backend != "none" and not any(name in self.renderer.lower() for name in _IN_SOFTWARE)

    @property
    def camera_backend(self) -> Literal["gl", "paint"]:
        """The backend of ``scout_model.camera.Camera`` that draws as MuJoCo does, if there is one."""
        return "paint" if self.backend == "none" else "gl"

    @property
    def summary(self) -> str:
        """One line for people."""
        if self.backend == "none":
            return f"camera pictures are drawn, not rendered; for rendered ones install: {self.missing_packages}"
        return f"camera pictures are rendered by {self.renderer} over {self.backend}"


def probe(trial_time_s: float = TRIAL_TIME_S) -> GlSupport:
    """Return the OpenGL support of this machine.

    A backend that worked in an earlier mission is used without a trial; see ``gl_known``. Otherwise a trial blocks for
    about half a second; at worst, two trials block for their time limit.
    """
    if (known := gl_known.recall()) is not None:
        return GlSupport(known.backend, known.renderer, "")
    for backend in _CANDIDATES:
        if (trial := _try(backend, trial_time_s)) is not None:
            gl_known.keep(backend, trial)
            return GlSupport(backend, trial.renderer, "")
    return GlSupport("none", "", MISSING_PACKAGES)


def probe_once(folder: Path, trial_time_s: float = TRIAL_TIME_S) -> GlSupport:
    """Return the result of ``probe``; of all processes that use this folder, one probes and the others wait for it.

    If the folder is not writable, every process probes for itself, which is only slower.

    Args:
        folder: Folder for the result; delete it when the machine or its drivers may have changed.
        trial_time_s: As for ``probe``.
    """
    try:
        file = (folder / FOUND_FILE).open("a+b", buffering=0)
    except OSError as error:
        log.warning("what can draw here is not kept for others: %s", error)
        return probe(trial_time_s)
    with file:
        fcntl.flock(file, fcntl.LOCK_EX)  # released when the file is closed, even if the process dies
        file.seek(0)
        try:
            return msgspec.json.decode(file.read(), type=GlSupport)
        except msgspec.DecodeError:  # no probe has run yet, or it died while writing, or the disk was full
            file.truncate(0)
        support = probe(trial_time_s)
        try:
            file.write(msgspec.json.encode(support))
        except OSError as error:
            log.warning("what can draw here is not kept for others: %s", error)
        return support


def forget(folder: Path | None) -> None:
    """Make the next probe try again, because the saved backend no longer works; ``folder`` as for ``probe_once``."""
    gl_known.forget()
    if folder is not None:
        with contextlib.suppress(OSError):
            (folder / FOUND_FILE).unlink()


def prepare(backend: Backend) -> None:
    """Set this process up to draw with this backend.

    Without a backend, mujoco loads no OpenGL when it is imported. The import of a backend raises errors of many kinds
    if it does not work.
    """
    os.environ.update(_environment(backend))
    if backend != "none" and (chooser := sys.modules.get(_CHOOSER)) is not None:
        importlib.reload(chooser)


def _environment(backend: Backend) -> dict[str, str]:
    return {
        "MUJOCO_GL": _MUJOCO_GL[backend],
        "LP_NUM_THREADS": "0",  # keeps the software renderer on one core, at the same cost
        "OPENBLAS_NUM_THREADS": "1",  # numpy handles only small vectors here; threads would not help
    }


def _try(backend: OpenGl, trial_time_s: float) -> GlTrial | None:
    """Return the trial of this backend; None if it drew no picture."""
    environment = {**os.environ, **_environment(backend)}
    environment.pop("PYOPENGL_PLATFORM", None)  # mujoco sets it; a child process would inherit the wrong value
    try:
        trial = subprocess.run(
            [sys.executable, "-P", "-m", "scout_model.gl_trial"],
            env=environment,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            timeout=trial_time_s,
            check=False,
        )
    except subprocess.TimeoutExpired:
        return None
    for line in trial.stdout.splitlines() if trial.returncode == 0 else ():
        with contextlib.suppress(msgspec.DecodeError):  # a driver may print its own lines
            return msgspec.json.decode(line, type=GlTrial)
    return None
