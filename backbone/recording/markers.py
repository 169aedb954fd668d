"""Markers: instants of a recording that a person wants to look at. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from enum import StrEnum

import msgspec

from backbone.component.messages import LogLevel, StoryEvent
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed
from backbone.rc_manager.messages import TraceLine
from backbone.recording.reader import Recorded, Recording
from backbone.recording.revival import Reviver

PARTS = 500  # chosen: a line across a page cannot show more instants
_SAID = tuple(f"*/{said}" for said in (Conversation.EVENTS, Conversation.LOG, Conversation.OPERATORS))


class MarkerKind(StrEnum):
    """Why a person wants to see an instant."""

    ALARM = "alarm"
    OPERATOR = "operator"
    GRANT = "grant"
    REVOKED = "revoked"


class Marker(msgspec.Struct, frozen=True):
    """An instant of a recording.

    Attributes:
        at_s: Mission time.
        name: The ARC, robot or component concerned.
        line: The event, for people.
    """

    at_s: float
    kind: MarkerKind
    name: str
    line: str


def markers_in(recording: Recording) -> list[Marker]:
    """Return the grants, alarms and actions of people in the order of time, at most ``PARTS`` of each kind.

    Messages of another form than in this release have no marker.

    Raises:
        NoRecording: The recording is damaged.
    """
    found = recording.contents()
    return spread(_markers(recording.messages(_SAID)), found.begin_s, found.end_s)


def spread(markers: Iterable[Marker], begin_s: float, end_s: float) -> list[Marker]:
    """Return, for each kind, the first marker in each of ``PARTS`` equal parts of the time."""
    part_s = max(end_s - begin_s, 1e-9) / PARTS
    first: dict[tuple[MarkerKind, int], Marker] = {}
    for marker in markers:
        part = min(PARTS - 1, max(0, int((marker.at_s - begin_s) / part_s)))
        first.setdefault((marker.kind, part), marker)
    return sorted(first.values(), key=lambda marker: marker.at_s)


def _markers(messages: Iterable[Recorded]) -> Iterator[Marker]:
    reasons: dict[str, str] = {}
    reviver = Reviver()
    for message in messages:
        match reviver.revived(message, TraceLine, OperatorActed, StoryEvent):
            case TraceLine() as told:
                yield from _switch(message.at_s, told, reasons)
            case OperatorActed() as act:
                yield Marker(message.at_s, MarkerKind.OPERATOR, act.subject, f"{act.subject}: {act.sentence}")
            case StoryEvent(level=LogLevel.ALARM) as event:
                yield Marker(message.at_s, MarkerKind.ALARM, event.subject, f"{event.subject}: {event.what}")


def _switch(at_s: float, told: TraceLine, reasons: dict[str, str]) -> Iterator[Marker]:
    """Yield the effect of a decision on an ARC; the reason of a grant comes from the line that began its connection."""
    arc = str(told.line.get("arc", ""))
    match told.line.get("ev"):
        case "connect":
            reasons[arc] = told.cause
        case "grant":
            yield Marker(at_s, MarkerKind.GRANT, arc, f"{arc} gets its resources: {reasons.pop(arc, told.cause)}")
        case "revoke":
            yield Marker(at_s, MarkerKind.REVOKED, arc, f"{arc} loses its resources: {told.cause}")
