"""Offers of additions: their places, their questions, and the resulting commands.

Pure: a tree and an element go in, offers come out.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import msgspec

from backbone.mission.declaration.vocabulary import vocabulary
from backbone.mission.edit import Element, NewElement, Path
from backbone.mission.report import listed, quoted
from ui_console.design.catalogue import Role, TypeEntry, entries, stock_resource
from ui_console.design.commands import DesignCommand, DesignRefused
from ui_console.design.effects import add, add_behavior, add_resource, add_type, add_world, claim_arc, write_parameter
from ui_console.design.properties import choices

MINIMUM_RUNTIME_S = "5"  # RAM 2002, "Experiments": slices of five seconds
_POINT = re.compile(r"([^\s,]+),([^\s,]+)")


class Prompt(msgspec.Struct, frozen=True):
    """A question of an offer.

    Attributes:
        name: Name of the answer.
        doc: Its meaning.
        proposed: The proposed answer.
        choices: Possible answers, if they can be listed.
        is_required: False: the answer may be empty.
    """

    name: str
    doc: str
    proposed: str = ""
    choices: tuple[str, ...] = ()
    is_required: bool = True


@dataclass(frozen=True, slots=True)
class Offer:
    """A possible addition.

    Attributes:
        label: Its name in a list.
        build: Returns the command for the answers in this order; may refuse with ``DesignRefused``.
    """

    label: str
    doc: str
    asks: tuple[Prompt, ...]
    build: Callable[[Sequence[str]], DesignCommand]

    @property
    def must_ask(self) -> bool:
        """True if a question has no proposal, or several possible answers."""
        return any(not asked.proposed or len(asked.choices) > 1 for asked in self.asks)

    def command(self, answers: Sequence[str]) -> DesignCommand:
        """Return the command for these answers; without answers, for the proposed ones.

        Raises:
            DesignRefused: The number of answers is wrong, or an answer is not valid.
        """
        if not answers:
            answers = [asked.proposed for asked in self.asks]
        if len(answers) != len(self.asks):
            raise DesignRefused(f"{self.label} asks for {len(self.asks)} answers, not {len(answers)}")
        return self.build(answers)


def offers(mission: Element, path: Path) -> list[Offer]:
    """Return the possible additions: first to an element, then to its ancestors, each kind at the nearest place.

    Args:
        mission: The whole file.
        path: The element.
    """
    found: dict[str, Offer] = {}
    for depth in range(len(path), -1, -1):
        for offer in _offers(mission, mission.at(path[:depth])):
            found.setdefault(offer.label, offer)
    return list(found.values())


def offer_at(mission: Element, path: Path, label: str) -> Offer:
    """Return the offer with this label at an element; a behavior also has the offers of its ARC.

    Raises:
        DesignRefused: The addition is not possible there.
        EditRefused: There is no such element.
    """
    arc = mission.at(path).first("arc")
    for place in (path, *(() if arc is None else (arc.path,))):
        for offer in offers(mission, place):
            if offer.label == label:
                return offer
    kind = label.partition(" ")[0]
    holders = [f"<{tag}>" for tag, rule in vocabulary().items() if kind in rule.children]
    raise DesignRefused(
        f"{quoted(label)} cannot be added to <{mission.at(path).tag}> or what it stands in",
        remedy=f"It belongs in {listed(holders)}." if holders else "Choose something else.",
    )


def free_name(mission: Element, wished: str) -> str:
    """Return the name, or a similar name with the first number that no component has.

    Example: with ``scout1`` taken, ``scout1`` gives ``scout2``.
    """
    taken = {node.text("name") for node in mission}
    stem, number = wished.rstrip("0123456789"), 2
    if wished not in taken:
        return wished
    while f"{stem}{number}" in taken:
        number += 1
    return f"{stem}{number}"


def _offers(mission: Element, node: Element) -> list[Offer]:
    match node.tag:
        case "mission":
            missing = [] if mission.first("world") is not None else [_world()]
            sections = [tag for tag in ("types", "core", "hosts") if mission.first(tag) is None]
            bare = [offer for tag in sections for offer in _generic(mission, node, tag)]
            return [*_behaviors(mission, node), *_resources(mission), *missing, *bare]
        case "behaviors":
            last = [] if node.first("last") is not None else _generic(mission, node, "last")
            return [*_behaviors(mission, node), *last]
        case "last":
            return [] if node.first("behavior") is not None else _behaviors(mission, node)
        case "behavior":
            return [*_behaviors(mission, node), *_claims(mission, node), _parameter(node)]
        case "arc":
            return _wishes(mission, node)
        case "resources":
            return _resources(mission)
        case "resource":
            return [*_generic(mission, node, "uses"), _parameter(node)]
        case "types":
            return [*_types(mission), *_generic(mission, node, "type")]
        case "target":
            return _generic(mission, node, "point")
        case _:
            rule = vocabulary().get(node.tag)
            tags = (
                [] if rule is None else [tag for tag, (_, most) in rule.children.items() if len(node.all(tag)) < most]
            )
            return [offer for tag in tags for offer in _generic(mission, node, tag)]


def _of(mission: Element, role: Role) -> list[TypeEntry]:
    return [one for one in entries(mission) if one.role is role]


def _behaviors(mission: Element, node: Element) -> list[Offer]:
    def offer(entry: TypeEntry) -> Offer:
        rules = vocabulary()["behavior"].attributes
        asks = (
            Prompt("name", rules["name"].documentation, free_name(mission, entry.name.replace("_", "-"))),
            Prompt("priority", rules["priority"].documentation, "1"),
        )
        return Offer(f"behavior {entry.name}", entry.class_path, asks, lambda given: build(entry, given))

    def build(entry: TypeEntry, given: Sequence[str]) -> DesignCommand:
        if not re.fullmatch(r"-?\d{1,9}", given[1].strip()):
            raise DesignRefused(f"{given[1]!r} is no priority", remedy="Write a whole number; larger is higher.")
        return add_behavior(node.path, entry.name, given[0], int(given[1]))

    return [offer(entry) for entry in _of(mission, Role.BEHAVIOR)]


def _claims(mission: Element, node: Element) -> list[Offer]:
    doc = vocabulary()["arc"].attributes["minimum-runtime-s"].documentation
    asks = (Prompt("minimum-runtime-s", doc, MINIMUM_RUNTIME_S),)

    def offer(entry: TypeEntry) -> Offer:
        what = f"claims one each of: {', '.join(entry.needs)}"
        return Offer(f"arc {entry.name}", what, asks, lambda given: claim_arc(node.path, entry.name, given[0].strip()))

    return [offer(entry) for entry in _of(mission, Role.ARC)]


def _wishes(mission: Element, node: Element) -> list[Offer]:
    needs: Mapping[str, str] = next((one.needs for one in entries(mission) if one.name == node.text("kind")), {})
    wished = {one.text("type") for one in node.all("wish")}

    def offer(role: str, kind: str) -> Offer:
        there = [one.text("name") for one in mission if one.tag == "resource" and one.text("type") == kind]
        doc = vocabulary()["wish"].attributes["name"].documentation
        asks = (Prompt("name", doc, there[0] if there else "", tuple(there)),)
        return Offer(
            f"wish {role}",
            vocabulary()["wish"].documentation,
            asks,
            lambda given: add(node.path, NewElement("wish", {"type": role, "name": given[0]})),
        )

    return [offer(role, kind) for role, kind in needs.items() if role not in wished]


def _resources(mission: Element) -> list[Offer]:
    def offer(entry: TypeEntry) -> Offer:
        shape = stock_resource(entry.name)
        name = shape.text("name") if shape is not None else entry.name
        asks = (Prompt("name", vocabulary()["resource"].attributes["name"].documentation, free_name(mission, name)),)
        return Offer(f"resource {entry.name}", entry.class_path, asks, lambda given: add_resource(entry.name, given[0]))

    return [offer(entry) for entry in _of(mission, Role.RESOURCE)]


def _world() -> Offer:
    rules = vocabulary()["room"].attributes
    asks = (
        Prompt("width-m", rules["width-m"].documentation, "9"),
        Prompt("depth-m", rules["depth-m"].documentation, "6"),
    )
    return Offer(
        "world", vocabulary()["world"].documentation, asks, lambda given: add_world(given[0].strip(), given[1].strip())
    )


def _types(mission: Element) -> list[Offer]:
    def offer(entry: TypeEntry) -> Offer:
        return Offer(f"type {entry.name}", entry.class_path, (), lambda _given: add_type(entry.name))

    return [offer(entry) for entry in entries(mission) if not entry.is_declared]


def _parameter(node: Element) -> Offer:
    rules = vocabulary()["parameter"].attributes
    asks = (
        Prompt("name", rules["name"].documentation),
        Prompt("value", rules["value"].documentation, is_required=False),
    )
    return Offer(
        "parameter",
        vocabulary()["parameter"].documentation,
        asks,
        lambda given: write_parameter(node.path, given[0], given[1]),
    )


def _generic(mission: Element, node: Element, tag: str) -> list[Offer]:
    """Return an offer of an element by its schema, with a question for each required attribute."""
    rule = vocabulary()[tag]
    new = Element(tag, node.place, path=(*node.path, 0))
    required = [name for name, one in rule.attributes.items() if one.required]
    asks = [
        Prompt(
            name,
            rule.attributes[name].documentation,
            free_name(mission, tag) if name == "name" and tag not in ("uses", "parameter") else "",
            choices(mission, new, name, rule.attributes[name].words),
        )
        for name in required
    ]
    if tag == "target":
        asks.append(Prompt("path", "Its way points, x,y in meters, separated by blanks.", "1,1 2,1"))

    def build(given: Sequence[str]) -> DesignCommand:
        values = {name: value for name, value in zip(required, given, strict=False) if value}
        points = _points(given[-1]) if tag == "target" else []
        return add(node.path, NewElement(tag, values, points))

    return [Offer(tag, rule.documentation, tuple(asks), build)]


def _points(text: str) -> list[NewElement]:
    found = []
    for word in text.split():
        matched = _POINT.fullmatch(word)
        if matched is None:
            raise DesignRefused(f"{word!r} is no way point", remedy="Write x,y in meters, as in 0,3 9,3.")
        found.append(NewElement("point", {"x-m": matched[1], "y-m": matched[2]}))
    return found
