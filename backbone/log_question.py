"""A question to the mission's log as people put it, for the command line and every console. Pure.

Rules of this file: words in, an ``AskLog`` or a typed refusal out. Whatever is typed, the question that goes to the
launcher has the limits of ``AskLog``.
"""

from __future__ import annotations

from dataclasses import dataclass

from backbone.component.messages import LogLevel
from backbone.errors import Refusal
from backbone.mission_log import FOR_EVER_S, MOST_EVENTS, AskLog
from backbone.moments import Now, moment
from backbone.ranges import LONGEST_MENTION

LONGEST_WORDS = 200  # chosen: more than a person searches for, and a page's message has room for it


class WrongSearch(Refusal):
    """A field of a question to the log has a value that it cannot have."""

    code = "log.wrong_search"
    remedy = f"Levels are {', '.join(LogLevel)}; names and texts are short; since comes before until."


@dataclass(frozen=True, slots=True)
class LogQuestion:
    """What a person wants to know of the log. Empty fields match all; what is asked must all be so.

    Attributes:
        text: Words that stand in the event.
        robot: Only what is about this name.
        person: Only what this person did, or what speaks of them.
        level: Only what matters at least so much.
        since: Not before this moment, see ``moments``.
        until: Not after it.
    """

    text: str = ""
    robot: str = ""
    person: str = ""
    level: str = ""
    since: str = ""
    until: str = ""

    def asked(self, now: Now, most: int = MOST_EVENTS) -> AskLog:
        """Return the question for the launcher.

        Args:
            now: What time it is.
            most: At most so many events, the newest.

        Example:
            >>> from datetime import datetime
            >>> question = LogQuestion(person=" anna ", since="1m").asked(Now(90.0, datetime(2026, 5, 4)))
            >>> question.person, question.since_s
            ('anna', 30.0)

        Raises:
            WrongSearch: A field has a value that it cannot have.
            NoMoment: ``since`` or ``until`` tells no moment.
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
    """Return the mission time that is meant; what lies before the mission or beyond all times is cut."""
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
