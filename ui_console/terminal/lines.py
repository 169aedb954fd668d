"""Views as styled lines of text, for a terminal's content except the picture.

Pure: a view and a width go in, rich texts come out. A row that ``why`` can explain has a subject.
"""

from __future__ import annotations

import io
import itertools
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from rich.console import Console
from rich.text import Text

from backbone.component.messages import ComponentState, StoryEvent
from backbone.naming import component_of
from backbone.scheduling.views import RequestView
from backbone.spoken import counted
from ui_console.model import views
from ui_console.model.timeline import Certainty, SliceView, TimelineView
from ui_console.terminal.tables import PanelName

NODE_MARKS = {
    views.NodeState.RUNNING: ("▶", "green"),
    views.NodeState.WAITING: ("…", "yellow"),
    views.NodeState.IDLE: ("·", "dim"),
    views.NodeState.SUCCESS: ("✓", "bold green"),
    views.NodeState.FAILURE: ("✗", "bold red"),
    views.NodeState.STARTING: ("○", "yellow"),
    views.NodeState.LOST: ("!", "bold red"),
}
ALARM_STYLES = {views.Severity.ALARM: "bold red", views.Severity.WARNING: "yellow", views.Severity.NOTICE: "cyan"}
BUSY_CPU = 0.8  # chosen: load from which a host is shown in yellow
NAME_COLUMNS = 10
REPORTED_S = 60.0  # chosen: a robot without a holder reports nothing, and its battery loses little in a minute
BEYOND_S = 1.0  # chosen: tolerance before a slice counts as exceeded
HANG = 2  # chosen: indentation of a row's second line
LEAST_COLUMNS = 12  # chosen: below, lines are not wrapped
HELD_ELSEWHERE = "hold to lift"  # pages use a gesture for this; a terminal uses a second key
_PAPER = Console(file=io.StringIO())  # Rich needs a console to wrap text; nothing is written to it
SLICE_MARKS = {Certainty.PAST: "▄", Certainty.NOW: "█", Certainty.NEXT: "░"}
SLICE_COLORS = ("cyan", "green", "magenta", "yellow", "blue", "bright_cyan", "bright_green", "bright_magenta")


@dataclass(frozen=True)
class Row:
    """One row of a table.

    Attributes:
        key: The same as long as the row has the same subject.
        subject: Name for ``why``; empty: no explanation.
        text: One line, or more.
        is_own: True for the operator's robot: it stays in view, and the cursor begins there.
    """

    key: str
    subject: str
    text: Text = field(compare=False)
    is_own: bool = False


def laid_out(rows: Sequence[Row], here: str | None, columns: int, room: int) -> list[list[Text]]:
    """Return the lines of each row; long rows wrap if there is room for all, else only the cursor's row wraps.

    Args:
        rows: From top to bottom.
        here: Key of the row under the cursor; None: the cursor is elsewhere.
        columns: Width of a line.
        room: Number of lines.
    """
    folded = [_folded(row.text, columns) for row in rows]
    if sum(map(len, folded)) <= room:
        return folded
    return [lines if row.key == here else _cut(row.text, columns) for row, lines in zip(rows, folded, strict=True)]


def in_view(rows: Sequence[Row], drawn: Sequence[list[Text]], here: str | None, room: int) -> list[Text]:
    """Return the lines from the first one in view; if not all fit, the operator's own row comes first.

    Args:
        rows: From top to bottom.
        drawn: The lines of each row.
        here: Key of the row under the cursor, which is in view; None: the cursor is elsewhere.
        room: Number of lines.
    """
    if sum(map(len, drawn)) <= room:
        return list(itertools.chain(*drawn))
    pinned = next((lines for row, lines in zip(rows, drawn, strict=True) if row.is_own), [])
    lines: list[Text] = []
    offset = 0
    for row, its_lines in zip(rows, drawn, strict=True):
        if its_lines is pinned:
            continue
        if row.key == here:
            offset = min(len(lines), max(0, len(lines) + len(its_lines) - (room - len(pinned))))
        lines += its_lines
    return pinned + lines[offset:]


def _folded(text: Text, columns: int) -> list[Text]:
    lines: list[Text] = []
    for line in text.split("\n", allow_blank=True):
        indent = len(line.plain) - len(line.plain.lstrip()) + HANG
        if line.cell_len <= columns or columns < indent + LEAST_COLUMNS:
            lines.append(line)
            continue
        first, *others = line.wrap(_PAPER, columns - indent)
        lines += [first, *(Text(" " * indent).append_text(other) for other in others)]
    return lines


def _cut(text: Text, columns: int) -> list[Text]:
    lines = list(text.split("\n", allow_blank=True))
    if columns >= LEAST_COLUMNS:  # there are no columns before the first layout
        for line in lines:
            line.truncate(columns, overflow="ellipsis")
    return lines


def table_rows(name: PanelName, view: views.ConsoleView, columns: int) -> list[Row]:
    """Return the rows of a table.

    Args:
        name: The table.
        view: Content of the console.
        columns: Width of the table, for drawings to scale.
    """
    now_s = view.now_s
    match name:
        case PanelName.ROBOTS:
            return robot_rows(view.robots, now_s, view.own.robot)
        case PanelName.TREE:
            return [Row(f"node:{one.name}", one.name, _node(one, now_s)) for one in view.tree]
        case PanelName.SCHEDULE:
            return [Row(f"request:{one.arc}", one.arc, _request(one, now_s)) for one in view.requests]
        case PanelName.TIMELINE:
            return _timeline_rows(view.timeline, columns)
        case PanelName.ALARMS:
            return [Row(one.key, one.subject, _alarm(one, now_s)) for one in view.alarms]
        case PanelName.LINKS:
            links = [Row(f"link:{one.name}", "", _link(one)) for one in view.links]
            return links + [Row(f"host:{one.load.host}", "", _host(one)) for one in view.hosts]
        case PanelName.PARAMETERS:
            return [Row(f"parameter:{o.component}.{o.name}", o.component, _parameter(o)) for o in view.parameters]
        case PanelName.COMPONENTS:
            return [Row(f"component:{o.address}", component_of(o.address), _component(o)) for o in view.components]
        case PanelName.LOG:
            rows = [Row(f"log:{number}", one.subject, _event(one)) for number, one in enumerate(view.log)]
            return rows[::-1]


def robot_rows(robots: list[views.RobotView], now_s: float, own: str) -> list[Row]:
    """Return two lines for each robot: its holder, the remaining time, and the next one.

    Args:
        own: The robot that the operator holds or wants.
    """
    wide = max((len(one.robot) for one in robots), default=0)
    return [Row(f"robot:{one.robot}", one.robot, _robot(one, now_s, wide), one.robot == own) for one in robots]


def lift_lines(stop: views.StopView) -> list[str]:
    """Return the lines about a stop that may be lifted: author, age, reason, and the way to lift it."""
    also = f"; since then also by {', '.join(stop.also)}" if stop.also else ""
    reason = [f"because: {stop.reason}"] if stop.reason else []
    takes = [] if stop.lift_line == HELD_ELSEWHERE else [stop.lift_line]
    return [f"set by {'you' if stop.is_mine else stop.by_user}, {stop.age_s:.0f} s ago{also}", *reason, *takes]


def _timeline_rows(timeline: TimelineView, columns: int) -> list[Row]:
    """Return one bar for each resource: filled past and present holders, shaded predicted ones; ``│`` is now."""
    people = sorted({one.who for row in timeline.rows for one in row.slices})
    colors = {who: SLICE_COLORS[number % len(SLICE_COLORS)] for number, who in enumerate(people)}
    wide = max(10, columns - NAME_COLUMNS - 1)
    rows = [
        Row(
            f"timeline:{row.rc}",
            row.rc,
            Text.assemble(
                (f"{row.rc:{NAME_COLUMNS}.{NAME_COLUMNS}s} ", "bold"), _bar(row.slices, timeline, wide, colors)
            ),
        )
        for row in timeline.rows
        if not row.is_sharable
    ]
    legend = Text("  ").join(Text.assemble(("█ ", colors[who]), who) for who in people)
    past_s, next_s = timeline.now_s - timeline.from_s, timeline.to_s - timeline.now_s
    scale = Text(f"−{past_s:.0f} s … │ now … +{next_s:.0f} s", style="dim")
    return [*rows, Row("timeline:legend", "", Text("\n").join([legend, scale]))]


def _event(event: StoryEvent) -> Text:
    return Text.assemble((f"{event.at_s:8.1f} ", "dim"), (f"{event.subject} ", "bold"), event.what)


def _robot(robot: views.RobotView, now_s: float, wide: int) -> Text:
    lines = Text.assemble((f"{robot.number} ", "dim"), (f"{robot.robot:{wide}s}  ", "bold"))
    if not robot.is_up:
        lines.append("down ", style="bold red")
    if robot.stop is not None:
        lines.append(f"STOPPED by {robot.stop.by_user}", style="bold white on red")
        lines.append(" ")
    if robot.is_mine:
        lines.append("YOU", style="bold green")
    else:
        lines.append(robot.holder or "free", style="green" if robot.holder else "dim")
    facts = list(_robot_facts(robot, now_s))
    if facts:
        lines.append(f"\n  {', '.join(facts)}", style="dim")
    return lines


def _robot_facts(robot: views.RobotView, now_s: float) -> Iterator[str]:
    """Yield further facts of a robot, the most important first, because the end is cut if there is not enough room."""
    if robot.stop is not None:
        yield robot.stop.reason or f"since {robot.stop.age_s:.0f} s"
    if robot.holder and robot.until_s >= 0:
        yield from _slice_end(robot.until_s, now_s)
    if robot.gauges and 0 <= robot.reported_age_s <= REPORTED_S:
        yield from (f"{gauge.name} {gauge.text}" for gauge in robot.gauges if gauge.is_share)
    if robot.waiting:
        yield "then " + ", ".join(robot.waiting)
    if robot.holder:
        yield f"for {max(0.0, now_s - robot.since_s):.0f} s"
        yield robot.priority.rpartition("/")[2]


def _slice_end(until_s: float, now_s: float) -> Iterator[str]:
    if until_s > now_s:
        yield f"{until_s - now_s:.1f} s left"
    elif now_s - until_s >= BEYOND_S:
        yield "beyond its slice"


def _node(node: views.NodeView, now_s: float) -> Text:
    mark, style = NODE_MARKS[node.state]
    priority = "" if node.priority is None else f":{node.priority}"
    margin = "  " * node.depth
    lines = Text.assemble(margin, (f"{mark} ", style), (node.name, "bold"), (priority, "dim"), f" {node.type} ")
    lines.append(f"{node.state} {max(0.0, now_s - node.since_s):.0f} s", style=style)
    below = node.because if node.state is views.NodeState.WAITING and node.because else node.feedback
    if below:
        lines.append(f"\n{margin}    {below}", style="dim")
    return lines


def _request(request: RequestView, now_s: float) -> Text:
    if request.state == "running":
        when = next(_slice_end(request.until_s, now_s), "running") if request.until_s >= 0 else "running"
    elif request.expected_start_s > now_s:
        when = f"in {request.expected_start_s - now_s:.1f} s"
    else:
        when = request.state
    style = "green" if request.state == "running" else "yellow" if request.state == "waiting" else "dim"
    return Text.assemble((f"{request.owner}: ", "bold"), (when, style), f"; {request.because}")


def _alarm(alarm: views.AlarmView, now_s: float) -> Text:
    style = ALARM_STYLES[alarm.severity] if not alarm.acknowledged_by else "dim"
    times = f" ×{alarm.count}" if alarm.count > 1 else ""
    since = "" if alarm.is_active else " (over)"
    age_s = max(0.0, now_s - (alarm.first_s if alarm.is_active else alarm.last_s))
    mark = "◆ " if alarm.while_away else "● " if not alarm.acknowledged_by else "○ "
    lines = Text.assemble((mark, style), (alarm.line, style), (f"{times}{since} {age_s:.0f} s ago", "dim"))
    below = [alarm.remedy, *(f"also: {one}" for one in alarm.also)] if not alarm.acknowledged_by else []
    for line in filter(None, below):
        lines.append(f"\n  {line}", style="dim")
    return lines


def _link(link: views.LinkView) -> Text:
    latency = f" {1e3 * link.latency_s:.1f} ms" if link.latency_s >= 0 else ""
    mark, style = ("up  ", "green") if link.is_up else ("DOWN", "bold red")
    return Text.assemble((f"{mark} ", style), (link.name, "bold"), latency, (f"  {link.feedback}", "dim"))


def _host(host: views.HostView) -> Text:
    load = host.load
    style = "yellow" if load.cpu >= BUSY_CPU else ""
    return Text.assemble(
        "host ",
        (load.host, "bold"),
        (f" {load.cpu:.0%} of {counted(load.cores, 'core')}", style),
        f", memory {load.memory:.0%}, {counted(load.components, 'component')}",
        (f"  {host.age_s:.0f} s ago", "dim"),
    )


def _parameter(parameter: views.ParameterView) -> Text:
    line = Text.assemble((f"{parameter.component}.{parameter.name}", "bold"), f" = {parameter.value}")
    if parameter.changed_by:
        line.append(f"  was {parameter.before}, set by {parameter.changed_by} at {parameter.changed_s:.0f} s", "dim")
    return line


def _component(component: ComponentState) -> Text:
    is_ready = component.state == "ready"
    return Text.assemble(
        ("● " if is_ready else "○ ", "green" if is_ready else "yellow"),
        (f"{component_of(component.address):22.22s} ", "bold"),
        (f"{component.host} {component.pid} ", "dim"),
        component.feedback or component.type,
    )


def _bar(slices: list[SliceView], timeline: TimelineView, columns: int, colors: dict[str, str]) -> Text:
    scale = columns / (timeline.to_s - timeline.from_s)
    cells: list[tuple[str, str]] = [(" ", "")] * columns
    for one in slices:  # past turns first, so that the present one is drawn over them
        first = int((max(one.from_s, timeline.from_s) - timeline.from_s) * scale)
        last = max(first + 1, int((min(one.to_s, timeline.to_s) - timeline.from_s) * scale))
        for column in range(max(0, first), min(columns, last)):
            cells[column] = (SLICE_MARKS[one.certainty], colors[one.who])
    now = min(columns - 1, int((timeline.now_s - timeline.from_s) * scale))
    cells[now] = ("│", "bold white")
    runs = [(mark * len(list(same)), style) for (mark, style), same in itertools.groupby(cells)]
    return Text.assemble(*runs)
