"""What mission.xsd says: which elements and attributes there are, what they mean, what values they take.

The vocabulary (what may stand where, what must, defaults, documentation) is read from the schema
itself. It finds what has no place in the file and takes it out, or for what it was probably meant,
before libxml2 judges the rest: a validator that meets a stranger stops judging its neighbors, and
``check`` has to tell everything at once.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from importlib import resources

from lxml import etree

from backbone.mission.document import Attribute, Element
from backbone.mission.report import Report, told, told_names

ROOT = "mission"
FOR_EDITORS = frozenset({"xmlns:xsi", "xsi:noNamespaceSchemaLocation"})  # let an editor complete; mean nothing here

_XS = "{http://www.w3.org/2001/XMLSchema}"
_PARTICLES = tuple(_XS + kind for kind in ("complexType", "sequence", "choice", "all", "group", "element"))
_UNBOUNDED = 1 << 30
_COMPLAINT = re.compile(r"Element '[^']*'(?:, attribute '(?P<attribute>[^']*)')?: (?P<text>.*)", re.DOTALL)
_MISSING_ATTRIBUTE = re.compile(r"The attribute '([^']*)' is required but missing")


@dataclass(frozen=True, slots=True)
class AttributeRule:
    """What the schema says about an attribute.

    Attributes:
        type: Its simple type.
        required: Whether it must be given.
        default: Its value where it is left out; None: none.
        documentation: What it means, with unit and range.
    """

    type: str
    required: bool
    default: str | None
    documentation: str


@dataclass(frozen=True, slots=True)
class ElementRule:
    """What the schema says about an element.

    Attributes:
        attributes: By name.
        children: Tag → how often it must stand in it at least, and may at most.
        documentation: What it means.
    """

    attributes: dict[str, AttributeRule]
    children: dict[str, tuple[int, int]]
    documentation: str


def schema_text() -> str:
    """Return the XML schema of mission files."""
    return resources.files("backbone.mission").joinpath("mission.xsd").read_text("utf-8")


@lru_cache(maxsize=1)
def vocabulary() -> dict[str, ElementRule]:
    """Return every element of a mission file by its tag."""
    schema = _schema_root()
    groups = {group.get("name"): group for group in schema.iterfind(f"{_XS}group")}
    rules = {}
    for declared in schema.iterfind(f"{_XS}element"):
        attributes = {
            str(attribute.get("name")): AttributeRule(
                str(attribute.get("type")),
                attribute.get("use") == "required",
                attribute.get("default"),
                _documentation(attribute),
            )
            for attribute in declared.iter(f"{_XS}attribute")
        }
        children: dict[str, tuple[int, int]] = {}
        for tag, least, most in _occurrences(declared, groups, 1, 1):
            before = children.get(tag, (0, 0))
            children[tag] = (before[0] + least, min(before[1] + most, _UNBOUNDED))
        rules[str(declared.get("name"))] = ElementRule(attributes, children, _documentation(declared))
    return rules


@lru_cache(maxsize=1)
def enumerations() -> dict[str, list[str]]:
    """Return the values of every simple type that lists them."""
    return {
        str(simple.get("name")): values
        for simple in _schema_root().iterfind(f"{_XS}simpleType")
        if (values := [str(value.get("value")) for value in simple.iter(f"{_XS}enumeration")])
    }


def apply_schema(root: Element, report: Report) -> bool:
    """Report all that breaks the schema; afterwards the tree holds known elements and attributes only.

    Values may still be missing or illegal.

    Returns:
        False if this is no mission file at all, so that nothing further can be said.
    """
    if root.tag != ROOT:
        report.fault(
            root.place,
            f"<{told(root.tag)[1:-1]}> is no mission{report.hint(root.tag, [ROOT])}",
            f"Let the file begin with <{ROOT} name=… priority=…>.",
        )
        return False
    for name in FOR_EDITORS:
        root.attributes.pop(name, None)
    _repair(root, report)
    _validate(root, report)
    return True


def fill_defaults(root: Element) -> None:
    """Give every attribute that is left out its default, if it has one."""
    for element in root:
        for name, rule in vocabulary()[element.tag].attributes.items():
            if rule.default is not None and name not in element.attributes:
                element.attributes[name] = Attribute(rule.default, element.place)


# ---------------------------------------------------------------------- reading the schema
@lru_cache(maxsize=1)
def _schema_root() -> etree._Element:
    return etree.fromstring(schema_text().encode())


@lru_cache(maxsize=1)
def _validator() -> etree.XMLSchema:
    return etree.XMLSchema(_schema_root())


def _documentation(declared: etree._Element) -> str:
    found = declared.find(f"{_XS}annotation/{_XS}documentation")
    return "" if found is None or found.text is None else " ".join(found.text.split())


@lru_cache(maxsize=1)
def _type_documentation() -> dict[str, str]:
    types = _schema_root().iterfind(f"{_XS}simpleType")
    return {str(simple.get("name")): text for simple in types if (text := _documentation(simple))}


def _occurrences(
    particle: etree._Element, groups: dict[str | None, etree._Element], least: int, most: int
) -> Iterator[tuple[str, int, int]]:
    """Yield tag, least and most number for every element that a particle refers to."""
    for part in particle.iterchildren(*_PARTICLES):
        part_least = least * int(part.get("minOccurs", "1"))
        bound = part.get("maxOccurs", "1")
        part_most = min(most * (_UNBOUNDED if bound == "unbounded" else int(bound)), _UNBOUNDED)
        if particle.tag == f"{_XS}choice":
            part_least = 0
        if part.tag == f"{_XS}element":
            yield str(part.get("ref")), part_least, part_most
        else:
            inside = groups[part.get("ref")] if part.tag == f"{_XS}group" else part
            yield from _occurrences(inside, groups, part_least, part_most)


# ---------------------------------------------------------------------- what has no place in the file
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
    """Report a stranger; give it the tag it was probably meant to have and say whether there is one."""
    meant = report.nearest(child.tag, rule.children)
    known = child.tag in vocabulary()
    what = f"<{child.tag}> does not belong in <{parent.tag}>" if known else f"no element is called {told(child.tag)}"
    allowed = told_names([f"<{tag}>" for tag in rule.children])
    remedy = f"In <{parent.tag}> may stand: {allowed}" if allowed else f"<{parent.tag}> has no elements inside"
    report.fault(child.place, what + _remark(meant), remedy)
    child.tag = meant or child.tag
    return bool(meant)


def _repair_attributes(element: Element, rule: ElementRule, report: Report) -> None:
    for name in [name for name in element.attributes if name not in rule.attributes]:
        stranger = element.attributes.pop(name)
        meant = report.nearest(name, rule.attributes)
        allowed = told_names(rule.attributes)
        remedy = f"Its attributes: {allowed}" if allowed else "It has no attributes"
        report.fault(stranger.place, f"<{element.tag}> has no attribute {told(name)}{_remark(meant)}", remedy)
        if meant and meant not in element.attributes:
            element.attributes[meant] = stranger


def _remark(meant: str) -> str:
    return f" (did you mean {meant!r}?)" if meant else ""


# ---------------------------------------------------------------------- what libxml2 judges
def _validate(root: Element, report: Report) -> None:
    elements = list(root)
    validator = _validator()
    if validator.validate(_to_lxml(root)):
        return
    told_values: set[tuple[int, str]] = set()
    for entry in validator.error_log:  # type: ignore[attr-defined]  # the stubs forget that it can be iterated
        element = elements[entry.line - 1]
        matched = _COMPLAINT.fullmatch(entry.message)
        attribute, text = (matched["attribute"], matched["text"]) if matched else (None, entry.message)
        if attribute is not None:
            if (entry.line, attribute) not in told_values:  # libxml2 complains twice about lists
                told_values.add((entry.line, attribute))
                _report_value(element, attribute, report)
        elif missing := _MISSING_ATTRIBUTE.match(text):
            documentation = vocabulary()[element.tag].attributes[missing[1]].documentation
            report.fault(element.place, f"<{element.tag}> lacks {missing[1]}", f"{missing[1]}: {documentation}")
        else:
            _report_content(element, text, report)


def _to_lxml(root: Element) -> etree._Element:
    """Return the same tree for libxml2; the source line of each node is the element's number from 1."""
    numbers = itertools.count(1)

    def add(element: Element, parent: etree._Element | None) -> etree._Element:
        values = {name: attribute.value for name, attribute in element.attributes.items()}
        node = etree.Element(element.tag, values) if parent is None else etree.SubElement(parent, element.tag, values)
        node.sourceline = next(numbers)  # type: ignore[assignment]  # the stubs say EllipsisType
        for child in element.children:
            add(child, node)
        return node

    return add(root, None)


def _report_value(element: Element, attribute: str, report: Report) -> None:
    rule = vocabulary()[element.tag].attributes[attribute]
    value = element.text(attribute)
    hint = report.hint(value, enumerations().get(rule.type, []))
    meaning = _type_documentation().get(rule.type, rule.documentation)
    message = f"{attribute}={told(value)} in <{element.tag}> is illegal{hint}"
    report.fault(element.place_of(attribute), message, f"{attribute}: {meaning}")


def _report_content(element: Element, text: str, report: Report) -> None:
    lacking = [
        tag for tag, (least, _most) in vocabulary()[element.tag].children.items() if len(element.all(tag)) < least
    ]
    for tag in lacking:
        least = vocabulary()[element.tag].children[tag][0]
        lacks = "lacks" if least == 1 else f"has fewer than {least}"
        documentation = vocabulary()[tag].documentation
        report.fault(element.place, f"<{element.tag}> {lacks} <{tag}>", f"<{tag}>: {documentation}")
    if not lacking:
        report.fault(element.place, text, "See docs/reference/mission-file.md.")
