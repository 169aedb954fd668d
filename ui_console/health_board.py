"""What a console knows of the mission's health, and the alarms that follow from it.

Rules of this file: no bus, no clock, no screen; times are arguments. The launcher says every second how its mission
is; a word that is too old counts no longer: then the mission is at best degraded, because the launcher is silent.
"""

from __future__ import annotations

from backbone.component.messages import Absence
from backbone.health import Health, HealthWord
from ui_console.alarms import AlarmBook
from ui_console.console_events import HealthHeard
from ui_console.views import AlarmKind, HealthView, Severity

LAUNCHER_NAME = "launcher"
REMEDY = "Look after the terminal of 'scout-backbone up'; 'scout-backbone down' ends the mission."


class HealthBoard:
    """The newest word on the mission's health.

    Args:
        alarms: Where absences begin and end.
    """

    def __init__(self, alarms: AlarmBook) -> None:
        self._alarms = alarms
        self._heard: HealthHeard | None = None
        self._absent: frozenset[str] = frozenset()

    def take(self, heard: HealthHeard) -> None:
        """Take the launcher's word in, or that it is listened to from now on."""
        if heard.health is None and self._heard is not None:
            return
        self._heard = heard
        self._tell(list(heard.health.absent) if heard.health is not None else [], heard.at_s)

    def look(self, now_s: float) -> None:
        """Find out whether the launcher is silent."""
        silence = self._silence(now_s)
        if silence is not None and LAUNCHER_NAME not in self._absent:
            said = self._heard.health if self._heard is not None else None
            self._tell([*(said.absent if said is not None else []), silence], now_s)

    def view(self, now_s: float) -> HealthView | None:
        """Return the word and one line for each absence; None: the launcher had no time yet to say anything."""
        heard = self._heard
        if heard is None:
            return None
        said = heard.health
        silence = self._silence(now_s)
        if silence is not None:
            word = HealthWord.FAILED if said is not None and said.word is HealthWord.FAILED else HealthWord.DEGRADED
            lines = [f"the launcher is silent for {max(0.0, now_s - silence.since_s):.0f} s: what is shown may be old"]
            lines += Health(word, tuple(said.absent)).lines(now_s) if said is not None else []
            return HealthView(str(word), lines)
        if said is None:
            return None
        return HealthView(str(said.word), Health(said.word, tuple(said.absent)).lines(now_s))

    def _silence(self, now_s: float) -> Absence | None:
        heard = self._heard
        if heard is None or now_s <= heard.until_s:
            return None
        return Absence(LAUNCHER_NAME, heard.at_s, "it is silent", "", REMEDY, vital=True)

    def _tell(self, absent: list[Absence], at_s: float) -> None:
        """Begin an alarm for each absence, and end those of what is back."""
        for absence in absent:
            what = "; ".join(part for part in (absence.cause, absence.doing) if part)
            line = f"{absence.name} is absent: {what}"
            severity = Severity.ALARM if absence.vital or not absence.doing else Severity.WARNING
            self._alarms.begin(AlarmKind.ABSENT, absence.name, line, absence.since_s, absence.remedy, severity=severity)
        names = frozenset(absence.name for absence in absent)
        for name in self._absent - names:
            self._alarms.end(AlarmKind.ABSENT, name, at_s)
        self._absent = names
