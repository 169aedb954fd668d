"""Alarms: what an operator must know, kept until somebody has seen it.

Rules of this file: no bus, no clock, no screen; times are arguments.

* An alarm is told apart by its key. The same one again counts up and has to be seen again; a condition that goes on
  is one alarm.
* What nobody has acknowledged is never forgotten for what somebody has, nor what is so now for what is over.
* While the operator is away alarms are kept and marked; acknowledging takes the mark away, coming back does not.
"""

from __future__ import annotations

from dataclasses import dataclass

from ui_console.views import NONE_S, AlarmKind, AlarmView, Severity

ALARMS_KEPT = 200  # chosen: more than a person reads; all of them are in the recording

SEVERITIES: dict[AlarmKind, Severity] = {
    AlarmKind.STOPPED: Severity.ALARM,
    AlarmKind.LOST: Severity.ALARM,
    AlarmKind.ABSENT: Severity.ALARM,
    AlarmKind.UNSAFE: Severity.ALARM,
    AlarmKind.RC_DOWN: Severity.ALARM,
    AlarmKind.LINK: Severity.ALARM,
    AlarmKind.STALE_VIDEO: Severity.WARNING,
    AlarmKind.STARVING: Severity.WARNING,
    AlarmKind.DEADLINE: Severity.WARNING,
    AlarmKind.OVERLOAD: Severity.WARNING,
    AlarmKind.TAKEN: Severity.NOTICE,
    AlarmKind.REFUSED: Severity.NOTICE,
    AlarmKind.NO_ANSWER: Severity.WARNING,
    AlarmKind.NOT_RECORDED: Severity.WARNING,
    AlarmKind.VISITOR: Severity.WARNING,
}
_WEIGHT = {Severity.ALARM: 0, Severity.WARNING: 1, Severity.NOTICE: 2}


@dataclass(slots=True)
class _Alarm:
    kind: AlarmKind
    subject: str
    line: str
    remedy: str
    first_s: float
    last_s: float
    count: int = 1
    is_active: bool = False
    acknowledged_by: str = ""
    while_away: bool = False


class AlarmBook:
    """The alarms of one console, or of all who share one model."""

    def __init__(self) -> None:
        self._alarms: dict[str, _Alarm] = {}
        self._away_since_s = NONE_S
        self.forgotten = 0
        """How many were dropped because there are too many."""

    @property
    def away_since_s(self) -> float:
        """Since when nobody looks; negative: somebody does."""
        return self._away_since_s

    def happened(self, kind: AlarmKind, subject: str, line: str, at_s: float, remedy: str = "", key: str = "") -> None:
        """Something happened; told again it counts up."""
        self._tell(kind, subject, line, at_s, remedy, key, is_active=False)

    def begin(self, kind: AlarmKind, subject: str, line: str, at_s: float, remedy: str = "", key: str = "") -> None:
        """Something is so from now on until ``end``; told again while it is so, only the line may change."""
        alarm = self._alarms.get(key or alarm_key(kind, subject))
        if alarm is not None and alarm.is_active:
            alarm.line, alarm.remedy = line, remedy
            return
        self._tell(kind, subject, line, at_s, remedy, key, is_active=True)

    def end(self, kind: AlarmKind, subject: str, at_s: float, key: str = "") -> None:
        """It is no longer so; the alarm stays until it is acknowledged."""
        alarm = self._alarms.get(key or alarm_key(kind, subject))
        if alarm is not None and alarm.is_active:
            alarm.is_active, alarm.last_s = False, at_s

    def retract(self, kind: AlarmKind, subject: str, key: str = "") -> None:
        """It was none: what explains it was heard later."""
        self._alarms.pop(key or alarm_key(kind, subject), None)

    def acknowledge(self, user: str, key: str = "") -> int:
        """Note that the user has seen one alarm, or with an empty key all; return how many that were new to people."""
        seen = [alarm for own_key, alarm in self._alarms.items() if key in ("", own_key) and not alarm.acknowledged_by]
        for alarm in seen:
            alarm.acknowledged_by, alarm.while_away = user, False
        return len(seen)

    def attention(self, is_there: bool, at_s: float) -> None:
        """The operator came, or went."""
        if not is_there and self._away_since_s < 0:
            self._away_since_s = at_s
        elif is_there:
            self._away_since_s = NONE_S

    def views(self) -> list[AlarmView]:
        """Return what is not both over and acknowledged: unseen ones first, then by weight, newest first."""
        shown = [(k, a) for k, a in self._alarms.items() if a.is_active or not a.acknowledged_by]
        shown.sort(key=lambda item: (bool(item[1].acknowledged_by), _WEIGHT[SEVERITIES[item[1].kind]], -item[1].last_s))
        return [
            AlarmView(
                key,
                alarm.kind,
                SEVERITIES[alarm.kind],
                alarm.subject,
                alarm.line,
                alarm.remedy,
                alarm.first_s,
                alarm.last_s,
                alarm.count,
                alarm.is_active,
                alarm.acknowledged_by,
                alarm.while_away,
            )
            for key, alarm in shown
        ]

    def _tell(
        self, kind: AlarmKind, subject: str, line: str, at_s: float, remedy: str, key: str, *, is_active: bool
    ) -> None:
        key = key or alarm_key(kind, subject)
        former = self._alarms.pop(key, None)
        self._alarms[key] = _Alarm(
            kind,
            subject,
            line,
            remedy,
            former.first_s if former else at_s,
            at_s,
            former.count + 1 if former else 1,
            is_active,
            "",
            self._away_since_s >= 0,
        )
        if len(self._alarms) > ALARMS_KEPT:
            self._forget_one()

    def _forget_one(self) -> None:
        """Forget the oldest of those that matter least: seen and over, then seen, then over."""
        oldest_first = list(self._alarms.items())
        victim, alarm = min(oldest_first, key=lambda item: (not item[1].acknowledged_by, item[1].is_active))
        del self._alarms[victim]
        if not alarm.acknowledged_by:
            self.forgotten += 1


def alarm_key(kind: AlarmKind, subject: str) -> str:
    """Return what an alarm is known by.

    Example:
        >>> alarm_key(AlarmKind.LOST, "scout1")
        'lost:scout1'
    """
    return f"{kind}:{subject}"
