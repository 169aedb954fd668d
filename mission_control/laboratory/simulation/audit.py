"""Audit: the events of a simulated mission, in order; the laws examine only these events.

Rule of this file: events contain no object addresses, process ids or machine times, so that two runs of one seed give
the same bytes.
"""

from __future__ import annotations

import asyncio
import hashlib
import json
from collections.abc import Iterable, Iterator
from contextvars import ContextVar
from dataclasses import dataclass, field
from typing import Any

from mission_control.laboratory.simulation.simulated_processes import current_process


@dataclass(frozen=True, slots=True)
class Happening:
    """An event.

    Attributes:
        who: Name of the component.
        what: Kind of event, one word; see the laws for the meanings.
        values: The names and numbers of this case.
    """

    at_s: float
    who: str
    what: str
    values: dict[str, Any] = field(default_factory=dict)

    def to_line(self) -> str:
        """Return the event as one line of JSON, the same for the same content."""
        return json.dumps([round(self.at_s, 9), self.who, self.what, self.values], sort_keys=True)

    def concerns(self, names: Iterable[str]) -> bool:
        """Return whether the event is about one of these names."""
        mentioned = {self.who, *(str(value) for value in _flat(self.values))}
        return not mentioned.isdisjoint(names)

    def __str__(self) -> str:
        values = ", ".join(f"{name} {_short(value)}" for name, value in self.values.items())
        return f"{self.at_s:10.4f} s  {self.who}: {self.what}{f' ({values})' if values else ''}"


class Audit:
    """Records the events of one run."""

    def __init__(self) -> None:
        self.happenings: list[Happening] = []

    def note(self, who: str, what: str, **values: object) -> None:
        """Record an event now, but none of a dead process, whose tasks run to their ends."""
        process = current_process.get()
        if process is not None and process.is_dead:
            return
        self.happenings.append(Happening(asyncio.get_running_loop().time(), who, what, values))

    def digest(self) -> str:
        """Return a hash of all events."""
        digest = hashlib.sha256()
        for happening in self.happenings:
            digest.update(happening.to_line().encode() + b"\n")
        return digest.hexdigest()


current_audit: ContextVar[Audit] = ContextVar("current_audit")
"""The audit of the present task's run; drivers find it here, because a mission names them only by class path."""


def _flat(value: object) -> Iterator[object]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield name
            yield from _flat(inner)
    elif isinstance(value, list | tuple):
        for inner in value:
            yield from _flat(inner)
    else:
        yield value


def _short(value: object) -> str:
    return f"{value:g}" if isinstance(value, float) else str(value)
