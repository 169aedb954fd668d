"""The types of the console page's messages, for the checker of its JavaScript.

Run ``python -m ui_console.web.page_types`` after a change of a message: it writes ``page/messages.d.ts`` anew. A test
compares that file with the structs, and what a server sends with ``View`` and ``Answer``.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any, get_args

import msgspec

from ui_console.views import (
    AlarmView,
    ComponentRow,
    HealthView,
    HostView,
    LinkView,
    LogRow,
    NodeView,
    OwnView,
    ParameterView,
    RequestRow,
    RobotView,
    TimelineView,
)
from ui_console.web.door import Beat, Hello
from ui_console.web.protocol import Intent

FILE = Path(__file__).parent / "page" / "messages.d.ts"
HEAD = "// What the page and its server send each other. Written by ui_console/web/page_types.py; change the structs.\n"


class Welcomed(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Who came in, and where."""

    user: str
    priority: int
    mission: str


class View(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """All sections of the view; a message has those that changed."""

    welcome: Welcomed
    own: OwnView
    robots: list[RobotView]
    links: list[LinkView]
    alarms: list[AlarmView]
    drawn: dict[str, float]
    tree: list[NodeView]
    requests: list[RequestRow]
    timeline: TimelineView
    hosts: list[HostView]
    health: HealthView | None
    parameters: list[ParameterView]
    components: list[ComponentRow]
    log: list[LogRow]
    now_s: float
    beat: int | None = None


class LoggedEvent(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """One event of the mission's log, as the command line's JSON has it."""

    at_s: float
    level: str
    subject: str
    what: str
    person: str
    where: str
    cause: str
    time: str


class LogFound(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A part of what a search found."""

    number: int
    first: int
    events: list[LoggedEvent]
    total: int
    left_out: int
    since_s: float
    asked_s: float


class LogRefused(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A search that finds nothing because it cannot be."""

    number: int
    code: str
    refused: str
    remedy: str


class WhyAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Why something is as it is."""

    why: str
    lines: list[str]


class RefusedAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """What is not done, or not certain."""

    refused: str


class ParametersAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Whether a component told its parameters."""

    parameters: str
    told: bool


class SetAnswer(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Whether a parameter was changed."""

    set: str
    parameter: str
    done: bool


ANSWERS = (WhyAnswer, RefusedAnswer, ParametersAnswer, SetAnswer)


def declarations() -> str:
    """Return the whole file."""
    said = [Hello, Beat, *get_args(Intent)]
    parts = [HEAD]
    parts += _interfaces([View, LogFound, LogRefused, *ANSWERS], is_sent_whole=True)
    parts += _interfaces(said, is_sent_whole=False)
    answers = " | ".join([*(kind.__name__ for kind in ANSWERS), "{ log: LogFound | LogRefused }"])
    parts.append(f"export type Answer = {answers};\n")
    parts.append("export type Heard = { view: Partial<View>; answer?: undefined } | { answer: Answer };\n")
    words = "\n".join(f"  | {kind.__name__}" for kind in said)
    parts.append(f"export type Said =\n{words};\n")
    return "\n".join(parts)


def _interfaces(kinds: Iterable[type[msgspec.Struct]], *, is_sent_whole: bool) -> list[str]:
    """Return one declaration for each struct and enum that these need, by name.

    Args:
        kinds: The structs.
        is_sent_whole: True: fields with a default are always there, because the server writes them.
    """
    _schemas, components = msgspec.json.schema_components(kinds)
    return [_declaration(name, schema, is_sent_whole) for name, schema in sorted(components.items())]


def _declaration(name: str, schema: dict[str, Any], is_sent_whole: bool) -> str:
    if "enum" in schema:
        values = "".join(f"\n  | {msgspec.json.encode(value).decode()}" for value in schema["enum"])
        return f"export type {name} ={values};\n"
    required = schema["properties"] if is_sent_whole else schema.get("required", [])
    fields = [
        f"  {field}{'' if field in required else '?'}: {_type(of)};\n" for field, of in schema["properties"].items()
    ]
    return f"export interface {name} {{\n{''.join(fields)}}}\n"


def _type(schema: dict[str, Any]) -> str:
    """Return the TypeScript type of a JSON schema.

    Example:
        >>> _type({"anyOf": [{"type": "array", "items": {"type": "number"}}, {"type": "null"}]})
        'number[] | null'
    """
    match schema:
        case {"$ref": str(ref)}:
            return ref.rpartition("/")[2]
        case {"enum": list(values)}:
            return " | ".join(msgspec.json.encode(value).decode() for value in values)
        case {"anyOf": list(kinds)}:
            return " | ".join(map(_type, kinds))
        case {"type": "array", "items": dict(items)}:
            of = _type(items)
            return f"({of})[]" if " " in of else f"{of}[]"
        case {"type": "object", "additionalProperties": dict(values)}:
            return f"Record<string, {_type(values)}>"
        case {"type": "integer" | "number"}:
            return "number"
        case {"type": "string" | "boolean" | "null" as plain}:
            return str(plain)
        case _:
            return "unknown"


if __name__ == "__main__":
    FILE.write_text(declarations())
