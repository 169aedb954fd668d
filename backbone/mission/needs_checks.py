"""Checks of what a component type needs of others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from backbone.mission.document import Element
from backbone.mission.report import Report, listed, quoted
from backbone.mission.tables import Tables, is_known, role_of
from backbone.naming import Subsystem, is_legal

NO_CLASS_YET = "backbone.component.component:Component"  # stands for a class that is not written yet: it does nothing


def check_replaced(component_type: Element, tables: Tables, report: Report) -> None:
    """Report a type of the file's own that has the name of shipped hardware and is none."""
    name = component_type.text("name")
    users = [
        one
        for one, shipped in tables.types.items()
        if shipped.place == tables.root.place
        and name in [*shipped.words("uses"), *(needed.text("type") for needed in shipped.all("needs"))]
    ]
    if users and not tables.is_resource_type(name):
        report.fault(
            component_type.place_of("name"),
            f"type {name} replaces the shipped hardware of this name, which {listed(users)} need, and is no hardware",
            "Give it another name",
        )


def _check_roles(needs: Sequence[Element], report: Report) -> None:
    """Report every need that repeats the role of another need."""
    first: dict[str, Element] = {}
    for needed in needs:
        role = role_of(needed)
        before = first.setdefault(role, needed)
        if role and before is not needed:
            report.fault(
                needed.place_of("role" if needed.text("role") else "type"),
                f"a second need for role {quoted(role)}; the first is in line {before.place.line}",
                'Give each a role of its own, role="…", or remove one',
            )


def check_commands(component_type: Element, tables: Tables, report: Report) -> None:
    """Report a command that an ARC passes on to a kind of RC that does not obey it."""
    facts, needs = tables.facts_of(component_type.text("name")), tables.needs(component_type.text("name"))
    for command in [] if facts is None else facts.abilities.commands:
        for role in command.roles:
            rc = tables.facts_of(needs.get(role, ""))
            obeyed = [] if rc is None else [one.word for one in rc.abilities.commands]
            if rc is not None and command.word not in obeyed:
                kind = needs[role]
                report.fault(
                    component_type.place_of("class"),
                    f"{component_type.text('name')} passes {command.word} on to its {role}, and no {kind} obeys it",
                    f"Declare it in commands of the class of {kind}, which obeys: {listed(obeyed) or 'nothing'}",
                )


def check_roles(component_type: Element, tables: Tables, report: Report) -> None:
    """Report needs that are not the roles of the class, which decides which RCs an ARC gets; only an ARC has roles."""
    name = component_type.text("name")
    facts, needs = tables.facts_of(name), tables.needs(name)
    if facts is not None and needs != facts.roles and component_type.text("class") != NO_CLASS_YET:
        written = [
            f'<needs type="{kind}"/>' if role == kind else f'<needs role="{role}" type="{kind}"/>'
            for role, kind in facts.roles.items()
        ]
        report.fault(
            component_type.place_of("class"),
            f"type {name} needs {_in_words(needs)}, and its class {_in_words(facts.roles)}",
            f"Write {''.join(written)}, or change roles of the class"
            if written
            else "Remove <needs>, or name the class of an ARC; its roles are what it needs",
        )


def _in_words(needs: Mapping[str, str]) -> str:
    return listed([kind if role == kind else f"{role} ({kind})" for role, kind in needs.items()]) or "nothing"


def check_needs(component_type: Element, tables: Tables, report: Report) -> None:
    """Report what a type needs or uses and no type of resource is."""
    needs = component_type.all("needs")
    _check_roles(needs, report)
    known = tables.resource_types()
    for needed in needs:
        is_known(needed, "type", "type of resource", known, report)
    for used in dict.fromkeys(component_type.words("uses")):
        if used not in known and is_legal(used):
            report.fault(
                component_type.place_of("uses"),
                f"no type of resource is named {quoted(used)}{report.hint(used, known)}",
                f"There is: {listed(known)}",
            )
    if component_type.words("uses") and not tables.is_resource_type(component_type.text("name")):
        report.fault(
            component_type.place_of("uses"),
            f"type {component_type.text('name')} has no resources that could use others",
            "Remove uses; an ARC says what it needs by <needs>",
        )
    if needs and component_type.text("subsystem") in set(Subsystem) - {Subsystem.RESOURCE_POOL}:
        report.fault(
            component_type.place_of("subsystem"),
            "a type with <needs> is an ARC, which belongs to the resource pool",
            'Write subsystem="resource_pool", or remove <needs>',
        )
