"""Checkpoints: a recorded mission at some instants, so that late instants are reached without reading all. Pure."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Mapping

from backbone.recording.reader import Recording
from backbone.recording.recorded_mission import HISTORY, STATES, RecordedMission
from backbone.recording.writer import NS
from backbone.wire import Message

EACH_S = 30.0  # chosen: the messages of half a minute are read within a second
MOST = 240  # chosen: two hours with one each half minute; a copy takes some hundred kilobytes
_KNOWN = tuple(f"*/{said}" for said in (*STATES, *HISTORY))


class Checkpoints:
    """Creates checkpoints while the recording is read; for one thread at a time.

    Args:
        classes: Known message classes, by schema.
        most: Approximate number of checkpoints that are kept; 0: none, for a reader that asks once.
    """

    def __init__(self, classes: Mapping[str, type[Message]], most: int = MOST) -> None:
        self._classes, self._most = classes, most
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
        next_s, last_s = max(since_s, contents.begin_s) + each_s, -math.inf
        until_s = (round(at_s * NS) - 1) / NS  # a recording counts whole nanoseconds
        for message in recording.messages(_KNOWN, max(0.0, since_s), until_s):
            if message.at_s >= next_s and message.at_s > last_s:
                self._keep(message.at_s, mission)
                next_s = message.at_s + each_s
            last_s = message.at_s
            mission.take(message)
        return mission

    def _keep(self, at_s: float, mission: RecordedMission) -> None:
        """Keep the state of the mission after all messages before this time."""
        if at_s > self._times_s[-1]:
            self._times_s.append(at_s)
            self._missions.append(mission.copied())
