"""The work of ``scout-backbone replay`` and ``scout-backbone recording why``: the decisions of a recording."""

from __future__ import annotations

import json
from itertools import takewhile
from pathlib import Path
from typing import Any

from backbone.command_line.recording_work import opened
from backbone.launcher.endings import ExitCode, say, show
from backbone.recording.decisions import Comparison, Difference, decided_anew
from backbone.recording.reasons import reasons_at
from backbone.scheduling.events import Record
from backbone.spoken import counted
from backbone.wire import plain


async def print_reasons_at(path: Path, name: str, at_s: float | None, *, as_json: bool) -> ExitCode:
    """Print why something was as it was at a mission time; None: at the end."""
    with opened(path) as recording:
        asked_s = recording.contents().end_s if at_s is None else at_s
        reasons = reasons_at(recording, name, asked_s)
    show([json.dumps({"at_s": asked_s} | reasons.to_json())] if as_json else reasons.lines(asked_s))
    return ExitCode.DONE


async def decide_anew(path: Path, since_s: float, rules: dict[str, Any], *, as_json: bool) -> ExitCode:
    """Let today's scheduler decide on the recorded events; print the first decision that is not as recorded."""
    with opened(path) as recording:
        found = decided_anew(recording, since_s, **rules)
    if as_json:
        show([json.dumps(_json(found))])
    elif found.difference is not None:
        show(_lines(found.difference))
    made = f"{counted(found.decisions, 'decision')} made anew, {counted(found.grants, 'grant')} among them"
    say(f"{made}: {'all as recorded' if found.difference is None else 'the last one is not as recorded'}")
    if found.missing:
        say(f"nothing is said of {counted(found.missing, 'decision')} that the recording does not have whole")
    return ExitCode.DONE if found.difference is None else ExitCode.REFUSED


def _lines(difference: Difference) -> list[str]:
    event = f"{type(difference.event).__name__} {json.dumps(plain(difference.event))}"
    pairs = zip(difference.recorded, difference.decided, strict=False)
    count = sum(1 for _pair in takewhile(lambda pair: pair[0].line == pair[1].line, pairs))
    return [
        f"decision {difference.number} at {difference.at_s:.3f} s, on {event}",
        f"  recorded, after {counted(count, 'line')} that both have:",
        *(map(_line, difference.recorded[count:]) if difference.recorded[count:] else ["    nothing"]),
        "  decided now:",
        *(map(_line, difference.decided[count:]) if difference.decided[count:] else ["    nothing"]),
    ]


def _line(record: Record) -> str:
    line = {name: value for name, value in record.line.items() if name not in {"ev", "t"}}
    return f"    {record.line['ev']} {json.dumps(line)}{f'  because {record.cause}' if record.cause else ''}"


def _json(found: Comparison) -> dict[str, object]:
    return {**plain(found), "event": type(found.difference.event).__name__ if found.difference else None}
