"""Whether what a server sends has the types that its page's JavaScript is checked by."""

from __future__ import annotations

import itertools
from typing import Any

import msgspec
from msgspec import inspect


def fits(answer: dict[str, Any], kinds: tuple[type[msgspec.Struct], ...]) -> list[type[msgspec.Struct]]:
    """Return which of these structs the answer is."""
    fitting = []
    for kind in kinds:
        try:
            msgspec.convert(answer, kind)
        except msgspec.ValidationError:
            continue
        fitting.append(kind)
    return fitting


def odd(value: Any, kind: inspect.Type, where: str = "view") -> list[str]:
    """Return where a value is not of this type; messages of the bus come as dictionaries of their fields."""
    match kind:
        case inspect.StructType(fields=fields) if isinstance(value, dict):
            wrong = value.keys() ^ {field.encode_name for field in fields}
            there = [field for field in fields if field.encode_name in value]
            inside = [odd(value[field.encode_name], field.type, f"{where}.{field.name}") for field in there]
            return [*(f"{where}.{name}" for name in wrong), *itertools.chain(*inside)]
        case inspect.ListType(item_type=item) | inspect.VarTupleType(item_type=item) if isinstance(value, list):
            return [wrong for one in value for wrong in odd(one, item, f"{where}[]")]
        case inspect.DictType(value_type=of) if isinstance(value, dict):
            return [wrong for name, one in value.items() for wrong in odd(one, of, f"{where}.{name}")]
        case inspect.UnionType(types=kinds):
            return [] if any(not odd(value, one) for one in kinds) else [where]
        case inspect.StructType() | inspect.ListType() | inspect.VarTupleType() | inspect.DictType():
            return [where]
        case _:
            return [] if fits_plain(value, kind) else [where]


def fits_plain(value: Any, kind: inspect.Type) -> bool:
    """Return whether a plain value is of this type."""
    match kind:
        case inspect.StrType():
            return isinstance(value, str)
        case inspect.BoolType():
            return isinstance(value, bool)
        case inspect.IntType():
            return isinstance(value, int)
        case inspect.FloatType():
            return isinstance(value, int | float)
        case inspect.NoneType():
            return value is None
        case inspect.EnumType(cls=cls):
            return value in [one.value for one in cls]
    return False
