"""The catalogue of all messages, and for each the values at and beyond the limits of every field, from types alone.

Nothing here names a message: a new one is found by itself, and one whose fields have no ranges fails the tests
that use this. Values are plain data as MessagePack carries them; a message is a list that begins with its schema.
"""

from __future__ import annotations

import functools
import importlib
import math
import pkgutil
from collections.abc import Iterator
from typing import Any, NamedTuple

import msgspec
from msgspec import inspect

from backbone.ranges import DEEPEST, LONGEST_DOCUMENT, MOST_ENTRIES
from backbone.shipped import PACKAGES
from backbone.wire import Message, schema_of

A_MEGABYTE = 1_000_000
TIED = {
    **{(kind, side): 1 for kind in ("Frame", "GreyPicture") for side in ("width_px", "height_px")},
    **{(kind, "pixels"): b"\0" for kind in ("Frame", "GreyPicture")},
    ("ViewPicture", "pixels"): b"",
}  # (message, field) → its plain value: as many pixels as rows and columns have, so none alone is at its limit


class Sample(NamedTuple):
    """One value of a field.

    Attributes:
        name: Which field, and how it is chosen.
        body: The whole message with this value.
    """

    name: str
    body: list[Any]


def catalogue() -> list[type[Message]]:
    """Return all message classes of the product, by schema, after importing all its modules."""
    for package in map(importlib.import_module, PACKAGES):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if not module.name.endswith("__main__"):
                importlib.import_module(module.name)
    return sorted(filter(_is_of_the_product, _all_below(Message)), key=schema_of)


def honest_body(kind: type[Any]) -> list[Any]:
    """Return the message with a plain value in each field."""
    tied = ((TIED.get((kind.__name__, field.name)), field.type) for field in _fields(kind))
    return [schema_of(kind), *(_honest(given) if plain is None else plain for plain, given in tied)]


def limit_bodies(kind: type[Any]) -> Iterator[Sample]:
    """Yield the message with one field at one of its limits, the others plain."""
    return _with_each_field(kind, _limits)


def hostile_bodies(kind: type[Any]) -> Iterator[Sample]:
    """Yield the message with one field beyond a limit, infinite, NaN, 1 MB long, or of another type."""
    yield from _with_each_field(kind, _beyond)
    yield Sample("one field more", [*honest_body(kind), None])
    required = sum(field.required for field in _fields(kind))
    if required:
        yield Sample("a field missing", honest_body(kind)[:required])


def _with_each_field(kind: type[Any], choose: Any) -> Iterator[Sample]:
    body = honest_body(kind)
    for place, field in enumerate(_fields(kind), start=1):
        for name, value in choose(field.type):
            if choose is _beyond or (kind.__name__, field.name) not in TIED:
                yield Sample(f"{field.name}: {name}", [*body[:place], value, *body[place + 1 :]])


def _all_below(kind: type[Any]) -> Iterator[type[Any]]:
    for derived in kind.__subclasses__():
        yield derived
        yield from _all_below(derived)


def _is_of_the_product(kind: type[Any]) -> bool:
    return kind.__module__.partition(".")[0] in PACKAGES


@functools.cache
def _fields(kind: type[Any]) -> tuple[inspect.Field, ...]:
    described = inspect.type_info(kind)
    assert isinstance(described, inspect.StructType)
    return described.fields


def _honest(kind: inspect.Type) -> Any:
    match kind:
        case inspect.StrType():
            return "plain/name" if "/" in (kind.pattern or "") else "plain"
        case inspect.BytesType() | inspect.MemoryViewType():
            return b""
        case inspect.BoolType():
            return True
        case inspect.NoneType() | inspect.AnyType():
            return None
        case inspect.IntType() | inspect.FloatType():
            return 1 if kind.gt is not None or (kind.ge or 0) > 0 else 0
        case inspect.EnumType():
            return next(iter(kind.cls)).value
        case inspect.LiteralType():
            return kind.values[0]
        case inspect.ListType() | inspect.VarTupleType():
            return []
        case inspect.DictType():
            return {}
        case inspect.TupleType():
            return [_honest(one) for one in kind.item_types]
        case inspect.UnionType():
            return _honest(kind.types[0])
        case inspect.StructType() if kind.array_like:
            return honest_body(kind.cls)
        case inspect.StructType():
            return {field.encode_name: _honest(field.type) for field in kind.fields if field.required}
        case _:
            raise NotImplementedError(f"no plain value of {kind}")


def _limits(kind: inspect.Type) -> Iterator[tuple[str, Any]]:
    match kind:
        case inspect.StrType():
            if kind.pattern is None:
                yield "empty", ""
            if kind.max_length is not None:
                yield "longest", _honest(kind).ljust(kind.max_length, "a")
        case inspect.BytesType() | inspect.MemoryViewType():
            yield "longest", bytes(kind.max_length or 0)
        case inspect.IntType():
            yield from _named("limit", (one for one in (kind.ge, kind.le) if one is not None))
        case inspect.FloatType():
            above = None if kind.gt is None else math.nextafter(kind.gt, math.inf)
            yield from _named("limit", (one for one in (kind.ge, kind.le, above) if one is not None))
        case inspect.AnyType():
            yield from _named("any", (None, True, -(2**63), 2**63 - 1, -1e18, 1e18, "", "a" * LONGEST_DOCUMENT, [], {}))
        case inspect.EnumType():
            yield from ((str(one.value), one.value) for one in kind.cls)
        case inspect.ListType():
            yield "empty", []
            yield from ((f"item {name}", [value]) for name, value in _limits(kind.item_type))
            yield "longest", [_honest(kind.item_type)] * (kind.max_length or 0)
        case inspect.DictType():
            yield "empty", {}
            yield from ((f"value {name}", {"plain": value}) for name, value in _limits(kind.value_type))
            yield "longest", _entries(kind.max_length or 0, _honest(kind.value_type))
        case inspect.TupleType():
            yield from _each_item(kind, _limits)
        case inspect.UnionType():
            for one in kind.types:
                yield from _limits(one)
        case inspect.StructType() if not kind.array_like:
            yield from _each_key(kind, _limits)


def _beyond(kind: inspect.Type) -> Iterator[tuple[str, Any]]:
    match kind:
        case inspect.StrType():
            if kind.max_length is None or kind.max_length < A_MEGABYTE:  # a document may be longer
                yield "1 MB", "a" * A_MEGABYTE
            yield "a number", 5
            if kind.max_length is not None:
                yield "one too long", "a" * (kind.max_length + 1)
            if kind.pattern is not None:
                yield "escapes", "\x1b[2J"
                yield "a line more", "plain\n"
                yield "a capital", "Plain"
        case inspect.BytesType() | inspect.MemoryViewType():
            if kind.max_length is None or kind.max_length < A_MEGABYTE:  # a picture or a quoted message may be longer
                yield "1 MB", bytes(A_MEGABYTE)
            yield "one too long", bytes((kind.max_length or 0) + 1)
            yield "text", "plain"
        case inspect.BoolType():
            yield from _named("no truth", (1, "true", math.nan, None))
        case inspect.IntType():
            if kind.ge is not None and kind.ge > -(2**63):
                yield "below", kind.ge - 1
            if kind.le is not None:
                yield "above", kind.le + 1
            yield from _named("never", (2**64 - 1, math.nan, math.inf, 1e300, 0.5, "0", [], True))
            yield "nothing", None
        case inspect.FloatType():
            if kind.ge is not None:
                yield "below", math.nextafter(kind.ge, -math.inf)
            if kind.gt is not None:
                yield "not above", kind.gt
            if kind.le is not None:
                yield "above", math.nextafter(kind.le, math.inf)
            yield from _named("never", (math.nan, math.inf, -math.inf, 1e308, -1e308, "0", [], True))
            yield "nothing", None
        case inspect.AnyType():
            yield from _named("wild", (math.nan, math.inf, -math.inf, 2**64 - 1, 1e308))
            yield "wild inside", [{"plain": [math.nan]}]
            yield "a wild key", {math.inf: 1}
            yield "one too long", "a" * (LONGEST_DOCUMENT + 1)
            yield "too many", [None] * (MOST_ENTRIES + 1)
            yield "too deep", _nested(DEEPEST + 2)
            yield "a time stamp", msgspec.msgpack.Ext(-1, b"\0\0\0\0")
        case inspect.EnumType() | inspect.LiteralType():
            yield from _named("no such word", ("", "a" * A_MEGABYTE, 5, math.nan, None))
        case inspect.ListType():
            yield from ((f"item {name}", [value]) for name, value in _beyond(kind.item_type))
            yield "too many", [_honest(kind.item_type)] * ((kind.max_length or MOST_ENTRIES) + 1)
            yield from _named("no list", (5, math.nan, "plain", None))
        case inspect.DictType():
            yield from ((f"value {name}", {"plain": value}) for name, value in _beyond(kind.value_type))
            yield "a key of 1 MB", {"a" * A_MEGABYTE: _honest(kind.value_type)}
            yield "too many", _entries((kind.max_length or MOST_ENTRIES) + 1, _honest(kind.value_type))
            yield from _named("no map", (5, math.nan, "plain", None))
        case inspect.TupleType():
            yield from _each_item(kind, _beyond)
            yield from _named("of another length", (_honest(kind)[1:], [*_honest(kind), 0]))
        case inspect.UnionType():
            for one in kind.types:
                others = [other for other in kind.types if other is not one]
                for name, value in _beyond(one):
                    if not any(_is_of(other, value) for other in others):
                        yield name, value
        case inspect.StructType() if kind.array_like:
            yield from _named("no message", (5, math.nan, "plain", [], ["NeverDefined/1"], None))
        case inspect.StructType():
            yield from _each_key(kind, _beyond)


def _is_of(kind: inspect.Type, value: Any) -> bool:
    """Return whether a value is of this type, so that only its range could refuse it."""
    match kind:
        case inspect.StrType():
            return isinstance(value, str)
        case inspect.BoolType():
            return isinstance(value, bool)
        case inspect.IntType():
            return isinstance(value, int) and not isinstance(value, bool) and abs(value) < 2**63
        case inspect.FloatType():
            return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= 1e18
        case inspect.NoneType():
            return value is None
        case _:
            return False


def _named(what: str, values: Any) -> Iterator[tuple[str, Any]]:
    return ((f"{what} {value[:40] if isinstance(value, str) else value!r:.40}", value) for value in values)


@functools.cache
def _keys(count: int) -> list[str]:
    return [f"a{number}" for number in range(count)]


def _entries(count: int, value: Any) -> dict[str, Any]:
    return dict.fromkeys(_keys(count), value)


def _each_item(kind: inspect.TupleType, choose: Any) -> Iterator[tuple[str, Any]]:
    honest = _honest(kind)
    for place, one in enumerate(kind.item_types):
        for name, value in choose(one):
            yield f"item {place} {name}", [*honest[:place], value, *honest[place + 1 :]]


def _each_key(kind: inspect.StructType, choose: Any) -> Iterator[tuple[str, Any]]:
    for field in kind.fields:
        for name, value in choose(field.type):
            yield f"{field.name} {name}", {**_honest(kind), field.encode_name: value}


def _nested(depth: int) -> list[Any]:
    return [_nested(depth - 1)] if depth else []
