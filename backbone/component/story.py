"""The recent events of one component, each with its cause."""

from __future__ import annotations

import re
from collections import deque
from functools import lru_cache

from backbone.bus.interface import Clock, current_cause
from backbone.component.messages import LogLevel, StoryEvent
from backbone.errors import named
from backbone.naming import component_of
from backbone.printable import printable_all
from backbone.printable_text import printable
from backbone.ranges import LONGEST_MENTION

LENGTH = 512  # chosen: some minutes of a busy component, under 100 kB
MAX_FEEDBACK_LENGTH = 500  # chosen: a line for people, not a trace
LONGEST_WHAT = 1_000  # chosen: a refusal with its remedy; 512 of them are half a megabyte


class StoryBook:
    """Keeps the newest events.

    Args:
        where: Address of the component that records the events.
    """

    def __init__(self, where: str, clock: Clock) -> None:
        self._where, self._clock = where, clock
        self._events: deque[StoryEvent] = deque(maxlen=LENGTH)

    def note(self, subject: str, what: str, level: LogLevel = LogLevel.INFO, user: str = "") -> StoryEvent:
        """Record an event about the subject, caused by the current message, as printable text.

        A text longer than ``LONGEST_WHAT`` is cut, because other components write parts of it and the book stays small.
        """
        what, subject, cause = what[:LONGEST_WHAT], subject[:LONGEST_MENTION], current_cause.get()[:LONGEST_MENTION]
        event = printable_all(StoryEvent(self._clock.now_s(), self._where, what, subject, cause, level, user))
        self._events.append(event)
        return event

    def of(self, subject: str = "") -> list[StoryEvent]:
        """Return the events about a subject or caused by a message, or all, oldest first."""
        return [event for event in self._events if not subject or is_about(event, subject)]


def is_about(event: StoryEvent, subject: str) -> bool:
    """Return whether the subject, the cause or a whole name in the text of the event is this name.

    ``scout1`` does not match ``scout10``. A cause may be named without its subsystem, ``rc_manager#112``.
    """
    named = subject in (event.subject, event.cause, component_of(event.cause))
    return named or speaks_of(event.what, subject)


def speaks_of(text: str, name: str) -> bool:
    """Return whether the text contains the whole name.

    Example:
        >>> speaks_of("held by scout10", "scout1"), speaks_of("held by scout1", "scout1")
        (False, True)
    """
    return _spoken_of(name).search(text) is not None


@lru_cache(maxsize=64)
def _spoken_of(name: str) -> re.Pattern[str]:
    return re.compile(rf"(?<![\w-]){re.escape(name)}(?![\w-])")


def feedback_of(bug: BaseException) -> str:
    """Return a bug as one printable line of a component's feedback; any program can write its text."""
    return printable(" ".join(named(bug).split())[:MAX_FEEDBACK_LENGTH])
