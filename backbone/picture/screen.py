"""A mission picture as rich tables: ``screen`` whole, for paper; ``live_screen`` fitted to a terminal.

Imported by the command line only.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence

from rich.console import Group, RenderableType
from rich.panel import Panel
from rich.table import Table
from rich.text import Text

from backbone.component.messages import ComponentState, LifeState, StoryEvent
from backbone.naming import Subsystem, component_of, reading_order
from backbone.picture.fitted_table import FittedTable
from backbone.picture.health import HealthWord
from backbone.picture.mission import MissionPicture
from backbone.scheduling.requests import RequestState
from backbone.scheduling.views import RcView, RequestView, Schedule
from backbone.spoken import counted

_STATE_STYLE = {
    RequestState.RUNNING: "bold green",
    RequestState.CONNECTING: "green",
    RequestState.REVOKING: "yellow",
    RequestState.WAITING: "yellow",
    RequestState.IDLE: "dim",
}


_HEALTH_STYLE = {
    HealthWord.OK: "bold green",
    HealthWord.STARTING: "bold cyan",
    HealthWord.DEGRADED: "bold yellow",
    HealthWord.FAILED: "bold red",
}
_TROUBLES_SHARE = 4  # chosen: a quarter of the terminal; the rest still shows components and events
_FRAME_LINES = 2  # a panel's upper and lower edge
_EVENTS_MOST = 12  # chosen: more events would leave too few lines for components
_EVENTS_LEAST = 3
_NUMBERS = ("pid", "restarts", "running", "1 min", "10 min")
_NEXT_MOST = 3  # chosen: the schedule shows the further ones


def live_screen(picture: MissionPicture, events: Iterable[StoryEvent] | None, height: int) -> RenderableType:
    """Return the picture fitted to a terminal: one line a component left, holders and schedule right, events below.

    On a terminal of 120 × 40 a mission of 26 components fits; on a smaller one components are left out first.

    Args:
        events: Newest last; the newest are shown as far as there is room. None: the caller has no events.
        height: Lines of the terminal.
    """
    head = _head(picture)
    head.append(f"   {_how_many(picture)}", style="not bold")
    problems = _troubles(picture)
    if len(problems) > (most := max(1, height // _TROUBLES_SHARE)):
        problems = [*problems[: most - 1], Text(f"… and {len(problems) - most + 1} more: see status", style="red")]
    components = _component_lines(picture)
    right: list[RenderableType] = []
    right_lines = 0
    if (schedule := picture.people.named_all(picture.schedule)) is not None:
        resources, requests = _holder_lines(schedule), _request_lines(schedule, picture.at_s)
        right = [_panel("resources", resources), _panel("schedule", requests)]
        right_lines = len(resources) + len(requests) + 2 * _FRAME_LINES
    left_lines = len(components) + _FRAME_LINES
    free = height - 1 - len(problems) - max(left_lines, right_lines) - _FRAME_LINES
    newest = list(events or ())[-min(_EVENTS_MOST, max(_EVENTS_LEAST, free)) :]
    shown = [_event_line(event) for event in newest] or [Text("nothing yet", style="dim")]
    foot = [] if events is None else [_panel("events", shown)]
    room = height - 1 - len(problems) - _FRAME_LINES - len(foot) * (len(shown) + _FRAME_LINES)
    if len(components) > room:
        hidden = len(components) - max(1, room - 1)
        components = [*components[: max(1, room - 1)], Text(f"… and {hidden} lines more: a taller terminal shows them")]
    body = Table.grid(expand=True)
    body.add_column(ratio=1)
    body.add_column(ratio=1)
    body.add_row(_panel("components", components), Group(*right))
    return Group(head, *problems, body, *foot)


def _head(picture: MissionPicture) -> Text:
    word = picture.health.word
    head = Text(f"mission {picture.mission}  {picture.at_s:8.1f} s   ", style="bold", no_wrap=True)
    head.append(f"health {word}", style=_HEALTH_STYLE[word])
    if picture.stale_since_s is not None:
        head.append(f"   OLD PICTURE, of {picture.stale_since_s:.1f} s", style="bold red")
    return head


def _troubles(picture: MissionPicture) -> list[Text]:
    """Return the absences, the stops in force, and the gaps of the picture, one line each."""
    style = _HEALTH_STYLE[picture.health.word]
    lines = [Text(picture.people.named(line), style=style) for line in picture.health.lines(picture.at_s)]
    lines += [Text(line, style="bold red") for line in picture.stop_lines()]
    lines += [Text(line, style="red") for line in picture.remarks()]
    for line in lines:
        line.no_wrap, line.overflow = True, "ellipsis"
    return lines


def _how_many(picture: MissionPicture) -> str:
    states = [component.state for component in picture.components.values()]
    ready = states.count(LifeState.READY)
    restarts = sum(picture.restarts(component) for component in picture.components.values())
    return f"{ready} of {len(states)} components ready" + (f", {counted(restarts, 'restart')}" if restarts else "")


def _panel(title: str, lines: list[Text]) -> Panel:
    for line in lines:
        line.no_wrap, line.overflow = True, "ellipsis"
    return Panel(Group(*lines), title=title, title_align="left", border_style="blue", padding=(0, 1))


def _component_lines(picture: MissionPicture) -> list[Text]:
    people, lines = picture.people, list[Text]()
    for subsystem in Subsystem:
        members = picture.of_subsystem(subsystem)
        if members:
            lines.append(Text(str(subsystem), style="bold cyan"))
        lines += [_component_line(picture, component, people.doing(component)) for component in members]
    return lines


def _component_line(picture: MissionPicture, component: ComponentState, doing: str) -> Text:
    is_ready = component.state is LifeState.READY
    line = Text.assemble(
        ("● " if is_ready else "○ ", "green" if is_ready else "yellow"),
        f"{component_of(component.address):21.21s}",
        (f"{component.pid:8d}  ", "dim"),
    )
    if not is_ready:
        line.append(f"{component.state} ", style="yellow")
    if restarts := picture.restarts(component):
        line.append(f"restarted {restarts}× ", style="yellow")
    line.append(doing or component.type, style="" if doing else "dim")
    return line


def _holder_lines(schedule: Schedule) -> list[Text]:
    lines = []
    for rc in _in_order(schedule):
        line = Text(f"{rc.rc:10.10s} ")
        if rc.holders:
            holders = ", ".join(f"{holder.arc} #{holder.epoch}" for holder in rc.holders)
            line.append(holders, style="green")
        else:
            line.append("free" if rc.state != "down" else rc.state, style="dim" if rc.state != "down" else "red")
        if rc.next:
            line.append(f"  then {', '.join(rc.next)}", style="dim")
        lines.append(line)
    return lines


def _request_lines(schedule: Schedule, now_s: float) -> list[Text]:
    lines = []
    for request in schedule.requests:
        line = Text(f"{request.arc:22.22s} ")
        line.append(str(request.state), style=_STATE_STYLE[request.state])
        when = _when(request, now_s)
        why = f"for {', '.join(request.blockers)}, " if request.blockers else ""
        why += f"{counted(request.turns, 'turn')} so far, {request.priority}{_risen(request)}"
        lines += [line, Text.assemble("  ", f"{when}, " if when else "", (why, "dim"))]
    return lines or [Text("no ARC has a request", style="dim")]


def _event_line(event: StoryEvent) -> Text:
    style = "bold yellow" if "motion" in event.what else ""
    return Text.assemble((f"{event.at_s:8.2f} s  ", "dim"), f"{event.subject:22.22s} ", (event.what, style))


def summary(picture: MissionPicture) -> RenderableType:
    """Return the health, with absences and stops in force."""
    troubles = _troubles(picture)
    for line in troubles:
        line.no_wrap = False
    return Group(_head(picture), *troubles)


def screen(picture: MissionPicture) -> RenderableType:
    """Return the whole picture: health and absences first, then components, holders, schedule."""
    parts = [summary(picture)]
    if picture.components:
        parts.append(_components_table(picture))
    if (schedule := picture.people.named_all(picture.schedule)) is not None:
        parts += [_rcs_table(schedule), _requests_table(schedule, picture.at_s)]
    return Group(*parts)


def table(title: str, columns: Sequence[str], rows: Iterable[Sequence[str | Text]]) -> FittedTable:
    """Return a table in which only the last column wraps; a narrow terminal shows its rows as text."""
    drawn = FittedTable(title=title, title_justify="left")
    for column in columns:
        drawn.add_column(column, justify="right" if column in _NUMBERS else "left", no_wrap=column != columns[-1])
    for row in rows:
        drawn.add_row(*row)
    return drawn


def _components_table(picture: MissionPicture) -> FittedTable:
    """Return every component under its subsystem."""

    def row(first: str, one: ComponentState) -> tuple[str, ...]:
        restarts = str(picture.restarts(one) or "")
        does = picture.people.doing(one)
        return first, component_of(one.address), one.type, one.host, str(one.pid), str(one.state), restarts, does

    rows = (
        row(str(subsystem) if number == 0 else "", one)
        for subsystem in Subsystem
        for number, one in enumerate(picture.of_subsystem(subsystem))
    )
    return table("components", ("subsystem", "component", "type", "host", "pid", "state", "restarts", "doing"), rows)


def _rcs_table(schedule: Schedule) -> FittedTable:
    """Return the table of the RCs with their present and next holders."""

    def row(rc: RcView) -> tuple[str, ...]:
        until = (f"{until_s:.1f} s" if until_s >= 0 else "being freed" for until_s in rc.until_s)
        return (
            *(rc.rc, rc.kind, rc.state, ", ".join(holder.arc for holder in rc.holders) or "–"),
            ", ".join(str(holder.epoch) for holder in rc.holders),
            ", ".join(f"{holder.since_s:.1f} s" for holder in rc.holders),
            ", ".join(until),
            ", ".join(_coming(rc)),
        )

    columns = ("RC", "kind", "state", "holder", "epoch", "since", "until", "next")
    return table("resources", columns, map(row, _in_order(schedule)))


def _in_order(schedule: Schedule) -> list[RcView]:
    return sorted(schedule.rcs, key=lambda rc: reading_order(rc.rc))


def _coming(rc: RcView) -> list[str]:
    """Return the next holders of the RC with their times, and the number of further ones."""
    timed = zip(rc.next, rc.next_s, strict=False)
    first = [f"{arc} at {start_s:.1f} s" for arc, start_s in itertools.islice(timed, _NEXT_MOST)] or rc.next[
        :_NEXT_MOST
    ]
    return [*first, f"{len(rc.next) - len(first)} more"] if len(rc.next) > len(first) else first


def _requests_table(schedule: Schedule, now_s: float) -> FittedTable:
    """Return the table of the requests: state, times, reasons."""

    def row(one: RequestView) -> tuple[str | Text, ...]:
        state, lasts = Text(str(one.state), style=_STATE_STYLE[one.state]), f"{now_s - one.since_s:.1f} s"
        return one.arc, state, lasts, _when(one, now_s), str(one.turns), one.priority + _risen(one), _reason(one)

    columns = ("ARC", "state", "for", "until / expected", "turns", "priority", "why")
    return table("schedule", columns, (row(request) for request in schedule.requests))


def _risen(request: RequestView) -> str:
    return f" (risen by {request.raised})" if request.raised else ""


def _reason(request: RequestView) -> str:
    """Return the reason with its rule; without a predicted start also the event that would end the wait."""
    reason = f"{request.because} (rule {request.rule})" if request.rule else request.because
    starves = request.state is RequestState.WAITING and request.expected_start_s < 0
    return f"{reason}; until {request.would_change}" if starves and request.would_change else reason


def _when(request: RequestView, now_s: float) -> str:
    if request.state in (RequestState.RUNNING, RequestState.CONNECTING) and request.until_s >= 0:
        return f"at least {max(0.0, request.until_s - now_s):.1f} s more"
    if request.expected_start_s >= 0:
        return f"in {max(0.0, request.expected_start_s - now_s):.1f} s"
    return "not foreseeable" if request.state is RequestState.WAITING else ""
