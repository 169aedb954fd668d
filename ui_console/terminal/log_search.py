"""What an operator types to find something in the log, and what was found.

Pure: a line in, a question out. Words that belong together need no quotes: all that is no field is one text.
"""

from __future__ import annotations

from dataclasses import dataclass

from backbone.component.messages import LogLevel
from backbone.log_question import LogQuestion
from backbone.mission_log import AskLog, Log
from backbone.spoken import counted

SEARCH_HELP = f"words, and robot:NAME person:NAME level:{'|'.join(LogLevel)} since:5m until:14:05; nothing: all"
FOUND_SHOWN = 300  # chosen: more than a person pages through; a narrower search shows the rest
_FIELDS = {*LogQuestion.__struct_fields__} - {"text"}


@dataclass(frozen=True, slots=True)
class Found:
    """What a search found.

    Attributes:
        line: As typed.
        asked: The question.
        log: The launcher's answer.
    """

    line: str
    asked: AskLog
    log: Log

    @property
    def title(self) -> str:
        """What stands over the table.

        Example:
            >>> Found("robot:scout1", AskLog(robot="scout1"), Log([])).title
            'log: robot:scout1 (0 events)'
        """
        count = len(self.log.events) + self.log.left_out
        newest = f", the newest {FOUND_SHOWN}" if count > FOUND_SHOWN else ""
        return f"log: {self.line} ({counted(count, 'event')}{newest})"


def read_search(line: str) -> LogQuestion | None:
    """Return what was asked for; None: all.

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
