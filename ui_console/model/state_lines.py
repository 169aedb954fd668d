"""The state of a console without a screen, as lines of text.

Rules of this file: a view in, lines out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from ui_console.model.views import ConsoleView

WITHOUT_LINK = "no button reaches a robot now: stop at another console, or at the robot itself"
NUMBER = re.compile(r"\d+(\.\d+)?")


def state_lines(view: ConsoleView) -> Iterator[str]:
    """Yield the lines for the operator, the hold of the robot first."""
    own = view.own
    yield own.status
    if own.link_down_s >= 0:
        yield WITHOUT_LINK
    unsure = [robot.robot for robot in view.robots if robot.stop is not None and not robot.stop.is_confirmed]
    if unsure:
        yield f"NOT SURE that {', '.join(unsure)} stopped"
    if own.lost is not None:
        yield f"you lost {own.lost.robot}: {own.lost.why}{' (start takes it again)' if own.lost.may_retake else ''}"
    yield from (order.line for order in own.orders if order.line != own.status)
    if own.must_let_go:
        yield "let go, then press anew"
    if own.away_since_s >= 0:
        yield "you are away: press a button"
    if view.health is not None and view.health.word != "ok":
        yield f"mission {view.health.word}: {'; '.join(view.health.lines)}"
    for alarm in view.alarms:
        if alarm.is_active and not alarm.acknowledged_by:
            yield f"{alarm.severity}: {alarm.line}{f'. {alarm.remedy}' if alarm.remedy else ''}"


def news(before: Sequence[str], now: Sequence[str]) -> list[str]:
    """Return the new lines; a line in which only a number changed is not new.

    Example:
        >>> news(["waiting: starts in 4.2 s"], ["waiting: starts in 3.9 s", "let go, then press anew"])
        ['let go, then press anew']
    """
    known = {NUMBER.sub("", line) for line in before}
    return [line for line in now if NUMBER.sub("", line) not in known]
