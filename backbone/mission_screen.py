"""A mission picture as rich tables. Imported by the command line only."""

from __future__ import annotations

from collections.abc import Iterable

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from backbone.component.messages import StoryEvent
from backbone.mission_picture import MissionPicture
from backbone.naming import Subsystem, component_of
from backbone.rc_manager.messages import RequestState, RequestView, Schedule

_STATE_STYLE = {
    RequestState.RUNNING: "bold green",
    RequestState.CONNECTING: "green",
    RequestState.REVOKING: "yellow",
    RequestState.WAITING: "yellow",
    RequestState.IDLE: "dim",
}


def screen(picture: MissionPicture, events: Iterable[StoryEvent] = ()) -> RenderableType:
    """Return the whole picture: components, holders, schedule, newest events, problems."""
    parts: list[RenderableType] = [
        Text(f"mission {picture.mission}   {picture.at_s:8.1f} s", style="bold"),
        components_table(picture),
    ]
    if picture.schedule is not None:
        parts += [rcs_table(picture.schedule), requests_table(picture.schedule, picture.at_s)]
    newest = list(events)
    if newest:
        parts.append(events_table(newest))
    parts += [Text(problem, style="red") for problem in picture.problems]
    return Group(*parts)


def components_table(picture: MissionPicture) -> Table:
    """Return every component under its subsystem."""
    table = Table(title="components", title_justify="left", expand=False)
    for column in ("subsystem", "component", "type", "host", "pid", "state", "restarts", "doing"):
        table.add_column(
            column, justify="right" if column in ("pid", "restarts") else "left", no_wrap=column != "doing"
        )
    for subsystem in Subsystem:
        for number, c in enumerate(picture.of_subsystem(subsystem)):
            first = str(subsystem) if number == 0 else ""
            restarts = picture.restarts(c)
            table.add_row(
                first,
                component_of(c.address),
                c.type,
                c.host,
                str(c.pid),
                str(c.state),
                str(restarts or ""),
                c.feedback,
            )
    return table


def rcs_table(schedule: Schedule) -> Table:
    """Return who holds what now and who is next."""
    table = Table(title="resources", title_justify="left")
    for column in ("RC", "kind", "state", "holder", "epoch", "since", "next"):
        table.add_column(column, no_wrap=True)
    for rc in schedule.rcs:
        table.add_row(
            rc.rc,
            rc.kind,
            rc.state,
            ", ".join(holder.arc for holder in rc.holders) or "–",
            ", ".join(str(holder.epoch) for holder in rc.holders),
            ", ".join(f"{holder.since_s:.1f} s" for holder in rc.holders),
            ", ".join(rc.next),
        )
    return table


def requests_table(schedule: Schedule, now_s: float) -> Table:
    """Return who runs and who waits, since when, until when, and why."""
    table = Table(title="schedule", title_justify="left")
    for column in ("ARC", "state", "for", "until / expected", "turns", "priority", "why"):
        table.add_column(column, no_wrap=column != "why")
    for request in schedule.requests:
        table.add_row(
            request.arc,
            Text(str(request.state), style=_STATE_STYLE[request.state]),
            f"{now_s - request.since_s:.1f} s",
            _when(request, now_s),
            str(request.turns),
            request.priority,
            request.because,
        )
    return table


def events_table(events: list[StoryEvent]) -> Table:
    """Return the newest events, newest last."""
    table = Table(title="events", title_justify="left", show_header=False)
    for event in events:
        table.add_row(f"{event.at_s:8.2f} s", component_of(event.where), event.what)
    return table


def _when(request: RequestView, now_s: float) -> str:
    if request.state in (RequestState.RUNNING, RequestState.CONNECTING) and request.until_s >= 0:
        return f"at least {max(0.0, request.until_s - now_s):.1f} s more"
    if request.expected_start_s >= 0:
        return f"in {max(0.0, request.expected_start_s - now_s):.1f} s"
    return "not foreseeable" if request.state is RequestState.WAITING else ""
