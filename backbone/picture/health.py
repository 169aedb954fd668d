"""Health of a mission in one word, with its absent components.

Rules of this file: pure; observations go in, the verdict comes out. Each owner reports its absent components
(``Component.absences``); this file joins these reports with the absences that the observer found itself.

* ``ok``: no wanted component is absent, and all can do their work.
* ``starting``: the mission comes up, for at most ``STARTING_MOST_S``; wanted components may be absent.
* ``degraded``: a wanted component is absent, or cannot do its work, and its owner tries again.
* ``failed``: a vital component has been absent for longer than ``FAILED_AFTER_S``, or the owner of an absent
  component makes no further attempt to start it.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from enum import StrEnum
from typing import Annotated

from backbone.component.messages import Absence, ComponentState
from backbone.naming import reading_order
from backbone.picture.words import absence_lines
from backbone.ranges import MANY
from backbone.wire import Message, plain

LOOK_EVERY_S = 0.5  # chosen: an absence appears within two rounds; machine seconds
SAY_EVERY_S = 1.0  # chosen: one small message a second from one process; machine seconds
SILENT_AFTER_S = 2.0  # chosen: two messages of the launcher were missed; machine seconds
FAILED_AFTER_S = 10.0  # chosen: twice the longest recovery time among the aims (a killed creator, 5 s)
STARTING_MOST_S = 60.0  # chosen: 400 components start in less; a mission that still waits for a host is degraded


class HealthWord(StrEnum):
    """The health of a mission."""

    OK = "ok"
    STARTING = "starting"
    DEGRADED = "degraded"
    FAILED = "failed"


class MissionHealth(Message, frozen=True):
    """Health of a mission; the launcher publishes it on every change, and every ``SAY_EVERY_S`` as its heartbeat.

    Attributes:
        absent: Absent components: vital ones first, then by name.
    """

    word: HealthWord
    absent: Annotated[list[Absence], MANY] = []

    def lines(self, now_s: float) -> list[str]:
        """Return the absences for people; see ``absence_lines``."""
        return absence_lines(self.absent, now_s)

    def to_json(self) -> dict[str, object]:
        """Return ``health`` and ``absent`` as plain data."""
        return {"health": str(self.word), "absent": plain(self.absent)}


def health(
    components: Mapping[str, ComponentState], missed: Iterable[Absence], now_s: float, rate: float = 1.0
) -> MissionHealth:
    """Return the mission's health.

    Args:
        components: State of each registered component, by address.
        missed: Absences that the observer found: services that are not registered or did not answer.
    """
    absent: dict[str, Absence] = {}
    for absence in (*missed, *(each for state in components.values() for each in state.absent)):
        known = absent.get(absence.name)
        if known is None or absence.since_s < known.since_s:
            absent[absence.name] = absence
    found = sorted(absent.values(), key=lambda each: (not each.vital, reading_order(each.name)))
    return MissionHealth(_word(found, now_s, rate), found)


def _word(absent: Collection[Absence], now_s: float, rate: float) -> HealthWord:
    def longer(absence: Absence, than_s: float) -> bool:
        return now_s - absence.since_s > than_s * rate

    if any(not one.doing or (one.vital and longer(one, FAILED_AFTER_S)) for one in absent):
        return HealthWord.FAILED
    if any(one.is_start and not longer(one, STARTING_MOST_S) for one in absent):
        return HealthWord.STARTING
    return HealthWord.DEGRADED if absent else HealthWord.OK
