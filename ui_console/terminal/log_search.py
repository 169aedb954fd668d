"""An operator's search in the log, and its result.

Pure: a line goes in, a question comes out. Words that belong together need no quotes, because all words that are not
    fields form one text.
"""

from __future__ import annotations

from dataclasses import dataclass

from backbone.component.messages import LogLevel
from backbone.mission_log.log import AskLog, Log
from backbone.mission_log.question import LogQuestion
from backbone.spoken import counted

SEARCH_HELP = f"words, and robot:NAME person:NAME level:{'|'.join(LogLevel)} since:5m until:14:05; nothing: all"
FOUND_SHOWN = 300  # chosen: more than a person reads; a narrower search shows the rest
_FIELDS = {*LogQuestion.__struct_fields__} - {"text"}


@dataclass(frozen=True, slots=True)
class LogResult:
    """Result of a search.

    Attributes:
        line: The typed line.
        asked: The question.
        log: The launcher's answer.
    """

    line: str
    asked: AskLog
    log: Log

    @property
    def title(self) -> str:
        """Title of the table.

        Example:
            >>> LogResult("robot:scout1", AskLog(robot="scout1"), Log([])).title
            'log: robot:scout1 (0 events)'
        """
        count = len(self.log.events) + self.log.left_out
        newest = f", the newest {FOUND_SHOWN}" if count > FOUND_SHOWN else ""
        return f"log: {self.line} ({counted(count, 'event')}{newest})"


def read_search(line: str) -> LogQuestion | None:
    """Return the typed question; None: all events.

    Example:
        >>> asked = read_search("person:anna was stopped")
        >>> asked.person, asked.text
        ('anna', 'was stopped')
    """
    given: dict[str, str] = {}
    words = []
    for word in line.split():
        name, colon, value = word.partition(":")
        if colon and value and name in _FIELDS:
            given[name] = value
        else:
            words.append(word)
    return LogQuestion(" ".join(words), **given) if words or given else None
