"""Checkpoints: a recorded mission at some instants, so that late instants are reached without reading all. Pure."""

from __future__ import annotations

import heapq
import math
from bisect import bisect_right
from collections.abc import Iterator, Mapping

from backbone.keys import Conversation
from backbone.recording.hearing import is_meant
from backbone.recording.reader import Recorded, Recording
from backbone.recording.recorded_mission import HISTORY, STATES, RecordedMission
from backbone.recording.writer import NS
from backbone.wire import Message

EACH_S = 30.0  # chosen: the messages of half a minute are read within a second
MOST = 240  # chosen: two hours with one each half minute; a copy takes some hundred kilobytes
_PICTURES = f"*/{Conversation.FRAMES}"
_KNOWN = tuple(f"*/{said}" for said in (*STATES, *HISTORY) if said is not Conversation.FRAMES)


class Checkpoints:
    """Creates checkpoints while the recording is read; for one thread at a time.

    Args:
        classes: Known message classes, by schema.
        most: Approximate number of checkpoints that are kept; 0: none, for a reader that asks once.
    """

    def __init__(self, classes: Mapping[str, type[Message]], most: int = MOST) -> None:
        self._most = most
        self._times_s = [-math.inf]
        self._missions = [RecordedMission(classes)]

    def mission_at(self, recording: Recording, at_s: float) -> RecordedMission:
        """Return the state of the mission after all messages before this time.

        Raises:
            NoRecording: The recording is damaged.
        """
        newest = bisect_right(self._times_s, at_s) - 1
        mission, since_s = self._missions[newest].copied(), self._times_s[newest]
        contents = recording.contents()
        each_s = max(EACH_S, (contents.end_s - contents.begin_s) / self._most) if self._most else math.inf
        until_s = min(_just_before(at_s), contents.end_s)
        while since_s <= until_s:
            next_s = max(since_s, contents.begin_s) + each_s
            for message in _known(recording, max(0.0, since_s), min(until_s, _just_before(next_s))):
                mission.take(message)
            if next_s <= until_s:
                self._keep(next_s, mission)
            since_s = next_s
        return mission

    def _keep(self, at_s: float, mission: RecordedMission) -> None:
        """Keep the state of the mission after all messages before this time."""
        if at_s > self._times_s[-1]:
            self._times_s.append(at_s)
            self._missions.append(mission.copied())


def _just_before(at_s: float) -> float:
    """Return the last time before this one; a recording counts whole nanoseconds."""
    return (round(at_s * NS) - 1) / NS if math.isfinite(at_s) else at_s


def _known(recording: Recording, since_s: float, until_s: float) -> Iterator[Recorded]:
    """Yield the messages that change a state; of the pictures, which are most of a file, the newest of each key."""
    pictures = _newest_pictures(recording, since_s, until_s)
    return heapq.merge(pictures, recording.messages(_KNOWN, since_s, until_s), key=lambda message: message.at_s)


def _newest_pictures(recording: Recording, since_s: float, until_s: float) -> list[Recorded]:
    """Return the newest picture of each key in this time, in the order of sending."""
    missing = {one.key for one in recording.contents().counts if is_meant(one.key, (_PICTURES,))}
    found = list[Recorded]()
    for message in recording.messages((_PICTURES,), since_s, until_s, newest_first=True) if missing else ():
        if message.key in missing:
            found.append(message)
            missing.discard(message.key)
        if not missing:
            break
    return found[::-1]
