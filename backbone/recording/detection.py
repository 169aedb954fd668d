"""Detection: what watchers saw in a recording, against marks of what there was to see. Pure.

A mark says that something could be seen from one mission time to another, by any robot or by one. A sighting within a
mark detects it; a sighting within none is a false alarm.
"""

from __future__ import annotations

import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Annotated

import msgspec

from backbone.errors import Refusal
from backbone.ranges import Mention
from backbone.recording.reader import Recorded

SIGHTING = "MotionSeen"
"""Schema of what a watcher publishes when it sees something; ``mission_control.messages`` has it."""
SHORTEST_S = 1e-3  # chosen: a recording of one message has no length, but a rate all the same

MissionTime = Annotated[float, msgspec.Meta(ge=0, le=1e12)]  # as ``ranges.Instant``, but nothing is seen before 0


class NoMarks(Refusal):
    """A file of marks is none."""

    code = "usage.marks"
    remedy = 'Write a mark in each line, as {"from_s": 12, "to_s": 20, "what": "intruder", "robot": "scout1"}.'


class Mark(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Something that could be seen.

    Attributes:
        from_s: Mission time from which on.
        to_s: Until when, not before ``from_s``.
        what: What it was, for people.
        robot: The robot through which it could be seen; empty: any.
    """

    from_s: MissionTime
    to_s: MissionTime
    what: Mention = ""
    robot: Mention = ""

    def has(self, sighting: WatcherReport) -> bool:
        """Return whether the sighting is one of this."""
        return self.from_s <= sighting.at_s <= self.to_s and self.robot in ("", sighting.robot)


@dataclass(frozen=True, slots=True)
class WatcherReport:
    """A watcher saw something.

    Attributes:
        at_s: Mission time of the picture.
        robot: The robot whose picture it is.
    """

    at_s: float
    robot: str


@dataclass(frozen=True, slots=True)
class DetectionRates:
    """What was seen of some marks.

    Attributes:
        delays_s: Mark by mark the seconds from its begin to its first sighting; None: it was missed.
        false_alarms: Sightings within no mark.
        lasted_s: Length of the recording, seconds, above 0.
    """

    delays_s: tuple[float | None, ...]
    false_alarms: int
    lasted_s: float

    @property
    def seen_after_s(self) -> list[float]:
        """The delays of the marks that were detected."""
        return [delay_s for delay_s in self.delays_s if delay_s is not None]

    @property
    def missed(self) -> int:
        """Number of marks without a sighting."""
        return self.delays_s.count(None)

    @property
    def false_alarms_per_minute(self) -> float:
        """Rate of sightings within no mark."""
        return 60.0 * self.false_alarms / self.lasted_s

    @property
    def median_delay_s(self) -> float | None:
        """Median delay of the detected marks; None: there is none."""
        return statistics.median(self.seen_after_s) if self.seen_after_s else None

    @property
    def largest_delay_s(self) -> float | None:
        """Largest delay of the detected marks; None: there is none."""
        return max(self.seen_after_s, default=None)


def read_marks(text: str) -> list[Mark]:
    """Return the marks of a file, one JSON object in each line; empty lines are none.

    Raises:
        NoMarks: A line is no mark, or there is none.
    """
    marks: list[Mark] = []
    for number, line in enumerate(text.splitlines(), start=1):
        if not line.strip():
            continue
        try:
            mark = msgspec.json.decode(line, type=Mark)
        except (msgspec.DecodeError, UnicodeError, RecursionError) as error:
            raise NoMarks(f"line {number} is no mark: {error}", line=number) from error
        if mark.to_s < mark.from_s:
            raise NoMarks(f"line {number}: it ends at {mark.to_s:g} s, before {mark.from_s:g} s", line=number)
        marks.append(mark)
    if not marks:
        raise NoMarks("it has no mark")
    return marks


def sightings(messages: Iterable[Recorded]) -> list[WatcherReport]:
    """Return the sightings among these messages; one that lacks its time or robot is none."""
    seen = (one.body for one in messages if one.schema.partition("/")[0] == SIGHTING and isinstance(one.body, dict))
    return [WatcherReport(body["at_s"], body["robot"]) for body in seen if {"at_s", "robot"} <= body.keys()]


def detected(marks: Sequence[Mark], seen: Iterable[WatcherReport], lasted_s: float) -> DetectionRates:
    """Return what was seen of the marks in a recording of this length."""
    ordered = sorted(seen, key=lambda sighting: sighting.at_s)
    firsts = [next((one.at_s - mark.from_s for one in ordered if mark.has(one)), None) for mark in marks]
    false_alarms = sum(not any(mark.has(one) for mark in marks) for one in ordered)
    return DetectionRates(tuple(firsts), false_alarms, max(lasted_s, SHORTEST_S))


def worse(first: DetectionRates, second: DetectionRates, later_s: float = 0.0) -> list[str]:
    """Return for people in what the second is worse than the first, of the same marks; empty: in nothing.

    Args:
        later_s: A mark that is detected so much later, in seconds, is not worse.
    """
    found: list[str] = []
    for number, (before_s, after_s) in enumerate(zip(first.delays_s, second.delays_s, strict=True), start=1):
        if before_s is not None and after_s is None:
            found.append(f"mark {number} is missed")
        elif before_s is not None and after_s is not None and after_s > before_s + later_s:
            found.append(f"mark {number} is detected {after_s - before_s:.3f} s later")
    if second.false_alarms_per_minute > first.false_alarms_per_minute:
        found.append(
            f"{second.false_alarms_per_minute:.3g} false alarms a minute, not {first.false_alarms_per_minute:.3g}"
        )
    return found
