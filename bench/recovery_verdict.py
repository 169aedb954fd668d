"""The effects of a fault on a mission, judged from an observer's looks.

Rules of this file: no processes, no clock, no bus. Times are the machine's monotonic clock.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from recovery_mission import Look, console_arcs

PICTURES_FLOW_S = 0.6  # chosen: twice the settling time of a picture at a switch


@dataclass(slots=True)
class Fault:
    """A fault of one process.

    Attributes:
        victim: Its name in this program.
        name: ``SIGKILL``, ``SIGTERM`` or ``SIGSTOP n``.
        rows: Components that live in it, or end with it.
        lifted_s: Time at which a stopped process was continued; for others ``at_s``.
        replaced_s: Time at which another process replaced it, if it is not a component; ``math.inf``: not yet.
    """

    victim: str
    name: str
    pid: int
    rows: tuple[str, ...]
    at_s: float = math.inf
    lifted_s: float = math.inf
    replaced_s: float = math.inf

    @property
    def kills(self) -> bool:
        """Whether the process cannot come back."""
        return not self.name.startswith("SIGSTOP")

    def is_mended(self, look: Look) -> bool:
        """Return whether, at this look, the victim's work was possible again."""
        if look.at_s < self.at_s:
            return True
        if not self.kills and look.began_s >= self.lifted_s:
            return True
        if self.victim == "console":
            return not console_arcs(look)
        if self.victim == "launcher":
            return False
        if self.victim.endswith("zygote"):
            return look.began_s >= self.replaced_s
        return all(look.pid(row) not in (0, self.pid) for row in self.rows)

    def is_noticed(self, look: Look, before: Look) -> bool:
        """Return whether a person could notice the fault in this look."""
        if look.word != "ok" or set(self.rows) & set(look.sight.get("absent", [])):
            return True
        restarts, restarts_before = look.sight.get("restarts", {}), before.sight.get("restarts", {})
        return any(
            look.pid(row) != before.pid(row) or restarts.get(row, 0) != restarts_before.get(row, 0) for row in self.rows
        )


@dataclass(frozen=True, slots=True)
class Expected:
    """The mission before any fault.

    Attributes:
        before: The last look before.
        ready: Components that must be ready.
        asks: ARCs that must ask for their resources.
    """

    before: Look
    ready: frozenset[str]
    asks: frozenset[str]

    def missing(self, look: Look) -> list[str]:
        """Return what this look lacks of the expected state, for people."""
        if "rows" not in look.sight:
            return ["everything"]
        asks = set(look.sight["asks"])
        return sorted(self.ready - look.ready()) + [f"request of {arc}" for arc in sorted(self.asks - asks)]


class Judgement:
    """Judges each look once, as it arrives."""

    def __init__(self, expected: Expected, fault: Fault) -> None:
        self.expected, self.fault = expected, fault
        self.good_since_s = math.inf
        """Time since which the mission has been whole and its health ``ok``; infinite while it is not."""
        self.was_bad = False
        self.noticed_s = math.inf
        self.unsaid_s = 0.0
        """Longest time in which the mission lacked something although its health was ``ok``."""
        self._unsaid_since_s = math.inf
        self._seen = 0

    def take(self, looks: Sequence[Look], pictures_s: Sequence[float]) -> None:
        """Judge the looks that are new since the last call."""
        new, self._seen = looks[self._seen :], len(looks)
        for look in new:
            if look.at_s > self.fault.at_s:
                self._judge(look, pictures_s)

    def _judge(self, look: Look, pictures_s: Sequence[float]) -> None:
        lacking = self.lacks(look, pictures_s)
        whole = not lacking
        if self.noticed_s == math.inf and self.fault.is_noticed(look, self.expected.before):
            self.noticed_s = look.at_s
        if set(lacking) - {"console as a process"} and look.word == "ok":  # a console is a person's, not the mission's
            self._unsaid_since_s = min(self._unsaid_since_s, max(self.fault.at_s, look.began_s))
            self.unsaid_s = max(self.unsaid_s, look.at_s - self._unsaid_since_s)
        else:
            self._unsaid_since_s = math.inf
        if whole and look.word == "ok":
            self.good_since_s = min(self.good_since_s, look.at_s)
        else:
            self.good_since_s, self.was_bad = math.inf, True

    def lacks(self, look: Look, pictures_s: Sequence[float]) -> list[str]:
        """Return what the mission lacks in this look, for people."""
        lacking = self.expected.missing(look)
        if not self.fault.is_mended(look):
            lacking.append(f"{self.fault.victim} as a process")
        newest = bisect_right(pictures_s, look.at_s) - 1
        if newest < 0 or look.at_s - pictures_s[newest] > PICTURES_FLOW_S:
            lacking.append("pictures")
        return lacking

    def healthy_after_s(self) -> float | None:
        """Return the time from the first fault to lasting health; 0.0: health never ended; None: it did not return."""
        if self.good_since_s == math.inf:
            return None
        return self.good_since_s - self.fault.at_s if self.was_bad else 0.0

    def noticed_after_s(self) -> float | None:
        """Return the time from the first fault to the first look that showed it; None: no look did."""
        return None if self.noticed_s == math.inf else self.noticed_s - self.fault.at_s


def longest_gap_s(pictures_s: Sequence[float], from_s: float, until_s: float) -> float:
    """Return the longest time without a picture between two moments.

    Example:
        >>> longest_gap_s([1.0, 1.1, 2.0, 9.0], 1.0, 2.5)
        0.9
    """
    within = [from_s, *(at_s for at_s in pictures_s if from_s < at_s < until_s), until_s]
    return max(later - earlier for earlier, later in pairwise(within))
