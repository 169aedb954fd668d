"""Result of a search in the mission's log, sent in parts.

Rules of this file: no socket, no bus, no clock. A part is small, so that no answer delays the pictures and heartbeats
of the same page: ten thousand events are two megabytes, and a slow link needs twenty seconds for them.
"""

from __future__ import annotations

import msgspec

from backbone.mission_log.lines import timed_event_json
from backbone.mission_log.log import Log
from backbone.moments import Now

PART_EVENTS = 100  # chosen: more than a screen shows
PART_BYTES = 24_576  # chosen: size of at most a picture and a half


class FoundLog:
    """The answer to one search.

    Args:
        number: Number of the search; the page ignores results of older searches.
        log: The launcher's answer.
        now: Time of the answer.
    """

    def __init__(self, number: int, log: Log, now: Now) -> None:
        self.number = number
        self._log, self._now = log, now

    def part(self, first: int) -> dict[str, object]:
        """Return some events, the newest first.

        Args:
            first: Number of events that the page already has.

        Returns:
            ``events`` with these; ``total``, their number in the answer; ``left_out``, the number of older matches;
            ``since_s``, begin of the kept log; ``asked_s``, time of the question.
        """
        events: list[msgspec.Raw] = []
        size = 0
        for event in reversed(self._log.events[: max(0, len(self._log.events) - first)]):
            line = msgspec.json.encode(timed_event_json(event, self._now))
            size += len(line)
            if events and (size > PART_BYTES or len(events) >= PART_EVENTS):
                break
            events.append(msgspec.Raw(line))
        return {
            "number": self.number,
            "first": first,
            "events": events,
            "total": len(self._log.events),
            "left_out": self._log.left_out,
            "since_s": self._log.since_s,
            "asked_s": self._now.mission_s,
        }
