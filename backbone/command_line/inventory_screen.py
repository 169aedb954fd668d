"""Inventory: the component types and the resources of a mission, as tables and as plain data.

Rule of this file: no bus, no clock.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from backbone.component.abilities import CommandForm, FieldForm, range_text
from backbone.component_database.messages import Multiplicity, TypeCount
from backbone.naming import Subsystem, address
from backbone.picture.mission import MissionPicture
from backbone.picture.screen import table
from backbone.scheduling.views import Period, RcUtilization, RcView
from backbone.spoken import counted, value_text
from backbone.wire import plain

NONE = "–"


def types_table(types: Iterable[TypeCount]) -> RenderableType:
    """Return every type with its limits and the number of its running components."""
    columns = ("type", "subsystem", "may run", "running", "needs", "class")
    return table("component types", columns, map(_type_row, types))


def type_tables(one: TypeCount) -> RenderableType:
    """Return one type, with its commands and reports."""
    abilities = one.component_type.abilities
    rows = [row for command in abilities.commands for row in _command_rows(command)]
    columns = ("command", "field", "kind", "unit", "range", "if left out", "meaning")
    parts: list[RenderableType] = [types_table([one])]
    parts.append(table("commands", columns, rows) if rows else Text("it obeys no commands"))
    reports = [(*_field_cells(field)[:4], field.doc) for field in abilities.reports]
    head = ("report", "kind", "unit", "range", "meaning")
    parts.append(table("reports", head, reports) if reports else Text("it reports nothing"))
    return Group(*parts)


def type_json(one: TypeCount) -> dict[str, object]:
    """Return one type as plain data."""
    kind = one.component_type
    return {
        "name": kind.name,
        "class": kind.class_path,
        "subsystem": str(kind.subsystem),
        "multiplicity": str(kind.multiplicity),
        "core": kind.core,
        "running": one.running,
        "needs": kind.needs,
        "tags": kind.tags,
        "abilities": plain(kind.abilities),
    }


def _type_row(one: TypeCount) -> tuple[str, ...]:
    kind = one.component_type
    most = "any number" if kind.multiplicity is Multiplicity.MANY and not kind.core else "1"
    needs = (of if role == of else f"{of} as {role}" for role, of in kind.needs.items())
    return (kind.name, str(kind.subsystem), most, str(one.running), ", ".join(needs), kind.class_path)


def _command_rows(command: CommandForm) -> list[tuple[str, ...]]:
    to = f" (to {', '.join(command.roles)})" if command.roles else ""
    first = (command.word, "", "", "", "", "", f"{command.doc}{to}")
    return [first, *(("", *_field_cells(field), field.doc) for field in command.fields)]


def _field_cells(field: FieldForm) -> tuple[str, str, str, str, str]:
    default = "needed" if field.is_required else value_text(field.default)
    return field.name, str(field.kind), field.unit, range_text(field), default


@dataclass(frozen=True)
class ResourceUse:
    """A resource with its place in the schedule, its host and its utilization.

    Attributes:
        host: Host of its RC; empty: its RC does not run.
        used: None: the RC manager does not count it yet.
    """

    rc: RcView
    host: str
    used: RcUtilization | None

    @property
    def periods(self) -> list[Period]:
        """The periods between re-plannings, oldest first."""
        return self.used.periods if self.used is not None else []


def resource_uses(picture: MissionPicture, used: Iterable[RcUtilization]) -> list[ResourceUse]:
    """Return the resources of a mission, in the order of its schedule."""
    of = {one.rc: one for one in used}
    hosts = {at: component.host for at, component in picture.components.items()}
    rcs = picture.schedule.rcs if picture.schedule is not None else []
    return [ResourceUse(rc, hosts.get(address(Subsystem.RESOURCE_POOL, rc.rc), ""), of.get(rc.rc)) for rc in rcs]


def resources_table(picture: MissionPicture, uses: Iterable[ResourceUse]) -> Table:
    """Return the table of the resources, with the names of people."""

    def row(one: ResourceUse) -> tuple[str, ...]:
        rc = one.rc
        holders = ", ".join(picture.people.named(holder.arc) for holder in rc.holders)
        capacity = f"{rc.capacity:.0%}" if rc.sharable else "one ARC"
        shares = ("", "") if one.used is None else (f"{one.used.minute:.1%}", f"{one.used.ten_minutes:.1%}")
        return (rc.rc, rc.kind, one.host or NONE, rc.state, capacity, *shares, holders or NONE)

    columns = ("RC", "kind", "host", "state", "capacity", "1 min", "10 min", "holder")
    return table("resources", columns, map(row, uses))


def changes_table(picture: MissionPicture, uses: Iterable[ResourceUse]) -> Table:
    """Return the shares between the re-plannings of each resource: before one in a row, after it in the next."""

    def rows(one: ResourceUse) -> list[tuple[str, ...]]:
        return [
            (
                one.rc.rc if number == 0 else "",
                f"{period.since_s:.1f} s",
                f"{max(0.0, (period.until_s if period.until_s >= 0 else picture.at_s) - period.since_s):.1f} s",
                picture.people.named(period.because),
                picture.people.named(", ".join(_shares(period)) or NONE),
            )
            for number, period in enumerate(one.periods)
        ]

    columns = ("RC", "planned again", "for", "because", "shares until the next")
    drawn = table("shares before and after each re-planning", columns, (row for one in uses for row in rows(one)))
    drawn.columns[columns.index("because")].no_wrap = False
    return drawn


def _shares(period: Period) -> Sequence[str]:
    order = sorted(period.shares.items(), key=lambda item: (-item[1], item[0]))
    return [f"{arc} {share:.1%}" for arc, share in order]


def resource_json(picture: MissionPicture, one: ResourceUse) -> dict[str, object]:
    """Return one resource as plain data; components keep their names, with the person beside them."""
    rc, people, used = one.rc, picture.people, one.used
    owners = {request.arc: request.owner for request in picture.schedule.requests} if picture.schedule else {}
    return {
        "rc": rc.rc,
        "kind": rc.kind,
        "host": one.host,
        "state": rc.state,
        "sharable": rc.sharable,
        "capacity": rc.capacity,
        "holders": [
            {
                "arc": holder.arc,
                "owner": owners.get(holder.arc, ""),
                "person": person if (person := people.person(holder.arc)) != holder.arc else "",
            }
            for holder in rc.holders
        ],
        "utilization_1_min": used.minute if used is not None else None,
        "utilization_10_min": used.ten_minutes if used is not None else None,
        "counted_since_s": used.since_s if used is not None else None,
        "periods": plain(one.periods),
    }


def counted_for(uses: Iterable[ResourceUse], now_s: float) -> str:
    """Return a remark if utilization is counted for less than ten minutes; else an empty text."""
    since_s = [one.used.since_s for one in uses if one.used is not None]
    lasts_s = now_s - min(since_s, default=now_s)
    return f"utilization is counted for {counted(round(lasts_s), 'second')} so far" if since_s and lasts_s < 600 else ""
