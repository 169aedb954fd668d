"""The work of ``scout-backbone compare``: two recordings side by side."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from pathlib import Path

from backbone.command_line.recording_work import opened
from backbone.launcher.endings import ExitCode, say, show
from backbone.recording.comparison import Difference, KeyComparison, Named, compared
from backbone.spoken import counted

LONGEST_VALUE = 60  # chosen: two of them fit a line of a wide terminal


async def compare(
    first: Path, second: Path, keys: tuple[str, ...], tolerances: dict[str, float], *, as_json: bool
) -> ExitCode:
    """Print where two recordings differ by more than the tolerances; ``REFUSED`` if they do."""
    with opened(first) as one, opened(second) as other:
        return print_comparison(compared(one.messages(keys), other.messages(keys), tolerances), as_json=as_json)


def print_comparison(found: Mapping[Named, KeyComparison], *, as_json: bool) -> ExitCode:
    """Print what differs; ``REFUSED`` if anything differs by more than was tolerated."""
    for named, comparison in found.items():
        show([json.dumps(_json(named, comparison))] if as_json else _lines(named, comparison))
    differing = sum(not comparison.is_same for comparison in found.values())
    if not found:
        say("there is no message to compare")
    else:
        say(f"{differing} of {counted(len(found), 'key')} differ")
    return ExitCode.REFUSED if differing else ExitCode.DONE


def _lines(named: Named, found: KeyComparison) -> Iterator[str]:
    key, source, schema = named
    if found.is_same and not found.errors:
        return
    sender = "" if key.startswith(f"{source}/") else f"  from {source}"
    numbers = f"{found.first}" if found.first == found.second else f"{found.first} and {found.second}"
    yield f"{key}  {schema}{sender}: {numbers} messages, {found.differing} differ"
    at = found.difference
    if at is not None:
        where = at.field or "the whole message"
        yield f"  first: message {at.number} at {at.first_s:.3f} and {at.second_s:.3f} s, {where}"
        yield f"    {_short(at.first)}  |  {_short(at.second)}"
    for path, error in found.errors.items():
        yield f"  {path}: RMS {error.rms:.6g}, largest {error.largest:.6g}, of {counted(error.count, 'unequal pair')}"


def _short(value: object) -> str:
    text = repr(value) if isinstance(value, bytes) else json.dumps(value)
    return text if len(text) <= LONGEST_VALUE else f"{text[: LONGEST_VALUE - 1]}…"


def _json(named: Named, found: KeyComparison) -> dict[str, object]:
    key, source, schema = named
    errors = {path: {"rms": one.rms, "largest": one.largest, "count": one.count} for path, one in found.errors.items()}
    return {
        "key": key,
        "source": source,
        "schema": schema,
        "first": found.first,
        "second": found.second,
        "differing": found.differing,
        "is_same": found.is_same,
        "difference": _plain(found.difference),
        "errors": errors,
    }


def _plain(difference: Difference | None) -> dict[str, object] | None:
    if difference is None:
        return None
    values = {name: getattr(difference, name) for name in ("first", "second")}
    shown = {name: value.hex() if isinstance(value, bytes) else value for name, value in values.items()}
    at = {"number": difference.number, "first_s": difference.first_s, "second_s": difference.second_s}
    return {**at, "field": difference.field, **shown}
