"""The mission's log: events of components and actions of people, which the launcher keeps while it lives.

A component's story ends with the component, and questions about a console outlive it. So the launcher subscribes to all
events and keeps the newest ``EVENTS_KEPT``. ``wants`` selects events, for the command line and for the tables of
consoles.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from itertools import accumulate, islice, takewhile
from typing import Annotated

import msgspec

from backbone.bus.interface import Bus
from backbone.component.messages import ComponentState, LogLevel, StoryEvent
from backbone.component.story import is_about, speaks_of
from backbone.keys import Conversation
from backbone.mission_log.operators import OperatorActed
from backbone.mission_log.people import People
from backbone.naming import Subsystem
from backbone.printable import printable_all
from backbone.ranges import MANY, Count, Instant, Line, Mention
from backbone.wire import MAX_MESSAGE_BYTES, Envelope, Message

EVENTS_KEPT = 20_000  # chosen: hours of a busy mission, some megabytes
MOST_EVENTS = 10_000  # chosen: two megabytes of usual events
MOST_EVENTS_BYTES = MAX_MESSAGE_BYTES // 2  # chosen: fits one message with room to spare, however long the texts are
FOR_EVER_S = 1e12  # the latest ``Instant``
_ORDER = list(LogLevel)


class AskLog(Message, frozen=True):
    """Ask for events. Empty fields match all; an event must match all fields.

    Attributes:
        since_s: Earliest mission time.
        until_s: Latest mission time.
        robot: Only events about this name, of a robot or any other subject.
        person: Only actions of this person, and events that mention the person.
        level: Only events of at least this level.
        text: Only events that contain this text, in upper or lower case.
        most: Largest number of events; the newest are kept, as many as fit one message.
    """

    since_s: Instant = 0.0
    until_s: Instant = FOR_EVER_S
    robot: Mention = ""
    person: Mention = ""
    level: LogLevel = LogLevel.INFO
    text: Line = ""
    most: Annotated[int, msgspec.Meta(ge=1, le=MOST_EVENTS)] = MOST_EVENTS

    def wants(self, event: StoryEvent) -> bool:
        """Return whether the event matches the question.

        Example:
            >>> stopped = StoryEvent(2.0, "ui_console/c", "anna stops it", "scout1", "", LogLevel.ALARM, "anna")
            >>> AskLog(robot="scout1", person="Anna").wants(stopped), AskLog(robot="scout10").wants(stopped)
            (True, False)
        """
        return (
            self.reaches(event)
            and (not self.robot or is_about(event, self.robot))
            and (not self.person or _is_by_or_about(event, self.person))
            and self.text.casefold() in f"{event.subject}: {event.what}".casefold()
        )

    def reaches(self, event: StoryEvent) -> bool:
        """Return whether time and level of the event match; its text is not compared."""
        in_time = self.since_s <= event.at_s <= self.until_s
        return in_time and _ORDER.index(event.level) <= _ORDER.index(self.level)


class Log(Message, frozen=True):
    """Answer to ``AskLog``.

    Attributes:
        events: Oldest first.
        left_out: Number of older events that match too.
        since_s: Mission time of the oldest kept event; earlier ones are lost.
    """

    events: Annotated[list[StoryEvent], MANY]
    left_out: Count = 0
    since_s: Instant = 0.0


class AskPeople(Message, frozen=True):
    """Ask for the people at consoles, present and past."""


class PeopleKnown(Message, frozen=True):
    """Answer to ``AskPeople``.

    Attributes:
        consoles: Name of the console → name of the person.
    """

    consoles: Annotated[dict[Mention, Mention], MANY]


Logged = StoryEvent | OperatorActed | Log | ComponentState | PeopleKnown
"""Messages from which a log is made, and the names of the people in it."""


class MissionLog:
    """The newest events. Pure.

    Args:
        kept: Largest number of events.
    """

    def __init__(self, kept: int = EVENTS_KEPT) -> None:
        self._events: deque[StoryEvent] = deque(maxlen=kept)
        self._since_s = 0.0
        self.people = People()
        """People at consoles, whose names replace the consoles' names in answers."""

    def take(self, said: Logged, source: str = "", cause: str = "") -> None:
        """Apply a message that a component sent; ``cause`` is the message that led to it."""
        match said:
            case StoryEvent():
                self.add(said)
            case OperatorActed():
                self.add(said.event(source, cause))
            case Log():
                self._recall(said.events)
            case ComponentState():
                self.people.heard(said)
            case PeopleKnown():
                self.people.remember(said.consoles)

    def add(self, event: StoryEvent) -> None:
        """Add an event."""
        if len(self._events) == self._events.maxlen:
            self._since_s = self._events[1].at_s
        self._events.append(event)

    def newest(self, count: int) -> list[StoryEvent]:
        """Return the newest events, oldest first, with the names of people."""
        newest = list(islice(reversed(self._events), count))
        return [self.people.named_event(event) for event in reversed(newest)]

    def answer(self, asked: AskLog) -> Log:
        """Return the events that match, with the names of people."""
        found = chosen(map(self.people.named_event, filter(asked.reaches, self._events)), asked)
        kept = _newest_of_one_message(found[-asked.most :])
        return Log(kept, len(found) - len(kept), self._since_s)

    def _recall(self, events: Sequence[StoryEvent]) -> None:
        """Add earlier events; an event that is kept already is not added again."""
        known = {(event.at_s, event.where) for event in events}
        own = [event for event in self._events if (event.at_s, event.where) not in known]
        self._events = deque(sorted([*events, *own], key=lambda event: event.at_s), maxlen=self._events.maxlen)


def _newest_of_one_message(events: Sequence[StoryEvent]) -> list[StoryEvent]:
    """Return the newest events that fit one message, oldest first."""
    sizes = accumulate(len(msgspec.msgpack.encode(event)) for event in reversed(events))
    count = sum(1 for _ in takewhile(lambda size: size <= MOST_EVENTS_BYTES, sizes))
    return list(events[len(events) - count :])


def chosen(events: Iterable[StoryEvent], asked: AskLog) -> list[StoryEvent]:
    """Return the events that match, in the order of their times."""
    return sorted(filter(asked.wants, events), key=lambda event: event.at_s)


class LogKeeper:
    """Subscribes to a mission's events and keeps them."""

    def __init__(self, bus: Bus) -> None:
        self.log = MissionLog()
        bus.subscribe("*/*", Conversation.LOG, StoryEvent, self._heard)
        bus.subscribe("*/*", Conversation.OPERATORS, OperatorActed, self._heard)
        bus.subscribe(f"{Subsystem.UI_CONSOLE}/*", Conversation.STATUS, ComponentState, self._heard, latest=True)

    def _heard(self, envelope: Envelope[StoryEvent | OperatorActed | ComponentState]) -> None:
        self.log.take(printable_all(envelope.body), envelope.source, envelope.cause)


def _is_by_or_about(event: StoryEvent, person: str) -> bool:
    called = person.casefold()
    return called in (event.user.casefold(), event.subject.casefold()) or speaks_of(event.what.casefold(), called)
