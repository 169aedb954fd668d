"""Reading a trace: which lines and fields the format has."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

Line = dict[str, Any]


class Malformed(ValueError):
    """A line that the format does not have."""


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _duration(value: Any) -> bool:
    return _number(value) and value >= 0


def _text(value: Any) -> bool:
    return isinstance(value, str)


def _one_of(*words: Any) -> Callable[[Any], bool]:
    return lambda value: value in words


def _parent(value: Any) -> bool:
    return value is None or _text(value)


def _owner(value: Any) -> bool:
    return _text(value) or (isinstance(value, dict) and _number(value.get("ui")) and _text(value.get("id")))


def _stream(value: Any) -> bool:
    return (
        isinstance(value, dict)
        and all(_number(value.get(field)) and value[field] > 0 for field in ("period", "cost"))
        and all(_duration(value.get(field, 0)) for field in ("deadline", "jitter"))
    )


def _use(value: Any) -> bool:
    return isinstance(value, dict) and all(
        use == "x" or (isinstance(use, list) and bool(use) and all(map(_stream, use))) for use in value.values()
    )


def _epochs(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(epoch, int) for epoch in value.values())


_ARC = {"arc": _text}
FIELDS: dict[str, dict[str, Callable[[Any], bool]]] = {
    "meta": {
        "v": _one_of(1),
        "mode": _one_of("no_delay", "strict"),
        "discipline": _one_of("turns", "time"),
        "wc": _one_of("plan", "relaxed"),
        "grace": _duration,
        "tol": _duration,
    },
    "rc": {
        "id": _text,
        "kind": _one_of("unit", "share"),
        "cap": _duration,
        "connect": _duration,
        "disconnect": _duration,
    },
    "rc_state": {"id": _text, "state": _one_of("up", "down")},
    "rc_cap": {"id": _text, "cap": _duration},
    "node": {"id": _text, "parent": _parent, "prio": _number},
    "request": {**_ARC, "owner": _owner, "min_run": _duration, "max_run": _duration, "use": _use},
    "want": _ARC,
    "idle": _ARC,
    "depart": _ARC,
    "min_run": {**_ARC, "min_run": _duration},
    "extend": {**_ARC, "until": _number},
    "connect": _ARC,
    "grant": {**_ARC, "epoch": _epochs},
    "revoke": {**_ARC, "why": _text},
    "free": _ARC,
    "slice": _ARC,
    "end": {},
}
"""Event → its fields, and what a value of each must look like."""


def require_sound(line: Line) -> None:
    """Raise Malformed unless the line has a known event, a time, and all its fields.

    Raises:
        Malformed: It has not; says which field of which event.
    """
    event = line.get("ev")
    if event not in FIELDS:
        raise Malformed(f"unknown event {event!r}")
    if not _number(line.get("t")):
        raise Malformed(f"{event} without a time")
    for field, fits in FIELDS[event].items():
        if field not in line:
            raise Malformed(f"{event} without {field}")
        if not fits(line[field]):
            raise Malformed(f"{event}: {field} is {line[field]!r}")


def read_lines(path: Path) -> Iterator[Line]:
    """Read a trace file.

    Raises:
        Malformed: A line is no JSON object; says which.
    """
    with path.open(encoding="utf-8") as file:
        for number, text in enumerate(file, 1):
            if not text.strip():
                continue
            try:
                line = json.loads(text)
            except ValueError as error:
                raise Malformed(f"line {number} is no JSON: {error}") from error
            if not isinstance(line, dict):
                raise Malformed(f"line {number} is no object")
            yield line
