r"""Text from the bus as text for people: it cannot control a terminal, a browser or a log.

Rules of this file: pure. Characters that ``str.isprintable`` refuses become visible escapes: control characters (ESC,
CR, the 8-bit CSI), format characters (bidirectional overrides), lone surrogates, line separators. A text that is too
long is cut and ends with the number of missing characters.

``printable_all`` is applied where messages enter the parts for people: the mission picture, ``why`` and ``story``, and
the feed of the consoles. Code behind these trusts its texts.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeVar, cast

import msgspec

MOST_CHARACTERS = 2000  # chosen: several times a component's longest feedback
MOST_LINES = 200  # chosen: more lines than a refusal quotes from a log

Value = TypeVar("Value")


def printable(text: str, most: int = MOST_CHARACTERS) -> str:
    r"""Return the text as one printable line of bounded length.

    Example:
        >>> printable("\x1b[2Jall is well\r")
        '\\x1b[2Jall is well\\r'
        >>> printable("aaaa", most=3)
        'aaa… (1 more)'
    """
    if len(text) <= most and text.isprintable():
        return text
    shown = "".join(each if each.isprintable() else _escape(each) for each in text[:most])
    return shown if len(text) <= most else f"{shown}… ({len(text) - most} more)"


def printable_lines(text: str, most: int = MOST_CHARACTERS) -> str:
    r"""Return the text with its lines kept, each of them printable.

    Example:
        >>> printable_lines("one\ntwo\tthree")
        'one\ntwo    three'
    """
    if text.isprintable() and len(text) <= most:
        return text
    lines = text.split("\n")
    shown = [printable(line.replace("\t", "    "), most) for line in lines[:MOST_LINES]]
    return "\n".join([*shown, f"… ({len(lines) - MOST_LINES} lines more)"] if len(lines) > MOST_LINES else shown)


def printable_all(value: Value) -> Value:
    """Return the message, dataclass, list or dictionary with every text in it one printable line; itself if all are."""
    return with_texts(value, printable)


def with_texts(value: Value, change: Callable[[str], str]) -> Value:
    """Return the message, dataclass, list or dictionary with every text in it changed; itself if none is."""
    return cast(Value, _with_texts(value, change))


def _with_texts(value: object, change: Callable[[str], str]) -> Any:
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


def _escape(character: str) -> str:
    return character.encode("unicode_escape", "backslashreplace").decode("ascii")
