"""Events and actions of people as Foxglove's log panel shows them. Pure."""

from __future__ import annotations

from collections.abc import Iterator

from foxglove.messages import Log
from foxglove.messages import LogLevel as Level

from backbone.component.messages import LogLevel, StoryEvent
from backbone.foxglove.well_known import Translations, WellKnown, moment
from backbone.mission_log.operators import OperatorActed

LEVELS = {
    LogLevel.ALARM: Level.Error,
    LogLevel.WARNING: Level.Warning,
    LogLevel.NOTICE: Level.Info,
    LogLevel.INFO: Level.Debug,
}


def log_line(event: StoryEvent) -> Iterator[WellKnown]:
    """Yield the event as a line of the log."""
    said = f"{event.subject}: {event.what}" if event.subject else event.what
    line = Log(timestamp=moment(event.at_s), level=LEVELS[event.level], message=said, name=event.where)
    yield WellKnown("/log", line)


def action_line(action: OperatorActed) -> Iterator[WellKnown]:
    """Yield the action of a person as a line of the log."""
    return log_line(action.event(action.user))


TRANSLATIONS: Translations = {StoryEvent: log_line, OperatorActed: action_line}
