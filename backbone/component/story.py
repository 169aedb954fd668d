"""The recent events of one component, each with its cause."""

from __future__ import annotations

import re
from collections import deque
from functools import lru_cache

from backbone.bus.interface import Clock, current_cause
from backbone.component.messages import LogLevel, StoryEvent
from backbone.naming import component_of
from backbone.printable import printable_all
from backbone.ranges import LONGEST_MENTION

LENGTH = 512  # chosen: some minutes of a busy component, under 100 kB
LONGEST_WHAT = 1_000  # chosen: a refusal with its remedy; 512 of them are half a megabyte


class StoryBook:
    """Keeps the newest events.

    Args:
        where: Address that tells the events.
        clock: Stamps them.
    """

    def __init__(self, where: str, clock: Clock) -> None:
        self._where, self._clock = where, clock
        self._events: deque[StoryEvent] = deque(maxlen=LENGTH)

    def note(self, subject: str, what: str, level: LogLevel = LogLevel.INFO, user: str = "") -> StoryEvent:
        """Keep that this happened to the subject now, because of the message being handled; as printable text.

        What is longer than ``LONGEST_WHAT`` is cut: others compose it too, and the book has its size.
        """
        what, subject, cause = what[:LONGEST_WHAT], subject[:LONGEST_MENTION], current_cause.get()[:LONGEST_MENTION]
        event = printable_all(StoryEvent(self._clock.now_s(), self._where, what, subject, cause, level, user))
        self._events.append(event)
        return event

    def of(self, subject: str = "") -> list[StoryEvent]:
        """Return the events about a subject or because of a message, or all, oldest first."""
        return [event for event in self._events if not subject or is_about(event, subject)]


def is_about(event: StoryEvent, subject: str) -> bool:
    """Say whether the event's subject, its cause or a whole name in its text is this one: not scout10 for scout1.

    A cause may be named without its subsystem, ``rc_manager#112``.
    """
    named = subject in (event.subject, event.cause, component_of(event.cause))
    return named or speaks_of(event.what, subject)


def speaks_of(text: str, name: str) -> bool:
    """Say whether the whole name stands in the text.

    Example:
        >>> speaks_of("held by scout10", "scout1"), speaks_of("held by scout1", "scout1")
        (False, True)
    """
    return _spoken_of(name).search(text) is not None


@lru_cache(maxsize=64)
def _spoken_of(name: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![\w-]){re.escape(name)}(?![\w-])")
