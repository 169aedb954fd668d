"""Live or recorded messages as lines for people and as plain data for programs. Pure."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

from backbone.command_line.key_facts import TrafficRow, facts_text
from backbone.recording.reader import Recorded

LONGEST_BODY = 160  # chosen: a line of a wide terminal


def message_line(message: Recorded) -> str:
    """Return one line: time, key, schema, and as much of the body as fits."""
    said = message.body if isinstance(message.body, bytes) else json.dumps(message.body, separators=(",", ":"))
    body = str(said)
    shown = body if len(body) <= LONGEST_BODY else f"{body[: LONGEST_BODY - 1]}…"
    return f"{message.at_s:10.3f} s  {short_key(message.key)}  {message.schema}  {shown}"


def message_json(message: Recorded) -> dict[str, object]:
    """Return the whole message as plain data."""
    return {
        "at_s": message.at_s,
        "key": message.key,
        "source": message.source,
        "schema": message.schema,
        "sequence": message.sequence,
        "stamp_s": message.stamp_s,
        "heard_s": message.heard_s,
        "cause": message.cause,
        "body": message.body.hex() if isinstance(message.body, bytes) else message.body,
    }


def short_key(key: str) -> str:
    """Return the key without ``scout/<mission>/``.

    Example:
        >>> short_key("scout/night/resource_pool/scout1/readings")
        'resource_pool/scout1/readings'
    """
    return key.split("/", 2)[-1]


def field_of(body: Any, path: str) -> Any:
    """Return the value of a field of a body, or None. Parts of the path are names, or numbers in a list.

    Example:
        >>> field_of({"rcs": [{"rc": "radio"}, {"rc": "scout1"}]}, "rcs.1.rc")
        'scout1'
        >>> field_of({"x_m": 2.0}, "x_m.y") is None
        True
    """
    for part in path.split("."):
        if isinstance(body, dict):
            body = body.get(part)
        elif isinstance(body, list) and part.isdecimal() and int(part) < len(body):
            body = body[int(part)]
        else:
            return None
    return body


@dataclass(slots=True)
class Traffic:
    """Number and size of the messages of one key, sender and schema."""

    messages: int = 0
    size_bytes: int = 0


@dataclass(slots=True)
class TrafficTable:
    """Rates and sizes of keys since the table was made or cleared."""

    rows: dict[tuple[str, str, str], Traffic] = field(default_factory=dict)

    def add(self, key: str, source: str, schema: str, size_bytes: int) -> None:
        """Count one message."""
        row = self.rows.setdefault((key, source, schema), Traffic())
        row.messages += 1
        row.size_bytes += size_bytes

    def busiest(self, lasted_s: float) -> list[TrafficRow]:
        """Return a row for each key, sender and schema, those with the most bytes first."""
        found = [
            {
                "key": key,
                "source": source,
                "schema": schema,
                "messages_per_s": row.messages / lasted_s,
                "bytes_per_s": row.size_bytes / lasted_s,
                "mean_bytes": row.size_bytes / row.messages,
            }
            for (key, source, schema), row in self.rows.items()
        ]
        return sorted(found, key=lambda one: (-one["bytes_per_s"], one["key"], one["source"], one["schema"]))


def traffic_lines(rows: Sequence[TrafficRow]) -> list[str]:
    """Return one line for each row, with the facts of its key.

    Example:
        >>> from backbone.command_line.key_facts import KeyFacts, with_facts
        >>> table = TrafficTable()
        >>> table.add("scout/night/resource_pool/world/bodies", "resource_pool/world", "WorldState/1", 40)
        >>> traffic_lines(with_facts(table.busiest(2.0), KeyFacts(), "night"))
        ['    0.50/s        20 B/s      40 B  resource_pool/world/bodies  WorldState/1  best effort, normal']
    """
    return [
        f"{one['messages_per_s']:8.2f}/s {one['bytes_per_s']:9.0f} B/s {one['mean_bytes']:7.0f} B  "
        f"{short_key(one['key'])}  {one['schema'] or 'no message'}{_sender(one)}  {facts_text(one)}"
        for one in rows
    ]


def _sender(row: TrafficRow) -> str:
    """Return the sender, unless it is the component of the key."""
    key, source = short_key(row["key"]), row["source"]
    return f"  from {source}" if source and not key.startswith(f"{source}/") else ""
