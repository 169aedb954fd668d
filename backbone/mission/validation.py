"""Checks that a mission file contains what is declared, and nothing else.

Undeclared elements and attributes are removed, or replaced by what was probably meant, before pydantic checks the rest.
So an undeclared part does not hide other faults, because ``check`` reports everything at once.
"""

from __future__ import annotations

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from backbone.mission.declaration.elements import MissionElement
from backbone.mission.declaration.vocabulary import ROOT, ElementRule, vocabulary
from backbone.mission.document import Attribute, Element
from backbone.mission.report import Report, listed, quoted

FOR_EDITORS = frozenset({"xmlns:xsi", "xsi:noNamespaceSchemaLocation"})  # for completion in editors; ignored here


FORMER_ROBOT = "scout"
"""Tag of a robot's body in old mission files, when there was only one kind of robot; still read."""


def repair(root: Element, report: Report) -> bool:
    """Report undeclared elements and attributes; afterwards the tree contains declared ones only.

    Returns:
        False if this is not a mission file at all, so that no further check makes sense.
    """
    if root.tag != ROOT:
        report.fault(
            root.place,
            f"<{quoted(root.tag)[1:-1]}> is no mission{report.hint(root.tag, [ROOT])}",
            f"Let the file begin with <{ROOT} name=… priority=…>.",
        )
        return False
    for name in FOR_EDITORS:
        root.attributes.pop(name, None)
    for body in (child for world in root.all("world") for child in world.children if child.tag == FORMER_ROBOT):
        body.tag = "robot"
    _repair(root, report)
    return True


def validated(root: Element, report: Report) -> MissionElement | None:
    """Return the mission with its values read; None, with every fault, if a part is missing or a value is illegal.

    Args:
        root: A tree of declared elements and attributes.
    """
    mission = _judged(root, report)
    for parent in root:
        for tag, (_least, most) in vocabulary()[parent.tag].children.items():
            for double in parent.all(tag)[1:] if most == 1 else []:
                among = parent.children
                parent.children = [double, *(child for child in among if child is not double)]
                _judged(
                    root, report
                )  # the declared classes see the first of its kind; a repeated fault is reported once
                parent.children = among
    return mission


def _judged(root: Element, report: Report) -> MissionElement | None:
    try:
        return MissionElement.model_validate(_values(root))
    except ValidationError as invalid:
        reported: set[tuple[int, str]] = set()
        for error in invalid.errors(include_url=False, include_context=False, include_input=False):
            element, name = _located(root, error)
            if (id(element), name) not in reported:  # each name of a list is an error of its own
                reported.add((id(element), name))
                _report(element, name, error, report)
        return None


def fill_defaults(root: Element) -> None:
    """Set every attribute that is left out to its default, if it has one."""
    for element in root:
        for name, rule in vocabulary()[element.tag].attributes.items():
            if rule.default is not None and name not in element.attributes:
                element.attributes[name] = Attribute(rule.default, element.place, is_written=False)


def _repair(element: Element, report: Report) -> None:
    rule = vocabulary()[element.tag]
    _repair_attributes(element, rule, report)
    kept: list[Element] = []
    seen: dict[str, Element] = {}
    for child in element.children:
        if child.tag not in rule.children and not _rename(element, child, rule, report):
            continue
        first = seen.setdefault(child.tag, child)
        if first is not child and rule.children[child.tag][1] == 1:
            report.fault(
                child.place,
                f"a second <{child.tag}> in <{element.tag}>; the first is in line {first.place.line}",
                "Join them.",
            )
            if not vocabulary()[child.tag].attributes:
                first.children += child.children
                continue
        kept.append(child)
    element.children = kept
    for child in kept:
        _repair(child, report)


def _rename(parent: Element, child: Element, rule: ElementRule, report: Report) -> bool:
    """Report an undeclared child; if its tag is near a declared one, give it that tag. Return whether there is one."""
    meant = report.nearest(child.tag, rule.children)
    known = child.tag in vocabulary()
    what = f"<{child.tag}> does not belong in <{parent.tag}>" if known else f"no element is called {quoted(child.tag)}"
    allowed = listed([f"<{tag}>" for tag in rule.children])
    remedy = f"<{parent.tag}> may contain: {allowed}" if allowed else f"<{parent.tag}> has no elements inside"
    report.fault(child.place, what + _remark(meant), remedy)
    child.tag = meant or child.tag
    return bool(meant)


def _repair_attributes(element: Element, rule: ElementRule, report: Report) -> None:
    for name in [name for name in element.attributes if name not in rule.attributes]:
        stranger = element.attributes.pop(name)
        meant = report.nearest(name, rule.attributes)
        allowed = listed(rule.attributes)
        remedy = f"Its attributes: {allowed}" if allowed else "It has no attributes"
        report.fault(stranger.place, f"<{element.tag}> has no attribute {quoted(name)}{_remark(meant)}", remedy)
        if meant and meant not in element.attributes:
            element.attributes[meant] = stranger


def _remark(meant: str) -> str:
    return f" (did you mean {meant!r}?)" if meant else ""


def _values(element: Element) -> dict[str, object]:
    """Return an element in the form that the declared classes read: attributes and children by their names."""
    values: dict[str, object] = {name: attribute.value for name, attribute in element.attributes.items()}
    for tag, (_least, most) in vocabulary()[element.tag].children.items():
        inside = [_values(child) for child in element.all(tag)]
        if most > 1:
            values[tag] = inside
        elif inside:
            values[tag] = inside[0]
    return values


def _located(root: Element, error: ErrorDetails) -> tuple[Element, str]:
    """Return the element that an error concerns, and its attribute or kind of child."""
    element, left = root, list(error["loc"])
    while left:
        name = str(left.pop(0))
        inside = element.all(name) if name in vocabulary()[element.tag].children else []
        if not inside or not left:
            return element, name
        element = inside[left.pop(0) if isinstance(left[0], int) else 0]  # type: ignore[index]
    return element, ""


def _report(element: Element, name: str, error: ErrorDetails, report: Report) -> None:
    rule = vocabulary()[element.tag]
    if name in rule.children:
        least = rule.children[name][0]
        lacks = "lacks" if least == 1 else f"has fewer than {least}"
        report.fault(
            element.place, f"<{element.tag}> {lacks} <{name}>", f"<{name}>: {vocabulary()[name].documentation}"
        )
        return
    declared = rule.attributes[name]
    if error["type"] == "missing":
        report.fault(element.place, f"<{element.tag}> lacks {name}", f"{name}: {declared.documentation}")
        return
    value = element.text(name)
    hint = report.hint(value, declared.words)
    message = f"{name}={quoted(value)} in <{element.tag}> is illegal{hint}"
    report.fault(element.place_of(name), message, f"{name}: {declared.remedy}")
