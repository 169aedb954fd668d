"""Whether the parameters of resources, behaviors, world and core services are those their classes have.

Pure: elements and facts in, faults out. The classes' own types judge the values, so a value that passes here is one
the component starts with.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from backbone.mission.class_facts import ClassFacts, ParameterFacts, parameters_of
from backbone.mission.document import Element
from backbone.mission.report import Report, told, told_names
from backbone.mission.tables import CORE_SERVICES, NETWORK_ID, Tables, check_unique, parameter_value
from backbone.scheduling.rules import SchedulingRules

_NAME = re.compile(r"[a-z][a-z0-9_]*")  # other names are the schema's to refuse
SERVICE_PARAMETERS = {"rc_manager": parameters_of(SchedulingRules)}
"""Core service → what the file may set of its parameters."""


def check_service_parameters(service: Element, report: Report) -> None:
    """Report parameters that the core service does not have, that come twice, or that it would refuse."""
    kind = service.text("type")
    if kind not in CORE_SERVICES:
        return
    check_unique(service.all("parameter"), "name", "parameter", report)
    known = SERVICE_PARAMETERS.get(kind, ())
    _check_given(service, kind, known, (), report, "Remove it; only the rc_manager's rules can be set")


def check_class_parameters(element: Element, reserved: Collection[str], tables: Tables, report: Report) -> None:
    """Report parameters that the element's class does not have or would refuse, and those it lacks.

    Args:
        element: A resource, a behavior or the world.
        reserved: Names that the rest of the file gives; they are judged elsewhere.
        tables: The mission.
        report: Where faults go.
    """
    kind = element.text("type")
    facts = tables.facts_of(kind)
    if facts is None:
        return
    known = facts.parameters_with(element.text("driver"))
    if known is None:
        known = facts.parameters
        _check_values(element, {one.name: one for one in known}, report)
    else:
        _check_given(element, kind, known, {*reserved}, report, "Remove it")
    given = {parameter.text("name") for parameter in element.all("parameter")}
    for one in known:
        if one.is_required and one.name not in given and one.name != NETWORK_ID:  # robots without id: see checks
            report.fault(
                element.place,
                f"{kind} {element.text('name')} lacks parameter {one.name}",
                f'Add <parameter name="{one.name}" value="…"/>: {one.meaning}',
            )


def check_type_class(component_type: Element, facts: ClassFacts | None, report: Report) -> None:
    """Report a class that cannot run a component on this machine."""
    if facts is not None and facts.failure:
        report.fault(
            component_type.place_of("class"),
            f"{component_type.text('class')}: {facts.failure}",
            "Write a component's class that this machine can import, or mend its module",
        )


def _check_given(
    element: Element,
    kind: str,
    known: Sequence[ParameterFacts],
    reserved: Collection[str],
    report: Report,
    if_none: str,
) -> None:
    by_name = {one.name: one for one in known}
    for parameter in element.all("parameter"):
        name = parameter.text("name")
        if name not in by_name and name not in reserved and _NAME.fullmatch(name):
            report.fault(
                parameter.place_of("name"),
                f"{kind} has no parameter {told(name)}{report.hint(name, by_name)}",
                f"There is: {told_names(by_name)}" if by_name else if_none,
            )
    _check_values(element, by_name, report)


def _check_values(element: Element, known: dict[str, ParameterFacts], report: Report) -> None:
    for parameter in element.all("parameter"):
        one, text = known.get(parameter.text("name")), parameter.text("value")
        if one is None or "value" not in parameter.attributes or one.name == NETWORK_ID:
            continue
        if not one.accepts(parameter_value(text)):
            hint = report.hint(text, one.words) if one.words else ""
            report.fault(
                parameter.place_of("value"), f"{one.name}={told(text)} is illegal{hint}", f"{one.name}: {one.meaning}"
            )
