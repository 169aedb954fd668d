"""A dry run as rich tables: hosts of components, times of ARCs, and ARCs that never run with the reasons.

Imported by the command line only.
"""

from __future__ import annotations

import string
from collections.abc import Mapping, Sequence

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from backbone.dry_run.run import Claimed, DryRun, Placed
from backbone.scheduling.rehearsal import Run, Timetable

COLUMNS = 60  # chosen: one for each second of the first minute; with names they fit a terminal of 100 columns
RULER_EVERY = 10
KEYS = string.ascii_uppercase + string.ascii_lowercase
NO_KEY = "#"
RUNS, SWITCHES, WAITS, FREE = "█", "▒", "·", "·"


def screen(dry: DryRun) -> RenderableType:
    """Return the tables of a dry run, then those of its last branch."""
    tables = [_head(f"mission {dry.mission}", dry), *_tables(dry)]
    if dry.last is not None:
        tables += [_head(f"last branch {dry.last_name}, which runs at the end", dry.last), *_tables(dry.last)]
    return Group(*tables)


def _head(of: str, dry: DryRun) -> Text:
    return Text(f"{of}: dry run, {dry.timetable.end_s:g} s", style="bold")


def _tables(dry: DryRun) -> list[RenderableType]:
    keys = {claimed.arc: key for claimed, key in zip(dry.claimed, [*KEYS, *NO_KEY * len(dry.claimed)], strict=False)}
    return [_placement(dry.placed), _timeline(dry, keys), _requests(dry.claimed, keys), _resources(dry), _never(dry)]


def bars(dry: DryRun, keys: Mapping[str, str]) -> dict[str, str]:
    """Return one bar for each ARC, then for each RC; each column shows the middle of its share of the time.

    Args:
        keys: ARC → the character it is shown as in the bars of its RCs.
    """
    seen = dry.timetable
    middles_s = [(column + 0.5) * seen.end_s / COLUMNS for column in range(COLUMNS)]
    of_arcs = {
        claimed.arc: "".join(_arc_at(seen, claimed.arc, time_s) for time_s in middles_s) for claimed in dry.claimed
    }
    of_rcs = {
        rc: "".join(_rc_at([run for run in seen.runs if rc in run.uses], rc, time_s, keys) for time_s in middles_s)
        for rc in seen.utilization()
    }
    return {**of_arcs, **of_rcs}


def _arc_at(seen: Timetable, arc: str, time_s: float) -> str:
    if arc not in seen.asked_s:
        return " "
    present = [run for run in seen.of_arc(arc) if run.connect_s <= time_s < run.free_s]
    if not present:
        return WAITS
    return RUNS if _is_granted(present[0], time_s) else SWITCHES


def _rc_at(runs: Sequence[Run], rc: str, time_s: float, keys: Mapping[str, str]) -> str:
    present = [run for run in runs if run.connect_s <= time_s < run.free_s]
    granted = [run for run in present if _is_granted(run, time_s)]
    if not granted:
        return SWITCHES if present else FREE
    if granted[0].uses[rc] == 1.0 and len(granted) == 1:
        return keys.get(granted[0].arc, NO_KEY)
    return str(len(granted)) if len(granted) < 10 else "+"


def _is_granted(run: Run, time_s: float) -> bool:
    return run.grant_s is not None and run.grant_s <= time_s < run.revoke_s


def _placement(placed: Sequence[Placed]) -> Table:
    table = Table("component", "type", "host", "why there", title="where components go", title_justify="left")
    for one in placed:
        reasons = [": ".join(reason.split(": ")[:2]) for reason in one.reasons] if one.host else list(one.reasons)
        host = Text(one.host) if one.host else Text("nowhere", style="bold red")
        table.add_row(one.name, one.type, host, Text("; ".join(reasons)))
    return table


def _timeline(dry: DryRun, keys: Mapping[str, str]) -> Table:
    table = Table.grid(padding=(0, 1))
    table.title = f"who runs when ({RUNS} runs, {SWITCHES} switches, {WAITS} waits or free; digits: how many share)"
    table.title_justify = "left"
    table.add_row("", "", Text(_ruler(dry.timetable.end_s), style="dim"))
    for name, bar in bars(dry, keys).items():
        table.add_row(keys.get(name, ""), name, Text(bar, no_wrap=True))
    return table


def _ruler(end_s: float) -> str:
    marks = [f"{column * end_s / COLUMNS:g}".ljust(RULER_EVERY) for column in range(0, COLUMNS, RULER_EVERY)]
    return f"{''.join(marks)}{end_s:g} s"


def _requests(claimed: Sequence[Claimed], keys: Mapping[str, str]) -> Table:
    table = Table(
        "",
        "request",
        "priority",
        "needs",
        "turns",
        "first at s",
        "worst wait s",
        title="requests",
        title_justify="left",
    )
    for one in claimed:
        first = "-" if one.first_grant_s is None else f"{one.first_grant_s:.2f}"
        style = "red" if one.never_runs else ""
        needs = ", ".join(one.rcs) or "refused"
        row = (keys[one.arc], one.arc, one.priority, needs, str(one.turns), first, f"{one.worst_wait_s:.2f}")
        table.add_row(*row, style=style)
    return table


def _resources(dry: DryRun) -> Table:
    table = Table("resource", "utilization", title="resources", title_justify="left")
    for rc, share in dry.timetable.utilization().items():
        table.add_row(rc, f"{share:7.1%}")
    return table


def _never(dry: DryRun) -> RenderableType:
    lines = []
    for claimed in dry.claimed:
        if claimed.refused:
            lines += [Text(f"{claimed.arc} can never run: {claimed.refused}", style="bold red")]
        elif claimed.turns == 0 and claimed.why is not None:
            how = "never runs" if claimed.never_runs else f"does not run in the first {dry.timetable.end_s:g} s"
            lines += [Text(f"{claimed.arc} {how}", style="bold red" if claimed.never_runs else "yellow")]
            lines += [Text(f"  {line}") for line in claimed.why.lines]
            lines += [Text(f"  rule {claimed.why.rule}; what would change it: {claimed.why.would_change}")]
    return Group(*lines) if lines else Text("every request gets its turn" if dry.claimed else "there is no request")
