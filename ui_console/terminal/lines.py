"""Views as styled lines of text; what a terminal shows besides the picture.

Pure: a view and a width in, rich texts out. A row that can be asked ``why`` names its subject.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass, field

from rich.text import Text

from ui_console.views import (
    AlarmView,
    Certainty,
    ComponentRow,
    ConsoleView,
    HealthView,
    HostView,
    LinkView,
    LogRow,
    NodeState,
    NodeView,
    ParameterView,
    RequestRow,
    RobotView,
    Severity,
    SliceView,
    TimelineView,
)

NODE_MARKS = {
    NodeState.RUNNING: ("▶", "green"),
    NodeState.WAITING: ("…", "yellow"),
    NodeState.IDLE: ("·", "dim"),
    NodeState.SUCCESS: ("✓", "bold green"),
    NodeState.FAILURE: ("✗", "bold red"),
    NodeState.STARTING: ("○", "yellow"),
    NodeState.LOST: ("!", "bold red"),
}
ALARM_STYLES = {Severity.ALARM: "bold red", Severity.WARNING: "yellow", Severity.NOTICE: "cyan"}
_HEALTH_STYLES = {"ok": "green", "degraded": "bold yellow", "failed": "bold red"}
HEALTH_COLUMNS = 60  # chosen: half a wide terminal; the alarms show the rest
BUSY_CPU = 0.8  # chosen: from here on a host's load is shown in yellow
NAME_COLUMNS = 10
SLICE_MARKS = {Certainty.PAST: "▄", Certainty.NOW: "█", Certainty.NEXT: "░"}
SLICE_COLORS = ("cyan", "green", "magenta", "yellow", "blue", "bright_cyan", "bright_green", "bright_magenta")


@dataclass(frozen=True)
class Row:
    """One row of a table.

    Attributes:
        key: Stays the same while the row is about the same thing.
        subject: Name to ask ``why`` about; empty: there is nothing to ask.
        text: One line, or more.
    """

    key: str
    subject: str
    text: Text = field(compare=False)


def robot_rows(robots: list[RobotView], now_s: float) -> list[Row]:
    """Return two lines for each robot: who has it, and for how long, who comes next."""
    return [Row(f"robot:{robot.robot}", robot.robot, _robot(robot, now_s)) for robot in robots]


def tree_rows(nodes: list[NodeView], now_s: float) -> list[Row]:
    """Return one line for each node of the behavior tree, with its feedback below it."""
    return [Row(f"node:{node.name}", node.name, _node(node, now_s)) for node in nodes]


def request_rows(requests: list[RequestRow], now_s: float) -> list[Row]:
    """Return one line for each request: who runs until when, who waits why."""
    return [Row(f"request:{request.arc}", request.arc, _request(request, now_s)) for request in requests]


def alarm_rows(alarms: list[AlarmView], now_s: float) -> list[Row]:
    """Return one line for each alarm, with its remedy below it."""
    return [Row(alarm.key, alarm.subject, _alarm(alarm, now_s)) for alarm in alarms]


def link_rows(links: list[LinkView], hosts: list[HostView]) -> list[Row]:
    """Return one line for each link and each host."""
    rows = [Row(f"link:{link.name}", "", _link(link)) for link in links]
    return rows + [Row(f"host:{host.host}", "", _host(host)) for host in hosts]


def parameter_rows(parameters: list[ParameterView]) -> list[Row]:
    """Return one line for each parameter that was asked for."""
    return [
        Row(f"parameter:{parameter.component}.{parameter.name}", parameter.component, _parameter(parameter))
        for parameter in parameters
    ]


def component_rows(components: list[ComponentRow]) -> list[Row]:
    """Return one line for each component."""
    return [Row(f"component:{component.address}", component.name, _component(component)) for component in components]


def log_rows(log: list[LogRow]) -> list[Row]:
    """Return one line for each thing that happened, newest first."""
    return [
        Row(
            f"log:{number}",
            row.subject,
            Text.assemble((f"{row.at_s:8.1f} ", "dim"), (f"{row.subject} ", "bold"), row.what),
        )
        for number, row in reversed(list(enumerate(log)))
    ]


def timeline_rows(timeline: TimelineView, columns: int) -> list[Row]:
    """Return one bar for each resource: filled who had it and has it, shaded who comes next; ``│`` is now."""
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


def status_text(view: ConsoleView, speed_rad_s: float | None, hint: str) -> Text:
    """Return the line at the top: whether the robot is held, what its picture is worth, what keys will do."""
    own = view.own
    style = "bold white on red" if own.stop else "bold black on green" if own.is_held else "bold"
    parts = [Text(f" {own.status} ", style=style)]
    if view.health is not None:
        parts.append(_health(view.health))
    if hint:
        parts.append(Text(hint, style="bold yellow"))
    unseen = [alarm for alarm in view.alarms if not alarm.acknowledged_by]
    if unseen:
        worst = ALARM_STYLES[unseen[0].severity]
        away = sum(alarm.while_away for alarm in unseen)
        parts.append(Text(f"{len(unseen)} alarms{f', {away} while you were away' if away else ''}", style=worst))
    if own.taken_because and not own.is_held:
        parts.append(Text(f"taken: {own.taken_because}", style="yellow"))
    if speed_rad_s is not None:
        parts.append(Text(f"speed {speed_rad_s:g} rad/s"))
        parts += [
            _video(video.age_s, video.rate_hz, video.is_stale) for video in view.videos if video.robot == own.robot
        ]
    return Text(" · ").join(parts)


def _health(health: HealthView) -> Text:
    first = f": {health.lines[0]}" if health.lines else ""
    cut = f"{first[: HEALTH_COLUMNS - 1]}…" if len(first) > HEALTH_COLUMNS else first
    return Text(f"mission {health.word}{cut}", style=_HEALTH_STYLES[health.word])


def _video(age_s: float, rate_hz: float, is_stale: bool) -> Text:
    style = "bold red" if is_stale else "yellow" if age_s > 0.25 else ""
    return Text(f"picture {age_s:.1f} s old, {rate_hz:.0f}/s", style=style)


def _robot(robot: RobotView, now_s: float) -> Text:
    lines = Text.assemble((f"{robot.number} ", "dim"), (f"{robot.robot:{NAME_COLUMNS}s} ", "bold"))
    if not robot.is_up:
        lines.append("down ", style="bold red")
    if robot.stop is not None:
        lines.append(f"STOPPED by {robot.stop.by} ", style="bold white on red")
    if robot.is_mine:
        lines.append(f"YOU ({robot.holder})", style="bold green")
    else:
        lines.append(robot.holder or "free", style="green" if robot.holder else "dim")
    facts = []
    if robot.holder:
        facts.append(f"for {max(0.0, now_s - robot.since_s):.0f} s")
        if robot.until_s > now_s:
            facts.append(f"{robot.until_s - now_s:.1f} s left")
        facts.append(f"{robot.priority.rpartition('/')[2]}")
        facts.append(f"lease {robot.lease_age_s:.1f} s")
    if robot.waiting:
        facts.append("then " + ", ".join(waiting.who for waiting in robot.waiting))
    if facts:
        lines.append(f"\n  {', '.join(facts)}", style="dim")
    return lines


def _node(node: NodeView, now_s: float) -> Text:
    mark, style = NODE_MARKS[node.state]
    priority = "" if node.priority is None else f":{node.priority}"
    margin = "  " * node.depth
    lines = Text.assemble(margin, (f"{mark} ", style), (node.name, "bold"), (priority, "dim"), f" {node.type} ")
    lines.append(f"{node.state} {max(0.0, now_s - node.since_s):.0f} s", style=style)
    below = node.because if node.state is NodeState.WAITING and node.because else node.feedback
    if below:
        lines.append(f"\n{margin}    {below}", style="dim")
    return lines


def _request(request: RequestRow, now_s: float) -> Text:
    if request.state == "running":
        when = f"{max(0.0, request.until_s - now_s):4.1f} s left" if request.until_s >= 0 else "running"
    elif request.expected_start_s >= 0:
        when = f"in {max(0.0, request.expected_start_s - now_s):4.1f} s"
    else:
        when = request.state
    style = "green" if request.state == "running" else "yellow" if request.state == "waiting" else "dim"
    return Text.assemble((f"{request.who}: ", "bold"), (when, style), f"; {request.because}")


def _alarm(alarm: AlarmView, now_s: float) -> Text:
    style = ALARM_STYLES[alarm.severity] if not alarm.acknowledged_by else "dim"
    times = f" ×{alarm.count}" if alarm.count > 1 else ""
    since = "" if alarm.is_active else " (over)"
    age_s = max(0.0, now_s - (alarm.first_s if alarm.is_active else alarm.last_s))
    mark = "◆ " if alarm.while_away else "● " if not alarm.acknowledged_by else "○ "
    lines = Text.assemble((mark, style), (alarm.line, style), (f"{times}{since} {age_s:.0f} s ago", "dim"))
    if alarm.remedy and not alarm.acknowledged_by:
        lines.append(f"\n  {alarm.remedy}", style="dim")
    return lines


def _link(link: LinkView) -> Text:
    latency = f" {1e3 * link.latency_s:.1f} ms" if link.latency_s >= 0 else ""
    mark, style = ("up  ", "green") if link.is_up else ("DOWN", "bold red")
    return Text.assemble((f"{mark} ", style), (link.name, "bold"), latency, (f"  {link.feedback}", "dim"))


def _host(host: HostView) -> Text:
    style = "yellow" if host.cpu >= BUSY_CPU else ""
    return Text.assemble(
        "host ",
        (host.host, "bold"),
        (f" {host.cpu:4.0%} of {host.cores} cores", style),
        f", memory {host.memory:.0%}, {host.components} components",
        (f"  {host.age_s:.0f} s ago", "dim"),
    )


def _parameter(parameter: ParameterView) -> Text:
    line = Text.assemble((f"{parameter.component}.{parameter.name}", "bold"), f" = {parameter.value}")
    if parameter.changed_by:
        line.append(f"  was {parameter.before}, set by {parameter.changed_by} at {parameter.changed_s:.0f} s", "dim")
    return line


def _component(component: ComponentRow) -> Text:
    is_ready = component.state == "ready"
    return Text.assemble(
        ("● " if is_ready else "○ ", "green" if is_ready else "yellow"),
        (f"{component.name:22.22s} ", "bold"),
        (f"{component.host} {component.pid} ", "dim"),
        component.feedback or component.type,
    )


def _bar(slices: list[SliceView], timeline: TimelineView, columns: int, colors: dict[str, str]) -> Text:
    scale = columns / (timeline.to_s - timeline.from_s)
    cells: list[tuple[str, str]] = [(" ", "")] * columns
    for one in slices:  # past ones first, so that what is now is drawn over the rest of them
        first = int((max(one.from_s, timeline.from_s) - timeline.from_s) * scale)
        last = max(first + 1, int((min(one.to_s, timeline.to_s) - timeline.from_s) * scale))
        for column in range(max(0, first), min(columns, last)):
            cells[column] = (SLICE_MARKS[one.certainty], colors[one.who])
    now = min(columns - 1, int((timeline.now_s - timeline.from_s) * scale))
    cells[now] = ("│", "bold white")
    runs = [(mark * len(list(same)), style) for (mark, style), same in itertools.groupby(cells)]
    return Text.assemble(*runs)
