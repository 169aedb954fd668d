"""A person's question to the mission's log, for the command line and every console. Pure.

Rules of this file: words in, an ``AskLog`` or a typed refusal out. For any input, the question to the launcher keeps
the limits of ``AskLog``.
"""

from __future__ import annotations

from typing import Annotated

import msgspec

from backbone.component.messages import LogLevel
from backbone.errors import Refusal
from backbone.mission_log.log import FOR_EVER_S, MOST_EVENTS, AskLog
from backbone.moments import Now, moment
from backbone.ranges import LONGEST_MENTION, Mention

LONGEST_WORDS = 200  # chosen: longer than any search of a person, and it fits a page's message


class WrongSearch(Refusal):
    """A field of a question to the log has an illegal value."""

    code = "log.wrong_search"
    remedy = f"Levels are {', '.join(LogLevel)}; names and texts are short; since comes before until."


class LogQuestion(msgspec.Struct, frozen=True):
    """A person's question to the log. Empty fields match all; an event must match all fields.

    Attributes:
        text: Words that the event contains.
        robot: Only events about this name.
        person: Only actions of this person, and events that mention the person.
        level: Only events of at least this level.
        since: Earliest moment, see ``moments``.
        until: Latest moment.
    """

    text: Annotated[str, msgspec.Meta(max_length=LONGEST_WORDS)] = ""
    robot: Mention = ""
    person: Mention = ""
    level: Mention = ""
    since: Mention = ""
    until: Mention = ""

    def asked(self, now: Now, most: int = MOST_EVENTS) -> AskLog:
        """Return the question for the launcher.

        Args:
            now: The present time.
            most: Largest number of events; the newest are kept.

        Example:
            >>> from datetime import datetime
            >>> question = LogQuestion(person=" anna ", since="1m").asked(Now(90.0, datetime(2026, 5, 4)))
            >>> question.person, question.since_s
            ('anna', 30.0)

        Raises:
            WrongSearch: A field has an illegal value.
            NoMoment: ``since`` or ``until`` is no moment.
        """
        since_s, until_s = _instant(self.since, now, 0.0), _instant(self.until, now, FOR_EVER_S)
        if since_s > until_s:
            raise WrongSearch(f"since {self.since} comes after until {self.until}")
        return AskLog(
            since_s,
            until_s,
            _short("robot", self.robot, LONGEST_MENTION),
            _short("person", self.person, LONGEST_MENTION),
            _level(self.level),
            _short("text", self.text, LONGEST_WORDS),
            most,
        )


def _instant(text: str, now: Now, default_s: float) -> float:
    """Return the mission time of the text, limited to the mission's begin and the latest time."""
    return min(max(0.0, moment(text.strip(), now)), FOR_EVER_S) if text.strip() else default_s


def _short(field: str, text: str, most: int) -> str:
    words = " ".join(text.split())
    if len(words) > most:
        raise WrongSearch(f"{field} has {len(words)} characters, {most} are the most")
    return words


def _level(text: str) -> LogLevel:
    if text.strip() and text.strip() not in set(LogLevel):
        raise WrongSearch(f"there is no level {text.strip()[:LONGEST_WORDS]!r}")
    return LogLevel(text.strip() or LogLevel.INFO)
