"""Signs of life of the processes of one machine: the present work of each, and for how long it has been silent."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from typing import NamedTuple

from backbone.component.heartbeat import Vitals
from backbone.creator.silence import Silence

STACKS_AFTER_S = 2.5  # chosen: below the 3 s after which a creator replaces a hung process; machine seconds

ReadVitals = Callable[[str, int], Vitals | None]


class Sign(NamedTuple):
    """Observation of one process.

    Attributes:
        pid: The process.
        silent_s: Seconds of the machine for which it has shown no sign of life.
        late_s: Seconds of the machine, since the last observation, in which it could not run or was not looked at.
        beats: True if it has written a heartbeat.
        hangs: True once in a silence, when it is time to write the stacks of the process.
    """

    pid: int
    silent_s: float
    late_s: float
    beats: bool
    hangs: bool


class SignsOfLife:
    """Signs of life of the processes of one machine.

    Args:
        read_vitals: Reads the vitals of a process, given run directory and pid.
    """

    def __init__(self, read_vitals: ReadVitals) -> None:
        self._read_vitals = read_vitals
        self._silences: dict[int, Silence] = {}
        self._doing: dict[int, str] = {}

    def look(self, run_directory: str, pids: Iterable[int], now_s: float) -> Iterator[Sign]:
        """Yield the sign of each of these processes; one that has ended, which is not reported yet, is not silent."""
        for pid in pids:
            if (vitals := self._read_vitals(run_directory, pid)) is None:
                yield Sign(pid, 0.0, 0.0, beats=False, hangs=False)
            else:
                self._doing[pid] = vitals.doing
                silence, beats = self._silences.setdefault(pid, Silence()), vitals.beats > 0
                before_s = silence.silent_s
                silent_s = silence.look(vitals, now_s)
                yield Sign(pid, silent_s, silence.late_s, beats, before_s < STACKS_AFTER_S <= silent_s)

    def doing(self, pid: int) -> str:
        """Return the present work of the process; empty if it is unknown."""
        return self._doing.get(pid, "")

    def forget(self, pid: int) -> None:
        """Forget a process that has ended."""
        self._silences.pop(pid, None)
        self._doing.pop(pid, None)
