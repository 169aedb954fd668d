"""Cache of the last successful trial of a renderer, for all missions of this account until something changes.

A trial takes half a second of the start of a mission. ``keep`` writes a success down together with what the trial
depended on: the Python installation, the shared libraries that it loaded, the folders that name the vendors of OpenGL,
the devices, and the environment variables by which the libraries choose. ``recall`` returns the renderer if nothing of
that has changed. A failure is not kept, because its remedy is to install packages.
"""

from __future__ import annotations

import contextlib
import glob
import os
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import Literal

import msgspec

OpenGl = Literal["egl", "osmesa"]

FILE = "renderer.json"
VENDORS = ("/usr/share/glvnd/egl_vendor.d", "/etc/glvnd/egl_vendor.d")  # libglvnd reads these two
DEVICES = ("/dev/dri/*", "/dev/nvidia*", "/dev/dxg")  # of Mesa, of NVIDIA, of Windows' subsystem for Linux
CHOOSERS = ("CUDA_", "EGL_", "GALLIUM_", "LIBGL_", "MESA_", "MUJOCO_EGL_", "__EGL_", "__GL")


class GlTrial(msgspec.Struct, frozen=True):
    """A trial that drew a picture.

    Attributes:
        renderer: The name that OpenGL reports.
        libraries: Paths of the shared libraries loaded in the trial.
    """

    renderer: str
    libraries: list[str]


class KnownRenderer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A renderer that drew a picture, and the conditions of the trial.

    Attributes:
        backend: The OpenGL of the trial.
        renderer: The name that OpenGL gives it.
        installation: Folder of the Python installation.
        files: Library or folder → size in bytes and time of the last change in ns; None: it does not exist.
        devices: Device → whether this account may use it.
        environment: Environment variables that the libraries read.
    """

    backend: OpenGl
    renderer: str
    installation: str
    files: dict[str, tuple[int, int] | None]
    devices: dict[str, bool]
    environment: dict[str, str]


def recall() -> KnownRenderer | None:
    """Return the renderer of the last successful trial; None if there was no success or a condition has changed."""
    try:
        known = msgspec.json.decode(_path().read_bytes(), type=KnownRenderer)
    except (OSError, RuntimeError, msgspec.DecodeError):  # RuntimeError: the account has no home directory
        return None
    return known if known == _as_of_now(known.backend, known.renderer, known.files) else None


def keep(backend: OpenGl, trial: GlTrial) -> None:
    """Save the renderer of a successful trial; if the file cannot be written, the next mission makes a trial again."""
    with contextlib.suppress(OSError, RuntimeError):
        path = _path()
        path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        known = _as_of_now(backend, trial.renderer, (*trial.libraries, *VENDORS))
        path.write_bytes(msgspec.json.encode(known))


def forget() -> None:
    """Delete the saved renderer."""
    with contextlib.suppress(OSError, RuntimeError):
        _path().unlink()


def _path() -> Path:
    """Return the path of the file in the cache folder of the XDG base directory specification."""
    caches = os.environ.get("XDG_CACHE_HOME", "")
    return (Path(caches) if os.path.isabs(caches) else Path.home() / ".cache") / "scout-backbone" / FILE


def _as_of_now(backend: OpenGl, renderer: str, files: Iterable[str]) -> KnownRenderer:
    devices = {device: os.access(device, os.R_OK | os.W_OK) for pattern in DEVICES for device in glob.glob(pattern)}
    environment = {name: value for name, value in os.environ.items() if name.startswith(CHOOSERS)}
    states = {file: _state_of(file) for file in files}
    return KnownRenderer(backend, renderer, sys.prefix, states, devices, environment)


def _state_of(file: str) -> tuple[int, int] | None:
    try:
        found = os.stat(file)
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns
