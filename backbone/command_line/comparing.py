"""The work of ``scout-backbone compare``: compares two recordings, or what watchers detected of marks in each."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from backbone.command_line.joining import finite
from backbone.command_line.opened_recording import NothingSelected, opened
from backbone.command_line.unusable_file import FileUnusable, unreadable
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode, say, show
from backbone.recording.comparison import Difference, KeyComparison, Named, compared, pairs_in
from backbone.recording.detection import DetectionRates, Mark, detected, read_marks, require_recorded, sightings, worse
from backbone.spoken import counted

LONGEST_VALUE = 60  # chosen: two of them fit a line of a wide terminal


async def compare(
    first: Path, second: Path, keys: tuple[str, ...], tolerances: dict[str, float], *, as_json: bool
) -> ExitCode:
    """Print where two recordings differ by more than the tolerances; ``REFUSED`` if they do.

    Raises:
        NothingSelected: No message has one of these keys.
    """
    with opened(first) as one, opened(second) as other:
        contents = one.contents(), other.contents()
        missions = [found.about.get("mission", "") for found in contents]
        if all(missions) and missions[0] != missions[1]:
            say(f"two missions: {first} is of {missions[0]}, {second} of {missions[1]}")
        pairs = pairs_in(*(found.counts for found in contents))
        found = compared(one.messages(keys), other.messages(keys), tolerances, pairs)
        if keys and not found:
            raise NothingSelected(f"neither {first} nor {second} has a message whose key matches {' or '.join(keys)}")
        return print_comparison(found, as_json=as_json)


async def compare_detection(paths: Sequence[Path], marks_file: Path, later_s: float, *, as_json: bool) -> ExitCode:
    """Print the detection rates of the marks in each recording; ``REFUSED`` if one is worse than the first.

    Args:
        later_s: See ``worse``.
    """
    marks = _marks(marks_file)
    found = {path: _detection(path, marks) for path in paths}
    complaints = {path: worse(found[paths[0]], one, later_s) for path, one in found.items()}
    for path, one in found.items():
        show([json.dumps(_detection_json(path, one, complaints[path])) if as_json else _detection_line(path, one)])
    for path, worse_in in complaints.items():
        for complaint in worse_in:
            say(f"{path} is worse than {paths[0]}: {complaint}")
    return ExitCode.REFUSED if any(complaints.values()) else ExitCode.DONE


def _marks(path: Path) -> list[Mark]:
    try:
        return read_marks(path.read_text())
    except OSError as error:
        raise unreadable(path, error) from error
    except UnicodeError as error:
        raise FileUnusable(f"{path} cannot be read: {error}") from error


def _detection(path: Path, marks: Sequence[Mark]) -> DetectionRates:
    with opened(path) as recording:
        contents = recording.contents()
        require_recorded(marks, str(path), contents.begin_s, contents.end_s)
        seen = sightings(recording.messages((f"*/{Conversation.EVENTS}",)))
    return detected(marks, seen, contents.end_s - contents.begin_s)


def _detection_line(path: Path, found: DetectionRates) -> str:
    seen = found.seen_after_s
    line = f"{path}: detected {len(seen)} of {counted(len(found.delays_s), 'mark')}, missed {found.missed}"
    if found.median_delay_s is not None:
        line += f", after {found.median_delay_s:.3f} s (median), {found.largest_delay_s:.3f} s (largest)"
    return f"{line}; {found.false_alarms_per_minute:.3g} false alarms a minute"


def _detection_json(path: Path, found: DetectionRates, worse_in: list[str]) -> dict[str, object]:
    return {
        "recording": str(path),
        "marks": len(found.delays_s),
        "missed": found.missed,
        "delays_s": found.delays_s,
        "median_delay_s": found.median_delay_s,
        "largest_delay_s": found.largest_delay_s,
        "false_alarms": found.false_alarms,
        "false_alarms_per_minute": found.false_alarms_per_minute,
        "worse": worse_in,
    }


def print_comparison(found: Mapping[Named, KeyComparison], *, as_json: bool) -> ExitCode:
    """Print the differences; ``REFUSED`` if anything differs by more than the tolerance."""
    for named, comparison in found.items():
        show([json.dumps(_json(named, comparison))] if as_json else _lines(named, comparison))
    differing = sum(not comparison.is_same for comparison in found.values())
    if not found:
        say("there is no message to compare")
    else:
        say(f"{differing} of {counted(len(found), 'key')} differ{_first_of_all(found)}")
    return ExitCode.REFUSED if differing else ExitCode.DONE


def _first_of_all(found: Mapping[Named, KeyComparison]) -> str:
    differences = [(named, one.difference) for named, one in found.items() if one.difference is not None]
    if not differences:
        return ""
    (key, _source, schema), first = min(differences, key=lambda one: one[1].first_s)
    return f"; the first is message {first.number} of {key}  {schema} at {first.first_s:.3f} s"


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
    errors = {
        path: {"rms": finite(one.rms), "largest": finite(one.largest), "count": one.count}
        for path, one in found.errors.items()
    }
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
