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
from collections.abc import Iterator
from enum import Enum
from types import BuiltinFunctionType, FunctionType, ModuleType
from typing import cast

import msgspec

from backbone.errors import Refusal

SHARED = (type, FunctionType, BuiltinFunctionType, ModuleType, weakref.ref)
"""Classes of objects that are not copied, as in ``copy.deepcopy``."""


class NotConverted(Refusal):
    """A state has an object whose class was changed in a file that was read anew."""

    code = "exchange.state"
    remedy = "Let the class be a dataclass with the same fields as before, or expect a fresh state."


def copy_for_present_classes(values: dict[str, object]) -> dict[str, object]:
    """Return a copy of the values in which each object has the present class of its file.

    Objects that are shared among the values are shared among the copies, too.

    Raises:
        NotConverted: A class is gone from its file, declares other fields than before, or declares none.
        TypeError: A value cannot be copied.
    """
    file, shared = io.BytesIO(), list[object]()
    _Writer(file, shared).dump(values)
    file.seek(0)
    return cast(dict[str, object], _Reader(file, shared).load())


class _Writer(pickle.Pickler):
    """Writes everything but the shared objects, which get a number."""

    def __init__(self, file: io.BytesIO, shared: list[object]) -> None:
        super().__init__(file, pickle.HIGHEST_PROTOCOL)
        self._shared = shared

    def persistent_id(self, one: object) -> int | None:
        if not isinstance(one, SHARED):
            return None
        self._shared.append(one)
        return len(self._shared) - 1


class _Reader(pickle.Unpickler):
    """Reads what ``_Writer`` wrote, with present classes."""

    def __init__(self, file: io.BytesIO, shared: list[object]) -> None:
        super().__init__(file)
        self._shared = shared

    def persistent_load(self, number: int) -> object:
        one = self._shared[number]
        return _present(one) if isinstance(one, type | FunctionType) else one


def _present(one: type | FunctionType) -> object:
    """Return the class or function of this name that its file declares now.

    Raises:
        NotConverted: See ``copy_for_present_classes``.
    """
    found: object = sys.modules.get(one.__module__)
    for name in one.__qualname__.split("."):
        found = getattr(found, name, None)
    if found is one or (found is None and not _is_of_old_file(one)):
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


def _is_of_old_file(one: type | FunctionType) -> bool:
    """Return whether the functions of this class, or this function, belong to a file that was read anew since."""
    functions = [one] if isinstance(one, FunctionType) else _functions(one)
    now = getattr(sys.modules.get(one.__module__), "__dict__", None)
    return any(each.__module__ == one.__module__ and each.__globals__ is not now for each in functions)


def _functions(kind: type) -> Iterator[FunctionType]:
    return (each for each in vars(kind).values() if isinstance(each, FunctionType))


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
