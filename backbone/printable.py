"""Messages from the bus with texts that are printable; see ``printable_text``.

Rules of this file: pure. ``printable_all`` is applied where messages enter the parts for people: the mission picture,
``why`` and ``story``, and the feed of the consoles. The code of these parts trusts its texts.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar, cast

import msgspec

from backbone.printable_text import printable

Value = TypeVar("Value")

WITHOUT_TEXT = (type(None), bool, int, float, bytes, memoryview)  # most values have these types


def printable_all(value: Value) -> Value:
    """Return the message, dataclass, list or dictionary with each text as one printable line; itself if all are so."""
    return with_texts(value, printable)


def with_texts(value: Value, change: Callable[[str], str]) -> Value:
    """Return the message, dataclass, list or dictionary with every text in it changed; itself if no text changes."""
    return cast(Value, _with_texts(value, change))


def _with_texts(value: object, change: Callable[[str], str]) -> Any:
    if type(value) in WITHOUT_TEXT:
        return value
    match value:
        case str():
            return change(value) if type(value) is str else value  # texts of an enumeration come from this project
        case msgspec.Struct():
            changes = _changes(value, value.__struct_fields__, change)
            return msgspec.structs.replace(value, **changes) if changes else value
        case list() | tuple():
            changed = [_with_texts(each, change) for each in value]
            same = all(each is old for each, old in zip(changed, value, strict=True))
            return value if same else tuple(changed) if isinstance(value, tuple) else changed
        case Mapping():
            pairs = [(_with_texts(key, change), _with_texts(each, change)) for key, each in value.items()]
            same = all(key is old and each is value[old] for (key, each), old in zip(pairs, value, strict=True))
            return value if same else dict(pairs)
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        changes = _changes(value, (field.name for field in dataclasses.fields(value)), change)
        return dataclasses.replace(value, **changes) if changes else value
    return value


def _changes(value: object, names: Iterable[str], change: Callable[[str], str]) -> dict[str, object]:
    found: dict[str, object] = {}
    for name in names:
        before = getattr(value, name)
        if (after := _with_texts(before, change)) is not before:
            found[name] = after
    return found
