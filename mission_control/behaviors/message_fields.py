"""The fields of a message class, and the values that a condition can find in them. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from msgspec import inspect

from backbone.naming import did_you_mean
from backbone.wire import Message

_NOT_COMPARED = (
    inspect.NoneType,
    inspect.StructType,
    inspect.DataclassType,
    inspect.DictType,
    inspect.ListType,
    inspect.VarTupleType,
    inspect.TupleType,
    inspect.BytesType,
)
"""Values of these types equal no value of a mission file; of types that are not named in this file nothing is known."""


def values_at(kind: type[Message], path: str) -> Sequence[inspect.Type]:
    """Return the types of the values that a message of this class may have at a path, names separated by dots.

    Raises:
        ValueError: No message of this class has such a field.

    Example:
        >>> from mission_control.messages import WaypointReached
        >>> values_at(WaypointReached, "at_s")[0].ge
        -86400.0
    """
    types, before = [*_alternatives(inspect.type_info(kind))], ""
    for name in path.split("."):
        known = [each for one in types for each in _names(one)]
        types = [found for one in types for found in _inside(one, name)]
        if not types:
            where = f"{before} of {kind.__name__}" if before else kind.__name__
            there = f"has no {name!r}{did_you_mean(name, known)}, but {', '.join(known)}" if known else "has no parts"
            raise ValueError(f"field is {path!r}: {where} {there}")
        before = f"{before}.{name}" if before else name
    return types


def never_equal(types: Sequence[inspect.Type], value: object) -> bool:
    """Return whether no value of these types equals the value."""
    return not any(_may_equal(one, value) for one in types)


def never_within(types: Sequence[inspect.Type], above: float | None, below: float | None) -> bool:
    """Return whether no value of these types is a number between the limits, which are excluded; None: no limit."""
    return not any(_may_be_within(one, above, below) for one in types)


def words_of(types: Iterable[inspect.Type]) -> list[str]:
    """Return the words that values of these types may be, if there are only some; empty: there are others."""
    return [word for one in types for word in _words(one)]


def _alternatives(one: inspect.Type) -> Iterable[inspect.Type]:
    match one:
        case inspect.Metadata(type=inner):
            yield from _alternatives(inner)
        case inspect.UnionType(types=types):
            for each in types:
                yield from _alternatives(each)
        case _:
            yield one


def _inside(one: inspect.Type, name: str) -> Iterable[inspect.Type]:
    match one:
        case inspect.StructType(fields=fields) | inspect.DataclassType(fields=fields):
            return [each for field in fields if field.name == name for each in _alternatives(field.type)]
        case inspect.DictType(value_type=value):
            return _alternatives(value)
        case inspect.AnyType():
            return [one]
    return []


def _names(one: inspect.Type) -> list[str]:
    match one:
        case inspect.StructType(fields=fields) | inspect.DataclassType(fields=fields):
            return [field.name for field in fields]
    return []


def _may_equal(one: inspect.Type, value: object) -> bool:
    match one:
        case inspect.BoolType():
            return isinstance(value, bool)
        case inspect.IntType() | inspect.FloatType():
            return isinstance(value, int | float) and not isinstance(value, bool)
        case inspect.StrType():
            return isinstance(value, str)
        case inspect.EnumType() | inspect.LiteralType():
            return value in _words(one)
    return not isinstance(one, _NOT_COMPARED)


def _may_be_within(one: inspect.Type, above: float | None, below: float | None) -> bool:
    match one:
        case inspect.IntType(le=most, ge=least) | inspect.FloatType(le=most, ge=least):
            too_high = above is not None and most is not None and above >= most
            return not too_high and not (below is not None and least is not None and below <= least)
        case inspect.BoolType() | inspect.StrType() | inspect.EnumType() | inspect.LiteralType():
            return False
    return not isinstance(one, _NOT_COMPARED)


def _words(one: inspect.Type) -> list[str]:
    match one:
        case inspect.EnumType(cls=kind):
            return [str(member.value) for member in kind]
        case inspect.LiteralType(values=values):
            return [str(value) for value in values]
    return []
