"""What may be set of a core service: of the RC manager its rules, of the others nothing.

Pure: elements in, faults out. The rules' own types judge the values, so a value that passes here is
one the RC manager starts with.
"""

from __future__ import annotations

from typing import Any, get_type_hints

import msgspec

from backbone.mission.document import Element
from backbone.mission.report import Report, told, told_names
from backbone.mission.tables import CORE_SERVICES, check_unique, parameter_value
from backbone.scheduling.rules import LONGEST_S, SchedulingRules, values_of

RULES: dict[str, type[msgspec.Struct]] = {"rc_manager": SchedulingRules}
"""Core service → what the file may set of its parameters."""


def check_service_parameters(service: Element, report: Report) -> None:
    """Report parameters that the core service does not have, that come twice, or that it would refuse."""
    kind = service.text("type")
    if kind not in CORE_SERVICES:
        return
    given = service.all("parameter")
    check_unique(given, "name", "parameter", report)
    known = descriptions(RULES[kind]) if kind in RULES else {}
    for parameter in given:
        name = parameter.text("name")
        if name in known:
            _check_value(parameter, RULES[kind], known[name], report)
        elif name:
            report.fault(
                parameter.place_of("name"),
                f"{kind} has no parameter {told(name)}{report.hint(name, known)}",
                f"There is: {told_names(known)}" if known else "Remove it; only the rc_manager's rules can be set",
            )


def descriptions(rules: type[msgspec.Struct]) -> dict[str, str]:
    """Return what each rule means, by name, in the order of their declaration."""
    hints = get_type_hints(rules, include_extras=True)
    return {field.name: _description(hints[field.name]) for field in msgspec.structs.fields(rules)}


def _description(hint: Any) -> str:
    found = [meta.description for meta in getattr(hint, "__metadata__", ()) if isinstance(meta, msgspec.Meta)]
    return next((text for text in found if text), "")


def _check_value(parameter: Element, rules: type[msgspec.Struct], meaning: str, report: Report) -> None:
    name, text = parameter.text("name"), parameter.text("value")
    if "value" not in parameter.attributes:
        return
    try:
        msgspec.convert({name: parameter_value(text)}, rules)
    except msgspec.ValidationError:
        words = values_of(name)
        hint = report.hint(text, words) if words else ""
        number = "" if words else f"; a number from 0 to {LONGEST_S:g}"
        report.fault(parameter.place_of("value"), f"{name}={told(text)} is illegal{hint}", f"{name}: {meaning}{number}")
