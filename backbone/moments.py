"""Moments as people type them, in mission time. Pure: the present time is an argument."""

from __future__ import annotations

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from backbone.errors import Refusal

_AGO = re.compile(r"(\d+(?:\.\d+)?)(s|m|h|d)")
_SECONDS = {"s": 1.0, "m": 60.0, "h": 3_600.0, "d": 86_400.0}
_CLOCK = re.compile(r"(\d{1,2}):(\d{2})(?::(\d{2}))?")
_MISSION_TIME = re.compile(r"\d+(?:\.\d+)?")
FIRST_DAY = datetime.min.replace(tzinfo=UTC) + timedelta(days=2)
LAST_DAY = datetime.max.replace(tzinfo=UTC) - timedelta(days=2)
"""Limits of a time of day, two days inside the range of dates: a conversion between time zones stays in the range."""


class NoMoment(Refusal):
    """The text is no moment."""

    code = "usage.moment"
    remedy = "Type 5m (s, m, h, d ago), 14:05 or 14:05:30 (time of day), or 123.4 (mission time, as stories show it)."


@dataclass(frozen=True)
class Now:
    """The present time.

    Attributes:
        here: Local time of this machine.
    """

    mission_s: float
    here: datetime
    rate: float = 1.0

    def time_of_day(self, at_s: float) -> datetime:
        """Return this machine's local time at a mission time, limited to ``FIRST_DAY`` and ``LAST_DAY``."""
        try:
            shown = self.here.astimezone(UTC) - timedelta(seconds=(self.mission_s - at_s) / self.rate)
        except OverflowError:
            shown = FIRST_DAY if at_s < self.mission_s else LAST_DAY
        return min(max(shown, FIRST_DAY), LAST_DAY).astimezone().replace(tzinfo=None)


def moment(text: str, now: Now) -> float:
    """Return the mission time of a typed moment.

    Example:
        >>> now = Now(600.0, datetime(2026, 5, 4, 14, 10))
        >>> moment("5m", now), moment("14:05", now), moment("123.4", now)
        (300.0, 300.0, 123.4)

    Raises:
        NoMoment: The text is no moment.
    """
    if ago := _AGO.fullmatch(text):
        return now.mission_s - float(ago[1]) * _SECONDS[ago[2]] * now.rate
    if _MISSION_TIME.fullmatch(text):
        return float(text)
    if clock := _CLOCK.fullmatch(text):
        hour, minute, second = int(clock[1]), int(clock[2]), int(clock[3] or 0)
        if hour < 24 and minute < 60 and second < 60:
            then = now.here.replace(hour=hour, minute=minute, second=second, microsecond=0)
            then -= timedelta(days=1) if then > now.here else timedelta(0)  # the last moment with this time of day
            return now.mission_s - (now.here.timestamp() - then.timestamp()) * now.rate
    raise NoMoment(f"{text!r} is no moment", text=text)
