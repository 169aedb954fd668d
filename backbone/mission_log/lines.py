"""Events of the log and of stories as lines for people, and as plain data for programs. Pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from backbone.component.messages import LogLevel, StoryEvent
from backbone.mission_log.log import Log
from backbone.moments import Now

_MARKS = {LogLevel.ALARM: "!!", LogLevel.WARNING: "!", LogLevel.NOTICE: "", LogLevel.INFO: ""}
SUBJECT_COLUMNS = 20  # chosen: names of a mission fit


def log_lines(log: Log, now: Now) -> list[str]:
    """Return one line for each event: local time of day, mission time, level, subject, event.

    Example:
        >>> from datetime import datetime
        >>> event = StoryEvent(2.5, "ui_console/c", "anna stops it", "scout1", "", LogLevel.ALARM, "anna")
        >>> log_lines(Log([event]), Now(62.5, datetime(2026, 5, 4, 14, 10)))
        ['14:09:00       2.50 s  !! scout1                anna stops it']
    """
    return [
        f"{now.time_of_day(event.at_s):%H:%M:%S} {event.at_s:10.2f} s  {_MARKS[event.level]:2s} "
        f"{_about(event):{SUBJECT_COLUMNS}s}  {event.what}"
        for event in log.events
    ]


def _about(event: StoryEvent) -> str:
    """Return the subject, unless the sentence begins with it."""
    return "" if event.what.startswith(f"{event.subject} ") else event.subject


def log_json(log: Log, now: Now) -> dict[str, object]:
    """Return the events, each also with the time of day, as plain data."""
    events = [timed_event_json(event, now) for event in log.events]
    return {"events": events, "left_out": log.left_out, "since_s": log.since_s}


def story_lines(events: Iterable[StoryEvent]) -> list[str]:
    """Return one line for each event, with the component that recorded it and its cause."""
    return [
        f"{event.at_s:10.3f} s  {event.where:32s} {event.subject}: {event.what}"
        + (f"   because of {event.cause}" if event.cause else "")
        for event in events
    ]


def story_json(name: str, events: Iterable[StoryEvent], missing: Sequence[str]) -> dict[str, object]:
    """Return a story as plain data; ``missing`` names the components that did not answer."""
    return {"name": name, "events": [event_json(event) for event in events], "missing": list(missing)}


def timed_event_json(event: StoryEvent, now: Now) -> dict[str, object]:
    """Return one event with the time of day as plain data."""
    time = now.time_of_day(event.at_s).astimezone().isoformat(timespec="milliseconds")
    return event_json(event) | {"time": time}


def event_json(event: StoryEvent) -> dict[str, object]:
    """Return one event as plain data."""
    return {
        "at_s": event.at_s,
        "level": str(event.level),
        "subject": event.subject,
        "what": event.what,
        "person": event.user,
        "where": event.where,
        "cause": event.cause,
    }
