"""What happened lately, as a console's log table shows it.

Rules of this file: no bus, no clock, no screen. Events go in, rows come out, by the names of people; which rows are
wanted is decided where the command line decides it too, in ``mission_log``.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from itertools import islice

from backbone.component.messages import StoryEvent
from backbone.mission_log import AskLog, chosen
from backbone.people import People

LOG_KEPT = 500  # chosen: some minutes of a busy mission; the launcher keeps more


class LogBoard:
    """The newest events.

    Args:
        people: Who sits at which console.
    """

    def __init__(self, people: People) -> None:
        self._people = people
        self._events: deque[StoryEvent] = deque(maxlen=LOG_KEPT)

    def add(self, event: StoryEvent) -> None:
        """Keep that this happened just now."""
        self._events.append(event)

    def recall(self, events: Sequence[StoryEvent]) -> None:
        """Keep what happened before, too; what was heard here already is in it once."""
        told = {(event.at_s, event.where) for event in events}
        own = [event for event in self._events if (event.at_s, event.where) not in told]
        self._events = deque(sorted([*events, *own], key=lambda event: event.at_s), maxlen=LOG_KEPT)

    def rows(self, count: int, asked: AskLog | None, found: Sequence[StoryEvent] = ()) -> list[StoryEvent]:
        """Return the newest, oldest first.

        Args:
            count: At most so many.
            asked: Only what fits; None: all.
            found: What the launcher's log has of it; what was heard here since comes after that.
        """
        if asked is None:
            newest = list(islice(reversed(self._events), count))
            return [self._people.named_event(event) for event in reversed(newest)]
        known = found[-count:] if count else []
        told = {(event.at_s, event.where) for event in known}
        since_s = known[-1].at_s if known else 0.0
        heard = chosen(map(self._people.named_event, self._events), asked)
        news = [event for event in heard if event.at_s >= since_s and (event.at_s, event.where) not in told]
        return [*known, *news][-count:] if count else []
