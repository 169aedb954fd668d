"""A pytest plugin that plays another platform for the packages: it refuses what one system only has.

* A module of the layer is a fake, each of whose functions refuses.
* For files of the packages, modules of one system cannot be imported, and functions of ``os`` that it alone has refuse.
* A file of the packages cannot open anything below ``/proc``.

Python itself, pytest and libraries go on as they are: they have ports of their own.
"""

from __future__ import annotations

import builtins
import os
import sys
from collections.abc import Callable
from importlib.machinery import ModuleSpec
from pathlib import Path
from types import ModuleType
from typing import Any

sys.path.insert(0, str(Path(__file__).parent))
from system_calls import FOLDERS, IMPORTS, OS

PACKAGES = frozenset({"backbone", "resource_pool", "mission_control", "ui_console", "scout_model"})
LAYER = "backbone.operating_system"


class NotOnThisPlatform(Exception):
    """A file of the packages used what this platform lacks."""


class RefusingModule(ModuleType):
    """A module of the layer on a platform to which nobody has ported it."""

    def __getattr__(self, name: str) -> Callable[..., Any]:
        if name.startswith("_"):
            raise AttributeError(name)

        def refuse(*_given: object, **_named: object) -> Any:
            raise NotOnThisPlatform(f"{self.__name__}.{name}")

        return refuse


class FakeLayer:
    """Finds the modules of the layer, and makes fakes of them."""

    def find_spec(self, name: str, _path: object = None, _target: object = None) -> ModuleSpec | None:
        return ModuleSpec(name, self, is_package=name == LAYER) if name.startswith(LAYER) else None  # type: ignore[arg-type]

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        return RefusingModule(spec.name)

    def exec_module(self, module: ModuleType) -> None:
        """Nothing is in it."""


def is_ours(frame: Any) -> bool:
    return str(frame.f_globals.get("__name__", "")).partition(".")[0] in PACKAGES


def refuse_modules() -> None:
    real = builtins.__import__

    def importing(name: str, given: Any = None, *others: Any, **named: Any) -> ModuleType:
        importer = str((given or {}).get("__name__", ""))
        is_of_a_library = isinstance((*others, None, None)[1], list)  # its native code imports, with our globals
        is_own = importer.partition(".")[0] in PACKAGES and not is_of_a_library
        if is_own and name.partition(".")[0] in IMPORTS:
            raise ImportError(f"{importer}: {name} is not on this platform")
        return real(name, given, *others, **named)

    builtins.__import__ = importing


def refuse_functions() -> None:
    for name in OS:
        if callable(real := getattr(os, name, None)):
            setattr(os, name, _refusing(name, real))


def _refusing(name: str, real: Callable[..., Any]) -> Callable[..., Any]:
    def called(*given: Any, **named: Any) -> Any:
        if is_ours(caller := sys._getframe(1)):  # noqa: SLF001  as logging does
            raise NotOnThisPlatform(f"{caller.f_globals['__name__']}: os.{name}")
        return real(*given, **named)

    return called


def hear(event: str, arguments: tuple[Any, ...]) -> None:
    if event in {"open", "os.listdir", "os.scandir"} and str(arguments[0]).startswith(FOLDERS[0]):
        frame: Any = sys._getframe(1)  # noqa: SLF001
        while frame is not None and frame.f_globals.get("__name__") in {"pathlib", "io", "os"}:
            frame = frame.f_back
        if frame is not None and is_ours(frame):
            raise NotOnThisPlatform(f"{frame.f_globals['__name__']}: {arguments[0]}")


assert not PACKAGES & sys.modules.keys(), "load this plugin first: -p other_platform"
sys.meta_path.insert(0, FakeLayer())  # type: ignore[arg-type]
refuse_modules()
refuse_functions()
sys.addaudithook(hear)
