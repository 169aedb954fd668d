"""Checks of parameters that name others: components, bodies, units, and the readings of a resource.

Pure: elements and facts in, faults out. A class without known facts is not checked.
"""

from __future__ import annotations

from collections.abc import Mapping

from backbone.component.abilities import FieldForm, ValueKind
from backbone.creator.messages import creator_name
from backbone.mission.behavior_reports import BehaviorStatus
from backbone.mission.class_facts import shipped_classes
from backbone.mission.document import Element
from backbone.mission.report import Report, listed, quoted
from backbone.mission.tables import CORE_SERVICES, Tables, parameter_value
from backbone.naming import Subsystem, is_component, is_legal

CONDITION = "mission_control.behaviors.condition:MessageCondition"
"""Class of the behaviors that check conditions on messages."""
READINGS = "Readings"
"""Value of their parameter ``message`` for conditions on measurements of an RC."""
VALUES = "values."
"""Prefix of a report's name in their parameter ``field``."""
PROGRESS, STATUS = "BehaviorState", "status"
"""Values of their parameters ``message`` and ``field`` for conditions on the progress of a behavior."""
ALWAYS_THERE = ("", "at_s", "rc")
"""Fields of all readings; the first stands for no field."""


def check_readings(behavior: Element, tables: Tables, report: Report) -> None:
    """Report a condition on readings of an unknown resource, or on a value that the resource does not report."""
    kind = tables.types.get(behavior.text("type"))
    given = {one.text("name"): one for one in behavior.all("parameter")}
    if kind is None or kind.text("class") != CONDITION or _text(given, "message") != READINGS:
        return
    name = _text(given, "source").removeprefix(f"{Subsystem.RESOURCE_POOL}/")
    if not is_legal(name):
        return  # the condition itself refuses it
    if name not in tables.resources:
        report.fault(
            given["source"].place_of("value"),
            f"no resource is named {quoted(name)}{report.hint(name, tables.resources)}",
            f"There is: {listed(tables.resources) or 'none'}",
        )
        return
    facts = tables.facts_of(tables.resources[name].text("type"))
    if facts is None:
        return
    forms = {f"{VALUES}{form.name}": form for form in facts.abilities.reports}
    if not forms:
        report.fault(
            given["source"].place_of("value"), f"{name} has no readings", "Name a resource that reports values"
        )
        return
    field = _text(given, "field")
    if field in forms:
        _check_limits(given, name, forms[field], report)
    elif field not in ALWAYS_THERE:
        near = field if field.startswith(VALUES) else f"{VALUES}{field}"
        report.fault(
            given["field"].place_of("value"),
            f"readings of {name} have no {quoted(field)}{report.hint(near, forms)}",
            f"There is: {listed(forms)}",
        )


def check_own_branch(behavior: Element, tables: Tables, report: Report) -> None:
    """Report a condition on the end of a behavior around it, which lasts at least as long as the condition."""
    kind = tables.types.get(behavior.text("type"))
    given = {one.text("name"): one for one in behavior.all("parameter")}
    if kind is None or kind.text("class") != CONDITION or _text(given, "message") != PROGRESS:
        return
    name, wanted = _text(given, "source").removeprefix(f"{Subsystem.MISSION_CONTROL}/"), _text(given, "equals")
    around = next((one for one in tables.behaviors if one.text("name") == name), None)
    if around is None or _text(given, "field") != STATUS or wanted in ("", BehaviorStatus.RUNNING):
        return
    if any(one is behavior for one in around):
        report.fault(
            given["source"].place_of("value"),
            f"{behavior.text('name')} asks whether {name} has ended with {wanted}, and is part of it",
            "Name a behavior that can end before this one, such as one beside it",
        )


def check_named(behavior: Element, tables: Tables, report: Report) -> None:
    """Report parameters that name a component, localizer, body or unit that the mission does not have."""
    facts = tables.facts_of(behavior.text("type"))
    given = {one.text("name"): one for one in behavior.all("parameter")}
    for one in () if facts is None else facts.parameters:
        value, what = _text(given, one.name), one.schema.get("names", "")
        is_judged = value and what and one.accepts(parameter_value(value))
        known = _nameable(what, value, _text(given, "localizer"), tables) if is_judged else None
        name = value.rpartition("/")[2] if is_component(value) else value
        if known is not None and name not in known and _text(given, "message") != READINGS:
            report.fault(
                given[one.name].place_of("value"),
                f"no {'component' if what == 'source' else what} is named {quoted(value)}{report.hint(name, known)}",
                f"There is: {names}"
                if (names := listed(known))
                else f"Add it to the mission, or write another {one.name}",
            )


def _nameable(what: str, value: str, localizer: str, tables: Tables) -> list[str] | None:
    """Return the names that a parameter of this kind may have; None: it may name what this file does not show."""
    world = [] if tables.world is None else [tables.world.text("name")]
    units = [unit.text("name") for unit in tables.units]
    arcs = [f"{behavior.text('name')}-{arc.text('kind')}" for behavior, arc in tables.claims()]
    pool, minds = [*tables.resources, *world, *arcs], [*(one.text("name") for one in tables.behaviors), *units]
    subsystem, _, name = value.rpartition("/")
    if what == "localizer":
        kinds = {name: tables.facts_of(one.text("type")) for name, one in tables.resources.items()}
        pool = [*(name for name, facts in kinds.items() if facts is None or facts.locates), *world]
        if subsystem and not is_component(value):
            return pool
    if what == "unit":
        return units
    if what == "body":
        kind = tables.types.get(tables.resources[localizer].text("type")) if localizer in tables.resources else None
        is_shipped = localizer in world or (kind is not None and kind.text("class") in shipped_classes())
        bodies = [] if tables.world is None else [one.text("name") for one in tables.world.children if one.text("name")]
        return [*dict.fromkeys((*(robot.text("name") for robot in tables.robots()), *bodies))] if is_shipped else None
    if what == "source" and not (subsystem or is_legal(name)):
        return None  # any, or a text that the class refuses
    if not subsystem:
        return pool if what == "localizer" else [*pool, *minds, *CORE_SERVICES, *map(creator_name, tables.hosts)]
    if subsystem == Subsystem.RESOURCE_POOL:
        return pool
    return minds if subsystem == Subsystem.MISSION_CONTROL else None


def _check_limits(given: Mapping[str, Element], rc: str, form: FieldForm, report: Report) -> None:
    """Report limits that the value can never reach, such as 30 for a share of 0.3."""
    for limit in ("above", "below"):
        value = parameter_value(_text(given, limit)) if limit in given else None
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue  # not given, or no number, which is reported with the parameters
        place = given[limit].place_of("value")
        if form.kind not in (ValueKind.NUMBER, ValueKind.WHOLE):
            report.fault(place, f"{form.name} of {rc} is no number", 'Write equals="true" or equals="false"')
        elif not (form.least <= value < form.most if limit == "above" else form.least < value <= form.most):
            how_often = "never" if (limit == "above") is (value >= form.most) else "always"
            report.fault(
                place,
                f"{form.name} of {rc} is {how_often} {limit} {value:g}",
                f"Write a number between {form.least:g} and {form.most:g}",
            )


def _text(given: Mapping[str, Element], name: str) -> str:
    return given[name].text("value") if name in given else ""
