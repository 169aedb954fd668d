"""The mission's health as known to a console, and the resulting alarms.

Rules of this file: no bus, no clock, no screen; times are arguments. The launcher publishes the mission's health every
second. If the newest report is too old, the launcher is silent, and the mission counts as degraded at best.
"""

from __future__ import annotations

from backbone.component.messages import Absence
from backbone.picture.health import SILENT_AFTER_S, HealthWord, MissionHealth
from ui_console.model.alarms import AlarmBook
from ui_console.model.views import AlarmKind, HealthView, Severity

LAUNCHER_NAME = "launcher"
REMEDY = "Look after the terminal of 'scout-backbone up'; 'scout-backbone down' ends the mission."


class HealthBoard:
    """The newest report on the mission's health."""

    def __init__(self, alarms: AlarmBook) -> None:
        self._alarms = alarms
        self.rate = 1.0
        """Mission seconds per second of the machine."""
        self._said: MissionHealth | None = None
        self._said_s: float | None = None  # or the begin of the wait for the first report
        self._absent: frozenset[str] = frozenset()

    def take(self, said: MissionHealth, at_s: float) -> None:
        """Record the launcher's report."""
        self._said, self._said_s = said, at_s
        self._raise_alarms(said.absent, at_s)

    def look(self, now_s: float) -> None:
        """Check whether the launcher is silent; the wait for its first report begins with the first call."""
        if self._said_s is None:
            self._said_s = now_s
        silence = self._silence(now_s)
        if silence is not None and LAUNCHER_NAME not in self._absent:
            self._raise_alarms([*(self._said.absent if self._said is not None else []), silence], now_s)

    def view(self, now_s: float) -> HealthView | None:
        """Return the health and one line for each absence; None: the first report is not due yet."""
        said, silence = self._said, self._silence(now_s)
        if silence is None:
            return HealthView(str(said.word), said.lines(now_s)) if said else None
        is_failed = said is not None and said.word is HealthWord.FAILED
        word = HealthWord.FAILED if is_failed else HealthWord.DEGRADED
        return HealthView(str(word), MissionHealth(word, [silence, *(said.absent if said else ())]).lines(now_s))

    def _silence(self, now_s: float) -> Absence | None:
        if self._said_s is None or now_s <= self._said_s + SILENT_AFTER_S * self.rate:
            return None
        return Absence(LAUNCHER_NAME, self._said_s, "it is silent, so what is shown may be old", "", REMEDY, vital=True)

    def _raise_alarms(self, absent: list[Absence], at_s: float) -> None:
        """Begin an alarm for each absence, and end the alarms of components that are back."""
        for absence in absent:
            what = "; ".join(part for part in (absence.cause, absence.doing) if part)
            line = f"{absence.name} {_trouble(absence)}: {what}"
            severity = Severity.ALARM if absence.vital or not absence.doing else Severity.WARNING
            self._alarms.begin(AlarmKind.ABSENT, absence.name, line, absence.since_s, absence.remedy, severity=severity)
        names = frozenset(absence.name for absence in absent)
        for name in self._absent - names:
            self._alarms.end(AlarmKind.ABSENT, name, at_s)
        self._absent = names


def _trouble(absence: Absence) -> str:
    if absence.is_start:
        return "comes up"
    if absence.is_repeated:
        return "fails again and again"
    return "does not work" if absence.is_running else "is absent"
