"""What an operator types to find something in the log: words, and fields by name.

Pure: a line in, a question out. Words that belong together need no quotes: all that is no field is one text.
"""

from __future__ import annotations

import math
from typing import Any

import msgspec

from backbone.component.messages import LogLevel
from backbone.errors import Refusal
from backbone.mission_log import AskLog

SEARCH_HELP = f"words, and robot:NAME person:NAME level:{'|'.join(LogLevel)} since:SECONDS; nothing: all"


class WrongSearch(Refusal):
    """What was typed is no question."""

    code = "console.wrong_search"
    remedy = f"Type {SEARCH_HELP}."


def read_search(line: str) -> AskLog | None:
    """Return what was asked for; None: all.

    Raises:
        WrongSearch: A field has a value that it cannot have.

    Example:
        >>> asked = read_search("person:anna was stopped")
        >>> asked.person, asked.text
        ('anna', 'was stopped')
    """
    fields: dict[str, Any] = {}
    words = []
    for word in line.split():
        name, colon, value = word.partition(":")
        if colon and value and name in ("robot", "person", "level", "since"):
            fields |= _field(name, value)
        else:
            words.append(word)
    if words:
        fields["text"] = " ".join(words)
    if not fields:
        return None
    try:
        return msgspec.convert(msgspec.to_builtins(AskLog(**fields)), AskLog)
    except msgspec.ValidationError as error:
        raise WrongSearch(str(error)) from error


def _field(name: str, value: str) -> dict[str, Any]:
    if name != "since":
        return {name: value}
    try:
        since_s = float(value)
    except ValueError:
        since_s = math.nan
    if not math.isfinite(since_s):
        raise WrongSearch(f"since: {value} is no number of mission seconds")
    return {"since_s": since_s}
