"""Alarms: conditions that an operator must know now, few enough to be read.

Rules of this file: no bus, no clock, no screen; times are arguments.

* A key identifies an alarm. A repeated alarm counts up and must be acknowledged again; a lasting condition is one
alarm.
* When a condition ends, its alarm is removed; the log has the event. The alarm of an event is removed after a time that
  is shorter for lower severity.
* While the operator is away, no alarm is removed: it is marked until a person acknowledges it.
* One cause makes one line: an alarm that follows from another alarm is listed below it, and acknowledged with it.
* When the book is full, acknowledged alarms are dropped before unacknowledged ones, and ended conditions before present
  ones.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

from msgspec.structs import replace

from ui_console.model.views import NONE_S, AlarmKind, AlarmView, Severity

ALARMS_KEPT = 200  # chosen: more than a person reads; the recording has all alarms
FADES_AFTER_S = {Severity.NOTICE: 20.0, Severity.WARNING: 60.0}  # chosen: time to read it twice; a real alarm stays

AT_ONCE_S = 5.0  # chosen: a lease, and the restart time of a component; later events have their own causes

SEVERITIES: dict[AlarmKind, Severity] = {
    AlarmKind.STOPPED: Severity.ALARM,
    AlarmKind.LOST: Severity.ALARM,
    AlarmKind.ABSENT: Severity.ALARM,
    AlarmKind.UNSAFE: Severity.ALARM,
    AlarmKind.RC_DOWN: Severity.ALARM,
    AlarmKind.LINK: Severity.ALARM,
    AlarmKind.BATTERY: Severity.WARNING,
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
"""Severity of an alarm of a kind, unless the alarm has its own."""
_WEIGHT = {Severity.ALARM: 0, Severity.WARNING: 1, Severity.NOTICE: 2}
_CAUSES = (AlarmKind.LINK, AlarmKind.ABSENT, AlarmKind.LOST, AlarmKind.RC_DOWN)
"""Kinds from which other alarms follow, the most fundamental kind first."""
_RANKS = len(_CAUSES) + 1


class AlarmBook:
    """The alarms of one console, or of all consoles that share one model.

    Args:
        beside: Another book whose state of attention is used here, too; None: this book has its own.
    """

    def __init__(self, beside: AlarmBook | None = None) -> None:
        self._alarms: dict[str, AlarmView] = {}
        self._over: set[str] = set()
        self._beside = beside
        self._own_away_since_s = NONE_S
        self._now_s = NONE_S

    @property
    def away_since_s(self) -> float:
        """Mission time from which the operator is away; negative: the operator is present."""
        return self._beside.away_since_s if self._beside is not None else self._own_away_since_s

    def happened(
        self,
        kind: AlarmKind,
        subject: str,
        line: str,
        at_s: float,
        remedy: str = "",
        key: str = "",
        severity: Severity | None = None,
        *,
        lasts: bool = False,
    ) -> None:
        """Raise the alarm of an event or, with ``lasts``, of a condition until ``end``; a repeated call counts up."""
        key, severity = key or alarm_key(kind, subject), severity or SEVERITIES[kind]
        former = self._alarms.pop(key, None)
        first_s, count = (former.first_s, former.count + 1) if former is not None else (at_s, 1)
        self._alarms[key] = AlarmView(
            key,
            kind,
            severity,
            subject,
            line,
            remedy,
            first_s,
            at_s,
            count,
            lasts,
            "",
            self.away_since_s >= 0,
            keys=[key],
        )
        self._over.discard(key)
        if len(self._alarms) > ALARMS_KEPT:
            self._forget_one()

    def begin(
        self,
        kind: AlarmKind,
        subject: str,
        line: str,
        at_s: float,
        remedy: str = "",
        severity: Severity | None = None,
    ) -> None:
        """Raise the alarm of a condition until ``end``; a repeated call changes only the text."""
        key = alarm_key(kind, subject)
        alarm = self._alarms.get(key)
        if alarm is not None and alarm.is_active:
            self._alarms[key] = replace(alarm, line=line, remedy=remedy, severity=severity or SEVERITIES[kind])
        else:
            self.happened(kind, subject, line, at_s, remedy, severity=severity, lasts=True)

    def end(self, kind: AlarmKind, subject: str, at_s: float) -> None:
        """End the alarm of a condition, because no action is needed any more."""
        key = alarm_key(kind, subject)
        alarm = self._alarms.get(key)
        if alarm is not None and alarm.is_active:
            self._alarms[key] = replace(alarm, is_active=False, last_s=at_s, remedy="")
            self._over.add(key)

    def hold(self, is_so: bool, kind: AlarmKind, subject: str, line: str, at_s: float, remedy: str = "") -> None:
        """If the condition holds, raise its alarm; otherwise end it."""
        if is_so:
            self.begin(kind, subject, line, at_s, remedy)
        else:
            self.end(kind, subject, at_s)

    def mended(self, kinds: Sequence[AlarmKind]) -> None:
        """End the alarms of events of these kinds, because the operator's wish has been fulfilled since."""
        for key, alarm in self._alarms.items():
            if alarm.kind in kinds and not alarm.is_active:
                self._alarms[key] = replace(alarm, remedy="")
                self._over.add(key)

    def retract(self, kind: AlarmKind, subject: str) -> None:
        """Remove an alarm that a later message explains."""
        self._alarms.pop(alarm_key(kind, subject), None)
        self._over.discard(alarm_key(kind, subject))

    def acknowledge(self, user: str, keys: Sequence[str] = ()) -> int:
        """Record that the user has seen these alarms (without a key: all); return the number of newly seen ones."""
        seen = [alarm for key, alarm in self._alarms.items() if not keys or key in keys]
        seen = [alarm for alarm in seen if not alarm.acknowledged_by and self._is_shown(alarm)]
        for alarm in seen:
            self._alarms[alarm.key] = replace(alarm, acknowledged_by=user, while_away=False)
        return len(seen)

    def attention(self, is_there: bool, at_s: float) -> None:
        """Record that the operator is present or away."""
        if not is_there and self._own_away_since_s < 0:
            self._own_away_since_s = at_s
        elif is_there:
            self._own_away_since_s = NONE_S

    def look(self, now_s: float) -> None:
        """Remove the alarms of events whose time is over."""
        self._now_s = max(self._now_s, now_s)

    def views(self) -> list[AlarmView]:
        """Return the alarms to show: unseen ones first, then by severity, newest first."""
        return in_order(filter(self._is_shown, self._alarms.values()))

    def _is_shown(self, alarm: AlarmView) -> bool:
        if alarm.is_active or alarm.while_away:
            return True
        fades_after_s = FADES_AFTER_S.get(alarm.severity)
        is_faded = fades_after_s is not None and self._now_s - alarm.last_s > fades_after_s
        return not (alarm.key in self._over or alarm.acknowledged_by or is_faded)

    def _forget_one(self) -> None:
        """Drop the oldest alarm of the least severity: acknowledged or unseen and ended first, then any ended one."""

        def weight(key: str) -> tuple[bool, bool]:
            alarm = self._alarms[key]
            is_unseen = not alarm.acknowledged_by and (alarm.while_away or key not in self._over)
            return is_unseen, alarm.is_active

        alarm = self._alarms.pop(min(self._alarms, key=weight))  # of equal alarms the first, because it is the oldest
        self._over.discard(alarm.key)


def alarm_key(kind: AlarmKind, subject: str) -> str:
    """Return the key of an alarm.

    Example:
        >>> alarm_key(AlarmKind.LOST, "scout1")
        'lost:scout1'
    """
    return f"{kind}:{subject}"


def in_order(alarms: Iterable[AlarmView]) -> list[AlarmView]:
    """Return the alarms in reading order: unseen ones first, then by severity, newest first."""
    return sorted(alarms, key=lambda one: (bool(one.acknowledged_by), _WEIGHT[one.severity], -one.last_s))


def one_line_for_one_cause(
    alarms: Sequence[AlarmView], explained_by: Callable[[str], frozenset[str]]
) -> list[AlarmView]:
    """Return the alarms in order; an alarm that follows from another one is listed with it.

    Args:
        alarms: The alarms, in any order.
        explained_by: Returns the names of the components on which a subject depends: its host's creator, the components
            it uses.
    """
    causes = [one for one in alarms if _rank(one) < _RANKS]
    root_of = {one.key: _cause_of(one, causes, explained_by) for one in alarms}
    below: dict[str, list[AlarmView]] = {}
    for one in alarms:
        root = one
        while (cause := root_of[root.key]) is not None:
            root = cause
        below.setdefault(root.key, []).append(one)
    roots = [one for one in alarms if root_of[one.key] is None]
    return in_order(_with(root, [one for one in below[root.key] if one is not root]) for root in roots)


def _cause_of(
    one: AlarmView, causes: Sequence[AlarmView], explained_by: Callable[[str], frozenset[str]]
) -> AlarmView | None:
    """Return the alarm from which this one follows; it has a higher rank, or fewer needs, so there are no cycles."""
    rank, needs = _rank(one), explained_by(one.subject)

    def explains(cause: AlarmView) -> bool:
        if _rank(cause) == rank:
            return cause.subject in needs and len(explained_by(cause.subject)) < len(needs)
        is_near = cause.subject in {one.subject, *needs}
        is_unseen = cause.kind is AlarmKind.LINK and one.last_s >= cause.first_s  # no message comes: all looks lost
        is_at_once = cause.is_active or abs(one.last_s - cause.last_s) <= AT_ONCE_S
        return _rank(cause) < rank and is_at_once and (is_near or is_unseen)

    return min(filter(explains, causes), key=_rank, default=None)


def _rank(alarm: AlarmView) -> int:
    if alarm.is_active and alarm.kind in _CAUSES:
        return _CAUSES.index(alarm.kind)
    return len(_CAUSES) if alarm.kind is AlarmKind.LOST else _RANKS  # a crash explains alarms around it


def _with(root: AlarmView, others: Sequence[AlarmView]) -> AlarmView:
    if not others:
        return root
    return replace(
        root,
        also=[one.line for one in others],
        keys=[root.key, *(one.key for one in others)],
        acknowledged_by=root.acknowledged_by if all(one.acknowledged_by for one in others) else "",
        while_away=root.while_away or any(one.while_away for one in others),
    )
