"""Reading the file of a class anew, so that an exchange uses the present code of the file.

Rules of this file:

* The file becomes another module object, so the running code keeps everything that it refers to. ``importlib.reload``
  would replace functions that the old class still uses.
* Python's cache of compiled files is not used, because it recognizes an edit only by the file's length and its time in
  whole seconds.
* The running classes of values (structs and enumerations at the top of the file) stay in use, because other modules
  refer to them. So the file must declare them as before.
* Only the named file is read anew, not the files that it imports.
* One file is read at a time, because components of one process may exchange classes of the same file at once.
"""

from __future__ import annotations

import asyncio
import importlib
import importlib.machinery
import importlib.util
import sys
from collections.abc import Callable
from enum import Enum
from functools import partial
from types import ModuleType
from typing import Generic, TypeVar
from weakref import WeakKeyDictionary

import msgspec

from backbone.errors import Refusal, complaint
from backbone.exchange_course import UNPROVED
from backbone.waiting import in_thread_within

T = TypeVar("T")
READ_WITHIN_S = 20.0  # chosen: an import of the largest libraries on a busy machine; the command waits for a minute
HANGS = "Look for a loop or a wait; then end the process, which holds the import: its creator starts it again."
_turns: WeakKeyDictionary[asyncio.AbstractEventLoop, asyncio.Lock] = WeakKeyDictionary()
"""Event loop of a process → lock for the reading of files."""


class WrongClass(Refusal):
    """The class path leads to no class that can replace the old one."""

    code = "exchange.class"
    remedy = "Correct the fault that the message names, and swap again."


class ValuesChanged(Refusal):
    """The file declares a class of values differently from the running mission."""

    code = "exchange.values"
    remedy = "Give the changed class another name, or bring the mission down and up."


class ReadAnew(Generic[T]):
    """A class whose file was read just now.

    Args:
        class_path: ``package.module:Class``.
        load: Returns the class at a path, or refuses it; imports its file.
        wrong: Exception class for a file that cannot be read.

    Attributes:
        kind: The class.

    Raises:
        WrongClass: The file cannot be read.
        ValuesChanged: The file declares classes of values differently.
    """

    def __init__(self, class_path: str, load: Callable[[str], T], wrong: type[WrongClass] = WrongClass) -> None:
        self._file = class_path.partition(":")[0]
        self._before = sys.modules.get(self._file)
        try:
            if self._before is not None:
                _read(self._file, self._before, wrong)
            self.kind: T = load(class_path)
        except UNPROVED as error:
            self.undo()
            if isinstance(error, Refusal):
                raise
            raise wrong(f"{class_path}: {complaint(error)}", class_path=class_path) from error

    def undo(self) -> None:
        """Let imports find again what they found before."""
        _put_back(self._file, self._before)


async def read_anew(class_path: str, load: Callable[[str], T], wrong: type[WrongClass] = WrongClass) -> ReadAnew[T]:
    """Return the class, read in a thread of its own; see ``ReadAnew``.

    Raises:
        WrongClass: The file cannot be read, or its reading does not end within ``READ_WITHIN_S``.
        ValuesChanged: It declares classes of values otherwise.
    """
    file = class_path.partition(":")[0]
    async with _turns.setdefault(asyncio.get_running_loop(), asyncio.Lock()):
        before = sys.modules.get(file)
        try:
            return await in_thread_within(partial(ReadAnew, class_path, load, wrong), READ_WITHIN_S)
        except TimeoutError:
            _put_back(file, before)
            told = f"{class_path}: the import of its file has not ended within {READ_WITHIN_S:g} s"
            raise wrong(told, remedy=HANGS, class_path=class_path) from None


def _read(file: str, before: ModuleType, wrong: type[WrongClass]) -> None:
    """Import the present file in place of the module that was imported before."""
    parent = sys.modules.get(file.rpartition(".")[0])
    importlib.invalidate_caches()
    spec = importlib.machinery.PathFinder.find_spec(file, getattr(parent, "__path__", None))
    if spec is None or not isinstance(loader := spec.loader, importlib.machinery.SourceFileLoader):
        raise wrong(f"{file} has no file that can be read anew", remedy="Name a class in a Python file.")
    fresh = importlib.util.module_from_spec(spec)
    code = loader.source_to_code(loader.get_data(loader.path), loader.path)
    _place(file, fresh)
    exec(code, fresh.__dict__)  # noqa: S102  as an import does
    _keep_values(before, fresh)


def _put_back(file: str, before: ModuleType | None) -> None:
    if before is not None:
        _place(file, before)
    else:
        sys.modules.pop(file, None)


def _place(file: str, module: ModuleType) -> None:
    sys.modules[file] = module
    package, _, name = file.rpartition(".")
    if package in sys.modules:
        setattr(sys.modules[package], name, module)


def _keep_values(before: ModuleType, fresh: ModuleType) -> None:
    """Let the fresh module use the running classes of values.

    Raises:
        ValuesChanged: The fresh module declares them differently.
    """
    changed = []
    for name, new in vars(fresh).copy().items():
        old = getattr(before, name, None)
        if not (_is_of_values(new, fresh) and _is_of_values(old, before)) or old is new:
            continue
        if _declared(old) != _declared(new):
            changed.append(name)
        setattr(fresh, name, old)
    if changed:
        raise ValuesChanged(
            f"{fresh.__name__} declares {', '.join(changed)} differently from the running mission, where others use it"
        )


def _is_of_values(kind: object, module: ModuleType) -> bool:
    return isinstance(kind, type) and issubclass(kind, msgspec.Struct | Enum) and kind.__module__ == module.__name__


def _declared(kind: object) -> object:
    """Return the part of a declaration that must not change."""
    if isinstance(kind, type) and issubclass(kind, msgspec.Struct):
        config = kind.__struct_config__
        fields = [
            (one.name, one.encode_name, repr(one.type), repr(one.default), repr(one.default_factory))
            for one in msgspec.structs.fields(kind)
        ]
        return fields, config.tag, config.tag_field, config.array_like, config.frozen, config.forbid_unknown_fields
    assert isinstance(kind, type) and issubclass(kind, Enum)  # noqa: S101, PT018  see _is_of_values
    return [(name, repr(one.value)) for name, one in kind.__members__.items()]
