"""Checks that the parameters of resources, behaviors, world and core services are those of their classes.

Pure: elements and facts in, faults out. The classes' own types check the values, so the component can start with every
value that passes here.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

from backbone.mission.class_facts import PLANNER, ClassFacts, ParameterFacts, Question, parameters_of
from backbone.mission.class_paths import CLASS_PATH, class_path_fault, class_path_remedy
from backbone.mission.document import Element
from backbone.mission.report import Report, listed, quoted
from backbone.mission.tables import (
    CORE_SERVICES,
    NETWORK_ID,
    Tables,
    check_unique,
    parameter_value,
    parameters,
    section,
)
from backbone.naming import is_legal
from backbone.scheduling.rules import SchedulingRules, aging_fault, rule_fault

_NAME = re.compile(r"[a-z][a-z0-9_]*")  # the schema refuses other names
AGING = "aging_s"
"""The rc_manager's parameter for aging."""
SERVICE_PARAMETERS = {"rc_manager": parameters_of(SchedulingRules)}
"""Core service → parameters that the file may set."""


def check_service_parameters(service: Element, tables: Tables, report: Report) -> None:
    """Report parameters that the core service does not have, that occur twice, or that it would refuse."""
    kind = service.text("type")
    if kind not in CORE_SERVICES:
        return
    check_unique(service.all("parameter"), "name", "parameter", report)
    known = SERVICE_PARAMETERS.get(kind, ())
    _check_given(service, kind, known, (), report, "Remove it; only the rc_manager's rules can be set")
    rules = {one.name: one for one in known}
    for parameter in service.all("parameter"):
        one, value = rules.get(parameter.text("name")), parameter_value(parameter.text("value"))
        if one is not None and one.accepts(value) and (fault := rule_fault(one.name, value)):
            report.fault(parameter.place_of("value"), fault, f"{one.name}: {one.meaning}")
        elif one is not None and one.name == AGING:
            _check_aging(parameter, tables, report)
        if parameter.text("name") == PLANNER and CLASS_PATH.fullmatch(parameter.text("value")):
            facts = tables.classes.get(tables.planned(service))
            if check_class_path(parameter, "value", report) and facts is not None and facts.failure:
                report.fault(parameter.place_of("value"), facts.failure, "Mend the planner's class")


def _check_aging(parameter: Element, tables: Tables, report: Report) -> None:
    """Report ARCs that would rise while a resource is handed over, and override each other before a grant."""
    aging_s = parameter_value(parameter.text("value"))
    if isinstance(aging_s, bool) or not isinstance(aging_s, int | float):
        return
    handed_over_s = {
        resource.text("name"): (resource.number("connect-s") or 0.0) + (resource.number("disconnect-s") or 0.0)
        for resource in section(tables.root, "resources")
    }
    if fault := aging_fault(aging_s, handed_over_s):
        longest_s = max(handed_over_s.values())
        report.fault(parameter.place_of("value"), fault, f"Write at least {longest_s:g}, or 0 (never)")


def check_class_parameters(element: Element, reserved: Collection[str], tables: Tables, report: Report) -> None:
    """Report parameters that the element's class does not have or would refuse, and required ones that are missing.

    Args:
        element: A resource, a behavior or the world.
        reserved: Names that other parts of the file set; they are checked elsewhere.
    """
    kind = element.text("type")
    facts = tables.facts_with_driver(element)
    if facts is None or facts.failure:
        return
    known = facts.parameters_with(tables.driver_of(element))
    if known is None:
        known = facts.parameters
        _check_values(element, {one.name: one for one in known}, report)
    else:
        _check_given(element, kind, known, reserved, report, "Remove it")
    given = {parameter.text("name") for parameter in element.all("parameter")}
    for one in known:
        if one.is_required and one.name not in given:
            if one.name == NETWORK_ID and any(element is robot for robot in tables.robots()):
                continue  # missing network ids of robots are reported together elsewhere
            report.fault(
                element.place,
                f"{kind} {element.text('name')} lacks parameter {one.name}",
                f'Add <parameter name="{one.name}" value="…"/>: {one.meaning}',
            )


def open_questions(tables: Tables) -> list[tuple[Element, Question]]:
    """Return the elements whose parameters are legal one by one, and whose class must check them together."""
    resources = section(tables.root, "resources")
    found = []
    for element in [*resources, *tables.behaviors]:
        facts = tables.facts_of(element.text("type"))
        given = parameters(element)
        if facts is None or not facts.has_rules or not given:
            continue
        known = facts.parameters_with(tables.driver_of(element)) or facts.parameters
        if all(one.accepts(given[one.name]) if one.name in given else not one.is_required for one in known):
            found.append((element, Question(tables.types[element.text("type")].text("class"), given)))
    return found


def report_refusal(element: Element, refusal: str, tables: Tables, report: Report) -> None:
    """Report a class's objection to the parameters of an element, at the parameter that it names."""
    given = element.all("parameter")
    named = (one for one in given if re.search(rf"\b{re.escape(one.text('name'))}\b", refusal))
    quoted = (one for one in given if any(repr(word) in refusal for word in (one.text("value"), *one.words("value"))))
    about = next(named, None) or next(quoted, None)
    facts = tables.facts_of(element.text("type"))
    meanings = {} if facts is None else {one.name: one.meaning for one in facts.parameters}
    name = "" if about is None else about.text("name")
    report.fault(
        element.place if about is None else about.place_of("value"),
        f"{element.text('type')} {element.text('name')} refuses its parameters: {refusal}",
        f"{name}: {meanings[name]}" if name in meanings else "Write what its class can start with",
    )


def check_class_path(element: Element, attribute: str, report: Report) -> bool:
    """Return whether the class path in this attribute leads to a class on this machine; report it if not."""
    class_path = element.text(attribute)
    wrong = class_path_fault(class_path)
    if wrong is None:
        return True
    message, there = wrong
    name = message.rpartition(" ")[2] if message.startswith("no module") else class_path.rpartition(":")[2]
    report.fault(
        element.place_of(attribute),
        f"{class_path}: {message}{report.hint(name.rpartition('.')[2], there)}",
        class_path_remedy(class_path, message),
    )
    return False


def check_type_class(component_type: Element, facts: ClassFacts | None, report: Report) -> None:
    """Report a class that cannot run a component on this machine."""
    if facts is not None and facts.failure:
        report.fault(
            component_type.place_of("class"),
            f"{component_type.text('class')}: {facts.failure}",
            "Write a component's class that this machine can import, or mend its module",
        )


def check_driver(resource: Element, tables: Tables, report: Report) -> None:
    """Report a driver that does not exist or cannot work, as far as this machine knows its class."""
    facts, driver = tables.facts_of(resource.text("type")), tables.driver_of(resource)
    if facts is None or facts.options is None:
        return
    named = (one for one in resource.all("parameter") if one.text("name") == facts.driver_field and one.text("value"))
    given = next(named, resource)
    attribute = "driver" if given is resource else "value"
    if CLASS_PATH.fullmatch(driver):
        if not tables.is_only_here or not check_class_path(given, attribute, report):
            return
        with_driver = tables.classes.get(tables.driven(resource))
        if with_driver is not None and with_driver.failure:
            what = f"{resource.text('name')} cannot use this driver: {with_driver.failure}"
            report.fault(
                given.place_of(attribute), what, "Name a driver with the methods of its kind, or mend its module"
            )
        return
    by_class = any(one.name == facts.driver_field and one.schema.get("default") for one in facts.parameters)
    is_unused = given is resource and (by_class or not is_legal(driver))  # the schema refuses an illegal name
    if driver not in facts.options and not is_unused:
        is_parameter = given is resource and facts.driver_field != "driver"
        how = f'<parameter name="{facts.driver_field}" value="package.module:Class"/>'
        report.fault(
            given.place_of(attribute),
            f"{resource.text('type')} has no driver {quoted(driver)}{report.hint(driver, facts.options)}",
            (f"Add {how}" if is_parameter else "Write a driver's class as package.module:Class")
            + f"; built in: {listed(facts.options) or 'none'}",
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
                f"{kind} has no parameter {quoted(name)}{report.hint(name, by_name)}",
                f"There is: {listed(by_name)}" if by_name else if_none,
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
                parameter.place_of("value"), f"{one.name}={quoted(text)} is illegal{hint}", f"{one.name}: {one.meaning}"
            )
