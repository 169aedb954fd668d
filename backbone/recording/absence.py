"""Absence of the link: messages that crossed the bus meanwhile were not overheard; their number is unknown. Pure."""

from __future__ import annotations


class LinkAbsence:
    """Sums up the absences of a link that cost messages.

    Args:
        harmless_s: Senders keep the messages of so many seconds, so a shorter absence costs none.
    """

    def __init__(self, harmless_s: float = 0.0) -> None:
        self._harmless_s = harmless_s
        self._fell_s: float | None = None
        self.total_s = 0.0
        """Seconds of ended absences whose messages are missing."""

    def changed(self, is_up: bool, now_s: float) -> float:
        """Record that the link is up or down; return the seconds of the absence that ended now, if it cost messages.

        Args:
            is_up: Whether the link is up.
            now_s: Time of the machine.
        """
        if not is_up:
            self._fell_s = now_s if self._fell_s is None else self._fell_s
            return 0.0
        lasted_s = 0.0 if self._fell_s is None else now_s - self._fell_s
        self._fell_s = None
        missed_s = lasted_s if lasted_s > self._harmless_s else 0.0
        self.total_s += missed_s
        return missed_s


def missing_in(away_s: float) -> str:
    """Return the sentence about an absence.

    Example:
        >>> missing_in(2.5)
        'the hub was away for 2.5 s; an unknown number of messages is missing'
    """
    return f"the hub was away for {away_s:.1f} s; an unknown number of messages is missing"
