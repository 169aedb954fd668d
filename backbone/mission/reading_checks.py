"""Checks that conditions on readings name a resource and a value that it reports, and that watchers name a unit.

Pure: elements and facts in, faults out. A class without known facts is not checked.
"""

from __future__ import annotations

from collections.abc import Mapping

from backbone.component.abilities import FieldForm, ValueKind
from backbone.mission.document import Element
from backbone.mission.report import Report, listed, quoted
from backbone.mission.tables import Tables, parameter_value
from backbone.naming import Subsystem, is_legal

CONDITION = "mission_control.behaviors.condition:MessageCondition"
"""Class of the behaviors that check conditions on messages."""
WATCHER = "mission_control.behaviors.watch_for_motion:WatchForMotion"
"""Class of the behaviors whose pictures a unit may evaluate, named in their parameter ``vision``."""
READINGS = "Readings"
"""Value of their parameter ``message`` for conditions on measurements of an RC."""
VALUES = "values."
"""Prefix of a report's name in their parameter ``field``."""
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


def check_vision(behavior: Element, tables: Tables, report: Report) -> None:
    """Report a watcher that names an unknown unit for its pictures."""
    kind = tables.types.get(behavior.text("type"))
    given = {one.text("name"): one for one in behavior.all("parameter")}
    name, units = _text(given, "vision"), [unit.text("name") for unit in tables.units]
    if kind is not None and kind.text("class") == WATCHER and name and name not in units:
        report.fault(
            given["vision"].place_of("value"),
            f"no unit is named {quoted(name)}{report.hint(name, units)}",
            f"There is: {listed(units)}" if units else "Write the unit into <modules>, or leave the parameter out",
        )


def _check_limits(given: Mapping[str, Element], rc: str, form: FieldForm, report: Report) -> None:
    """Report limits that the value can never reach, such as 30 for a share of 0.3."""
    for limit in ("above", "below"):
        value = parameter_value(_text(given, limit)) if limit in given else None
        if isinstance(value, bool) or not isinstance(value, int | float):
            continue  # not given, or no number, which is reported with the parameters
        place = given[limit].place_of("value")
        if form.kind not in (ValueKind.NUMBER, ValueKind.WHOLE):
            report.fault(place, f"{form.name} of {rc} is no number", 'Write equals="true" or equals="false"')
        elif not form.least <= value <= form.most:
            how_often = "never" if (limit == "above") is (value > form.most) else "always"
            report.fault(
                place,
                f"{form.name} of {rc} is {how_often} {limit} {value:g}",
                f"Write a number from {form.least:g} to {form.most:g}",
            )


def _text(given: Mapping[str, Element], name: str) -> str:
    return given[name].text("value") if name in given else ""
