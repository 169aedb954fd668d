"""Readings book: the newest readings of an RC, the times of publication, and the alarm of a low battery.

Rules of this file:

* Readings are published when a value has changed, but not within ``EVERY_S`` after the last publication. The last
  change is always published.
* A battery is low from the first charge below its alarm share until the first charge ``RECHARGED_SHARE`` above it.

Pure; times are mission seconds.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from enum import Enum

EVERY_S = 0.5  # chosen: a person reads a gauge no faster
RECHARGED_SHARE = 0.05  # chosen: more than a gauge fluctuates, less than one charging adds

Value = float | bool


class ReadingsBook:
    """Readings of one RC.

    Args:
        every_s: Least time between two publications.
    """

    def __init__(self, every_s: float = EVERY_S) -> None:
        self._every_s = every_s
        self._published_s = -math.inf
        self._published: Mapping[str, Value] = {}
        self.values: Mapping[str, Value] = {}
        """The newest values; empty: none yet."""
        self.at_s = -1.0
        """Mission time of the newest values; negative: none yet."""

    def put(self, values: Mapping[str, Value], now_s: float) -> None:
        """Record the newest values."""
        self.values, self.at_s = dict(values), now_s

    @property
    def due_s(self) -> float | None:
        """Time at which the newest values are due for publication; None: they are already published."""
        return None if self.values == self._published else self._published_s + self._every_s

    def published(self, now_s: float) -> None:
        """Record that the newest values are published now."""
        self._published, self._published_s = self.values, now_s


class Charge(Enum):
    """News of a battery."""

    AS_BEFORE = "as before"
    LOW = "low"
    CHARGED_AGAIN = "charged again"


class BatteryWatch:
    """Watches the charge of one battery.

    Args:
        alarm_share: The battery is low below this share of its capacity.
    """

    def __init__(self, alarm_share: float) -> None:
        self._alarm_share = alarm_share
        self._is_low = False

    def see(self, share: float) -> Charge:
        """Return the event that this charge (0 to 1) causes."""
        if self._is_low and share >= min(1.0, self._alarm_share + RECHARGED_SHARE):
            self._is_low = False
            return Charge.CHARGED_AGAIN
        if not self._is_low and share < self._alarm_share:
            self._is_low = True
            return Charge.LOW
        return Charge.AS_BEFORE
