"""Detection: compares the sightings of watchers in a recording with marks of what could be seen. Pure.

A mark states that something was visible from one mission time to another, to any robot or to one. A sighting within a
mark detects it; a sighting within no mark is a false alarm.
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
"""Schema of a watcher's sighting; its class is in ``mission_control.messages``."""
SHORTEST_S = 1e-3  # chosen: a recording of one message has no length, but needs a rate

MissionTime = Annotated[float, msgspec.Meta(ge=0, le=1e12)]  # as ``ranges.Instant``, but no sighting is before 0


class NoMarks(Refusal):
    """The file has no marks, or a line is not a mark."""

    code = "usage.marks"
    remedy = 'Write a mark in each line, as {"from_s": 12, "to_s": 20, "what": "intruder", "robot": "scout1"}.'


class MarkNotRecorded(Refusal):
    """A mark is of a time that a recording does not have, so a watcher could not detect it there."""

    code = "recording.mark"
    remedy = "Name recordings that have the times of all marks, or remove the mark."


class Mark(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Something that was visible for a time.

    Attributes:
        from_s: Mission time of its begin.
        to_s: Mission time of its end, not before ``from_s``.
        what: Its description, for people.
        robot: The robot that could see it; empty: any.
    """

    from_s: MissionTime
    to_s: MissionTime
    what: Mention = ""
    robot: Mention = ""

    def has(self, sighting: WatcherReport) -> bool:
        """Return whether the sighting is within this mark."""
        return self.from_s <= sighting.at_s <= self.to_s and self.robot in ("", sighting.robot)


@dataclass(frozen=True, slots=True)
class WatcherReport:
    """A sighting of a watcher.

    Attributes:
        at_s: Mission time of the picture.
        robot: The robot that took the picture.
    """

    at_s: float
    robot: str


@dataclass(frozen=True, slots=True)
class DetectionRates:
    """The detection rates of some marks.

    Attributes:
        delays_s: For each mark, the seconds from its begin to its first sighting; None: the mark was missed.
        false_alarms: Number of sightings within no mark.
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
        """Median delay of the detected marks; None: no mark was detected."""
        return statistics.median(self.seen_after_s) if self.seen_after_s else None

    @property
    def largest_delay_s(self) -> float | None:
        """Largest delay of the detected marks; None: no mark was detected."""
        return max(self.seen_after_s, default=None)


def read_marks(text: str) -> list[Mark]:
    """Return the marks of a file with one JSON object in each line; empty lines are skipped.

    Raises:
        NoMarks: A line is not a mark, or the file has no mark.
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
        raise NoMarks("the file has no mark")
    return marks


def require_recorded(marks: Sequence[Mark], recording: str, begin_s: float, end_s: float) -> None:
    """Return if the recording has a part of the time of each mark.

    Raises:
        MarkNotRecorded: It has no part of one.
    """
    for number, mark in enumerate(marks, start=1):
        if mark.from_s > end_s or mark.to_s < begin_s:
            lasts = f"mark {number} is from {mark.from_s:g} to {mark.to_s:g} s"
            raise MarkNotRecorded(f"{lasts}, but {recording} has {begin_s:.3f} to {end_s:.3f} s", number=number)


def sightings(messages: Iterable[Recorded]) -> list[WatcherReport]:
    """Return the sightings among these messages; skip a sighting without time or robot."""
    seen = (one.body for one in messages if one.schema.partition("/")[0] == SIGHTING and isinstance(one.body, dict))
    told = ((body.get("at_s"), body.get("robot")) for body in seen)
    return [WatcherReport(at_s, robot) for at_s, robot in told if isinstance(at_s, float) and isinstance(robot, str)]


def detected(marks: Sequence[Mark], seen: Iterable[WatcherReport], lasted_s: float) -> DetectionRates:
    """Return the detection rates of the marks in a recording of this length."""
    ordered = sorted(seen, key=lambda sighting: sighting.at_s)
    firsts = [next((one.at_s - mark.from_s for one in ordered if mark.has(one)), None) for mark in marks]
    false_alarms = sum(not any(mark.has(one) for mark in marks) for one in ordered)
    return DetectionRates(tuple(firsts), false_alarms, max(lasted_s, SHORTEST_S))


def worse(first: DetectionRates, second: DetectionRates, later_s: float = 0.0) -> list[str]:
    """Return, for people, in which respects the second is worse than the first; empty: in none.

    Args:
        later_s: A mark that is detected later by at most so many seconds does not count as worse.
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
