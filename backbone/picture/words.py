"""The words for the facts of a picture, for command line, terminal and page: one sentence for one fact. Pure."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Mapping, Sequence

from backbone.component.messages import Absence, StandingStop
from backbone.mission_log.people import People
from backbone.naming import reading_order
from backbone.scheduling.views import RequestView
from backbone.spoken import counted

NAMES_SHOWN = 8  # chosen: they fit a line of a terminal
_SECONDS = re.compile(r"\b\d+(?:\.\d+)?(?= s\b)")

WANTED = "self"
"""The reason for a robot that the console itself gave back."""

UNDECIDED = ("lost", "lease", "silent", "rc")
"""The reasons for losses without a decision: the console was cut off or paused, or an RC does not answer."""

_SENTENCES = {
    "slice": "it is the turn of {by}",
    "higher": "{by} has the higher priority",
    "rc": "{by} does not answer",
    "capacity": "{by} can give less than before",
    "order": "{by} could not serve all its holders in time",
    "packets": "its packets take longer than was declared",
    "failed": "it could not be made ready",
    WANTED: "no run time was wanted",
    "silent": "this console or its ARC gave no sign of life",
    "lease": "the RC manager was silent for too long",
    "lost": "the ARC that held it for this console has ended",
}
"""The words of ``Suspended.reason``."""

RULES = {
    "3": "each ARC starts as early as its whole slice fits without delaying the ARCs before it",
    "5": "a slice ends only if an entitled ARC can use the RCs",
    "6": "RCs are stopped and freed, then settle for the next ARC",
    "8": "policy strict: no ARC starts while a higher one of its group waits",
    "9": "a higher ARC may keep others waiting for ever; that is allowed, and shown",
    "11": "an RC that is down or has too little capacity serves no ARC",
    "14": "an idle ARC keeps its request and frees its RCs",
    "15": "a large group is not planned whole: each RC is reserved for the first in line",
}
"""The rules of scheduling, by their numbers in the documentation."""


def why_lost(reason: str, by: str) -> str:
    """Return why a console lost its robot, or does not get it, as part of a sentence.

    Args:
        reason: The scheduler's word, or any text.
        by: Name of the cause, for people; empty: none.

    Example:
        >>> why_lost("slice", "ben"), why_lost("silent", ""), why_lost("a fuse blew", "")
        ('it is the turn of ben', 'this console or its ARC gave no sign of life', 'a fuse blew')
    """
    sentence = _SENTENCES.get(reason)
    if sentence is not None:
        return sentence.format(by=by or "another ARC")
    return f"{reason}, because of {by}" if by else reason


def because(request: RequestView, people: People) -> str:
    """Return why a request runs or waits, with the names of people and without the words of its row."""
    return people.named(request.because.removeprefix(f"{request.arc} {request.state}: "))


def absence_line(absence: Absence, now_s: float) -> str:
    """Return one absence as a line for people.

    Example:
        >>> absence_line(Absence("scout1", 2.0, "killed by SIGKILL", "starts again in 0.1 s"), 3.5)
        'scout1 is absent for 1.5 s: killed by SIGKILL; starts again in 0.1 s'
    """
    return f"{absence.name} {_trouble(absence, now_s)}"


def absence_lines(absences: Iterable[Absence], now_s: float) -> list[str]:
    """Return a line for each absence, or one for all that differ only in own names and times, if these are many."""
    return _joined((absence.name, _trouble(absence, now_s)) for absence in absences)


def stop_lines(stops: Mapping[str, StandingStop], now_s: float) -> list[str]:
    """Return a line for each emergency stop in force, or one for all that differ only in times, if these are many."""
    return _joined((name, _stop(stop, now_s)) for name, stop in stops.items())


def _joined(facts: Iterable[tuple[str, str]]) -> list[str]:
    """Return a line for each name and its fact, or one for all whose facts are alike, if these are many."""
    alike: dict[str, list[tuple[str, str]]] = {}
    for name, fact in facts:
        alike.setdefault(_SECONDS.sub("", _nameless(name, fact)), []).append((name, fact))
    lines = []
    for same in alike.values():
        if len(same) <= NAMES_SHOWN:
            lines += [f"{name} {fact}" for name, fact in same]
        else:
            names = counted_names([name for name, _ in same])
            lines.append(f"each of {names} {_with_ranges([_nameless(name, fact) for name, fact in same])}")
    return lines


def _nameless(name: str, fact: str) -> str:
    """Return the fact with ``NAME`` in place of the component's own name."""
    return re.sub(rf"(?<![\w.-]){re.escape(name)}(?![\w.-])", "NAME", fact)


def _with_ranges(texts: Sequence[str]) -> str:
    """Return a text for all, which differ only in their seconds.

    Example:
        >>> _with_ranges(["absent for 2.5 s, of 4 s", "absent for 1.5 s, of 4 s"])
        'absent for 1.5 to 2.5 s, of 4 s'
    """
    columns = zip(*(_SECONDS.findall(text) for text in texts), strict=True)
    ranges = (" to ".join(dict.fromkeys([min(column, key=float), max(column, key=float)])) for column in columns)
    return _SECONDS.sub(lambda _found: next(ranges), texts[0])


def _trouble(absence: Absence, now_s: float) -> str:
    lasts = f"for {max(0.0, now_s - absence.since_s):.1f} s"
    if absence.is_start:
        trouble = f"has been coming up {lasts}"
    elif absence.is_repeated:
        trouble = f"has failed again and again {lasts}"
    else:
        trouble = f"{'has not worked' if absence.is_running else 'is absent'} {lasts}"
    return "; ".join([f"{trouble}: {absence.cause}", *filter(None, (absence.doing, absence.remedy))])


def counted_names(names: Collection[str]) -> str:
    """Return the number of these components and the first names.

    Example:
        >>> counted_names({"scout10", "scout9"})
        '2 components (scout9, scout10)'
    """
    return f"{counted(len(names), 'component')} ({_first(sorted(names, key=reading_order))})"


def starts_line(doing: Mapping[str, str]) -> str:
    """Return the components that are being started, those that report something first.

    Args:
        doing: Component → its feedback; empty: it reports nothing yet.

    Example:
        >>> starts_line({"scout10": "", "scout9": "", "world": "connecting"})
        'starts world (connecting), scout9, scout10'
        >>> starts_line({f"scout{number}": "" for number in range(60)})
        'starts scout0, scout1, scout2, scout3, scout4, scout5, scout6, scout7 and 52 more'
    """
    names = sorted(doing, key=lambda name: (not doing[name], reading_order(name)))
    starts = [f"{name} ({doing[name]})" if doing[name] else name for name in names]
    return f"starts {_first(starts)}" if starts else "starts its services"


def _first(names: Sequence[str]) -> str:
    more = f" and {len(names) - NAMES_SHOWN} more" if len(names) > NAMES_SHOWN else ""
    return ", ".join(names[:NAMES_SHOWN]) + more


def stop_line(name: str, stop: StandingStop, now_s: float) -> str:
    """Return an emergency stop in force as a line for people.

    Example:
        >>> stop_line("scout1", StandingStop(1, "anna", "child in the room", 2.0), 5.0)
        'scout1 is STOPPED by anna for 3.0 s: child in the room; lift the stop at a console when it may move'
    """
    return f"{name} {_stop(stop, now_s)}"


def _stop(stop: StandingStop, now_s: float) -> str:
    why = f": {stop.reason}" if stop.reason else ""
    unsure = "" if stop.is_confirmed else "; its radio did not confirm the stop"
    lasts_s = max(0.0, now_s - stop.since_s)
    return f"is STOPPED by {stop.by} for {lasts_s:.1f} s{why}{unsure}; lift the stop at a console when it may move"
