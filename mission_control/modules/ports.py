"""Ports: the inputs and outputs that a module declares, as plain data.

A port is a field of the module's ``Inputs`` or ``Outputs``. Its class and key determine its connections:

* without a default an input is required: the module waits for a value;
* with a default it is optional: without a value the module gets the default;
* an input is *fresh*: the module gets each value once, and its producer runs first. An input marked ``LATEST`` is a
*latest value*: at each run the module gets the newest value. If it also has a default, its producer need not run
first, so it breaks a cycle;
* an output with the default ``None`` may be left out of a round.

Source: B-Human's REQUIRES, USES and PROVIDES; keys and types: RoboFrame 2006, section III.
"""

from __future__ import annotations

import types
import typing
from enum import Enum
from functools import lru_cache
from typing import Annotated, Final

import msgspec

from backbone.errors import Refusal
from backbone.naming import is_legal
from backbone.type_aliases import unaliased


class WrongDeclaration(Refusal):
    """The inputs or outputs of a module cannot be read from its class."""

    code = "module.declaration"
    remedy = "Declare each port as 'name: Class', or 'name: Class | None = None', with a class of a module's top."


class Ports(msgspec.Struct):
    """Base of the ``Inputs`` and ``Outputs`` of a module; each field is a port."""


class InputMark(Enum):
    """Marks of inputs that are not fresh."""

    LATEST = "latest"


LATEST: Final = InputMark.LATEST
"""``Annotated[Class, LATEST]``: the input is the latest value."""


class Key(msgspec.Struct, frozen=True):
    """``Annotated[Class, Key("name")]``: the key of the port, if it is not the port's name."""

    key: str


class Port(msgspec.Struct, frozen=True):
    """An input or output of a module.

    Attributes:
        name: Name of its field.
        key: Key of its connections; an output's key is unique in the graph.
        type: Class of its values, ``package.module:Class``; equal on both sides of a connection.
        is_required: Of an input: the module waits for a value. Of an output: each round has one.
        is_latest: Of an input: it is a latest value, not fresh.
    """

    name: str
    key: str
    type: str
    is_required: bool = True
    is_latest: bool = False

    @property
    def comes_first(self) -> bool:
        """Of an input: its producer must have run before; False breaks a cycle."""
        return self.is_required or not self.is_latest


class ModulePorts(msgspec.Struct, frozen=True):
    """All ports of a module."""

    inputs: tuple[Port, ...] = ()
    outputs: tuple[Port, ...] = ()


@lru_cache(maxsize=1024)
def ports_of(declared: type[Ports]) -> tuple[Port, ...]:
    """Return the ports that a struct declares, in the order of its fields.

    Raises:
        WrongDeclaration: It is no ``Ports``, a field's annotation is not a class, or its key is not a legal name.
    """
    given: object = declared  # a class that is being written has anything in this place
    if not (isinstance(given, type) and issubclass(given, Ports)):
        raise WrongDeclaration(
            f"{type_name(declared)} declares no ports",
            remedy="Derive it: 'class Inputs(Module.Inputs)', or 'class Outputs(Module.Outputs)'.",
        )
    hints = _hints(declared)
    return tuple(_port(declared, field, hints[field.name]) for field in msgspec.structs.fields(declared))


@lru_cache(maxsize=1024)
def kinds_of_ports(declared: type[Ports]) -> dict[str, object]:
    """Return field → the class of its values."""
    return {name: _kind(hint)[0] for name, hint in _hints(declared).items()}


def type_name(kind: object) -> str:
    """Return the name of a type, for the comparison of two ports.

    Example:
        >>> type_name(Port), type_name(list[int])
        ('mission_control.modules.ports:Port', 'list[int]')
    """
    if isinstance(kind, type):
        return f"{kind.__module__}:{kind.__qualname__}"
    return str(kind)


def _hints(declared: type[Ports]) -> dict[str, object]:
    try:
        return typing.get_type_hints(declared, include_extras=True)
    except Exception as error:  # an annotation is code, so it may raise any exception
        raise WrongDeclaration(f"{type_name(declared)}: {type(error).__name__}: {error}") from error


def _port(declared: type[Ports], field: msgspec.structs.FieldInfo, hint: object) -> Port:
    kind, marks = _kind(hint)
    if typing.get_origin(kind) in (typing.Union, types.UnionType):
        raise WrongDeclaration(f"{type_name(declared)}.{field.name}: {kind} is a choice of several classes")
    key = next((mark.key for mark in marks if isinstance(mark, Key)), field.name)
    if not is_legal(key):
        raise WrongDeclaration(f"{type_name(declared)}.{field.name}: the key {key!r} is no legal name")
    return Port(field.name, key, type_name(kind), field.required, LATEST in marks)


def _kind(hint: object) -> tuple[object, tuple[object, ...]]:
    """Return the class of a port's values and the marks beside it."""
    hint = unaliased(hint)
    if typing.get_origin(hint) is Annotated:
        kind, inside = _kind(typing.get_args(hint)[0])
        return kind, (*typing.get_args(hint)[1:], *inside)
    if typing.get_origin(hint) in (typing.Union, types.UnionType):
        given = [one for one in typing.get_args(hint) if one is not types.NoneType]
        if len(given) == 1:
            return _kind(given[0])
    return hint, ()
