"""Consistency checks of components that share a process."""

from __future__ import annotations

from collections.abc import Collection

from backbone.mission.document import Element
from backbone.mission.report import Report, listed, quoted
from backbone.mission.tables import Tables, host_tags_lacking, section
from backbone.naming import is_legal

PROCESS = "process"


def check_processes(tables: Tables, core: Collection[str], report: Report) -> None:
    """Report a process that would be on two hosts or on none, or that has the name of a component.

    Args:
        core: Names of the components that every mission has.
    """
    components = [*section(tables.root, "resources"), *tables.units, *tables.behaviors]
    if tables.world is not None:
        components.append(tables.world)
    components.sort(key=lambda component: component.place)
    members: dict[str, list[Element]] = {}
    for component in components:
        if is_legal(component.text(PROCESS)):
            members.setdefault(component.text(PROCESS), []).append(component)
    named = {component.text("name"): component for component in reversed(components)}
    for process, those in members.items():
        if process in core or process in named:
            whose = (
                "a core service" if process in core else f"the {named[process].tag} in line {named[process].place.line}"
            )
            report.fault(
                those[0].place_of(PROCESS),
                f"process {quoted(process)} has the name of {whose}",
                "Choose another name for the process",
            )
        if _are_on_one_host(process, those, tables, report):
            _check_tags(process, those, tables, report)


def _are_on_one_host(process: str, members: list[Element], tables: Tables, report: Report) -> bool:
    fixed = [member for member in members if member.text("host") in tables.hosts]
    others = [member for member in fixed if member.text("host") != fixed[0].text("host")]
    for member in others:
        report.fault(
            member.place_of("host"),
            f"process {process} is on host {fixed[0].text('host')} since line {fixed[0].place.line}, "
            f"so {member.text('name')} cannot be on {member.text('host')}",
            "Write the same host, leave it out, or name another process",
        )
    return not others


def _check_tags(process: str, members: list[Element], tables: Tables, report: Report) -> None:
    """Report a process if each member finds a host, but no host suits all members."""
    types = {name: tables.types[name] for member in members if (name := member.text("type")) in tables.types}
    fixed = {member.text("host") for member in members} & tables.hosts.keys()
    hosts = {name: host for name, host in tables.hosts.items() if not fixed or name in fixed}
    if not hosts or any(all(host_tags_lacking(h, t) for h in tables.hosts.values()) for t in types.values()):
        return
    lacking = {
        name: sorted({tag for component_type in types.values() for tag in host_tags_lacking(host, component_type)})
        for name, host in hosts.items()
    }
    told_already = any(
        member.text("host") in hosts
        and member.text("type") in types
        and host_tags_lacking(hosts[member.text("host")], types[member.text("type")])
        for member in members
    )
    if all(lacking.values()) and not told_already:
        reasons = "; ".join(f"{name} lacks {', '.join(tags)}" for name, tags in lacking.items())
        report.fault(
            members[0].place_of(PROCESS),
            f"no host can run all of process {process} ({listed([m.text('name') for m in members])}): {reasons}",
            "Give a host all these tags, or put the components that need them into another process",
        )
