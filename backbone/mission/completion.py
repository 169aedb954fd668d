"""Completion of a mission: a host, the core services, and the shipped types need no declaration.

The file's own declarations take precedence: a type with the name of a shipped type replaces that type. Missions name
types by name alone, so a class of one's own under a known name exchanges the hardware.
"""

from __future__ import annotations

from backbone.creator.messages import TYPE as CREATOR
from backbone.mission.document import Attribute, Element
from backbone.mission.shipped_types import shipped_types
from backbone.mission.tables import CORE_SERVICES

THIS_HOST = {"name": "base", "address": "127.0.0.1"}


def complete(root: Element) -> None:
    """Add hosts, core services and types that the mission leaves out; their place is the begin of the mission."""
    hosts, core, types = (_section(root, tag) for tag in ("hosts", "core", "types"))
    if not hosts.children:
        hosts.children.append(_element(root, "host", THIS_HOST))
    _complete_core(root, core, [host.text("name") for host in hosts.children])
    declared = {one.text("name") for one in types.children}
    shipped = [one.placed(root.place) for one in shipped_types() if one.text("name") not in declared]
    types.children.extend(shipped)


def _complete_core(root: Element, core: Element, hosts: list[str]) -> None:
    for service in core.children:
        service.attributes.setdefault("host", Attribute(hosts[0], service.place))
    there = {(service.text("type"), service.text("host")) for service in core.children}
    for name in CORE_SERVICES:
        if name == CREATOR:
            missing = [host for host in dict.fromkeys(hosts) if (name, host) not in there]
        else:
            missing = [] if any(known == name for known, _host in there) else hosts[:1]
        core.children += [_element(root, "service", {"type": name, "host": host}) for host in missing]


def _section(root: Element, tag: str) -> Element:
    found = root.first(tag)
    if found is None:
        root.children.append(found := _element(root, tag, {}))
    return found


def _element(root: Element, tag: str, values: dict[str, str]) -> Element:
    return Element(tag, root.place, {name: Attribute(value, root.place) for name, value in values.items()})
