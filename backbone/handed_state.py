"""Copy of a state that is handed over to a new version of its classes.

An exchange reads a file anew, so its classes exist twice. A mere copy of an object keeps the old class with the old
code. Here it gets the present class of the same name, if both classes declare the same fields.

The copy is made as by ``pickle``, because that lets each class be replaced.
"""

from __future__ import annotations

import dataclasses
import io
import pickle
import sys
import weakref
from collections.abc import Iterator, Mapping
from enum import Enum
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import cast

import msgspec

from backbone.errors import Refusal

SHARED = (type, FunctionType, BuiltinFunctionType, ModuleType, weakref.ref)
"""Classes of objects that are not copied, as in ``copy.deepcopy``."""
Files = Mapping[str, Mapping[str, object]]
"""Name of a file's module → its names and their values."""


class NotConverted(Refusal):
    """A state has an object whose class was changed in a file that was read anew."""

    code = "exchange.state"
    remedy = "Let the class be a dataclass with the same fields as before, or expect a fresh state."


def copy_for(kind: type, values: dict[str, object]) -> dict[str, object]:
    """Return a copy of the values in which each object has the class that this class's code knows by its name.

    Objects that are shared among the values are shared among the copies, too.

    Raises:
        NotConverted: A class is gone from its file, declares other fields than before, or declares none.
        TypeError: A value cannot be copied.
    """
    file, shared = io.BytesIO(), list[object]()
    _StateWriter(file, shared).dump(values)
    file.seek(0)
    return cast(dict[str, object], _StateReader(file, shared, _files(kind)).load())


class _StateWriter(pickle.Pickler):
    """Writes everything but the shared objects, which get a number."""

    def __init__(self, file: io.BytesIO, shared: list[object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._shared = shared

    def persistent_id(self, one: object) -> int | None:
        if not isinstance(one, SHARED):
            return None
        self._shared.append(one)
        return len(self._shared) - 1


class _StateReader(pickle.Unpickler):
    """Reads what ``_StateWriter`` wrote, with the classes of these files."""

    def __init__(self, file: io.BytesIO, shared: list[object], files: Files) -> None:
        super().__init__(file)
        self._shared, self._files = shared, files

    def persistent_load(self, number: int) -> object:
        one = self._shared[number]
        return _present(one, self._files) if isinstance(one, type | FunctionType) else one


def _files(kind: type) -> Files:
    """Return the files that the class and its base classes were read from.

    ``sys.modules`` is not enough, because the end of another exchange may put an older version of a file there.
    """
    known = {name: getattr(module, "__dict__", {}) for name, module in sys.modules.copy().items()}
    own = {each.__module__: each.__globals__ for base in reversed(kind.__mro__) for each in _own_functions(base)}
    return known | own


def _present(one: type | FunctionType, files: Files) -> object:
    """Return the class or function that has this name in its file.

    Raises:
        NotConverted: See ``copy_for``.
    """
    first, *inner = one.__qualname__.split(".")
    found: object = files.get(one.__module__, {}).get(first)
    for name in inner:
        found = getattr(found, name, None)
    if found is one or (found is None and not _is_of_old_file(one, files)):
        return one
    if found is None:
        raise NotConverted(f"{one.__qualname__} is no longer in its file")
    if isinstance(one, type) and isinstance(found, type):
        fields = _fields(one)
        if fields is None:
            raise NotConverted(f"{one.__qualname__} was read anew and declares no fields")
        if fields != _fields(found):
            raise NotConverted(f"{one.__qualname__} declares other fields than before")
    return found


def _is_of_old_file(one: type | FunctionType, files: Files) -> bool:
    """Return whether this function, or the functions of this class, belong to another version of their file."""
    functions = [one] if isinstance(one, FunctionType) else _own_functions(one)
    return any(each.__globals__ is not files.get(one.__module__) for each in functions)


def _own_functions(kind: type) -> Iterator[FunctionType]:
    """Return the functions that the class declares in its own file."""
    return (one for one in vars(kind).values() if isinstance(one, FunctionType) and one.__module__ == kind.__module__)


def _fields(kind: type) -> list[tuple[str, str]] | None:
    """Return name and type of each declared field; None: the class declares none."""
    if dataclasses.is_dataclass(kind):
        return [(one.name, str(one.type)) for one in dataclasses.fields(kind)]
    if issubclass(kind, msgspec.Struct):
        return [(one.name, str(one.type)) for one in msgspec.structs.fields(kind)]
    if issubclass(kind, tuple) and hasattr(kind, "_fields"):
        return [(name, str(kind.__annotations__.get(name))) for name in kind._fields]
    if issubclass(kind, Enum):
        return [(name, repr(one.value)) for name, one in kind.__members__.items()]
    return None
