"""All commands and their effects: text and arguments go in, another text and the touched element come out.

Pure. The text is the only source: each change reads the elements' places from it again.

Rules of this file:

* A command is carried out completely or refused. A refusal is typed and has a remedy.
* A command is refused if the text cannot express the result or would become ambiguous: a wrong place, a name that is
taken. An incomplete text (an empty section, a wish without a resource) is no refusal but a problem, as in
``scout-backbone check``.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

from backbone.mission import edit
from backbone.mission.edit import Element, NewElement, Path, outline, place_for
from backbone.mission.report import quoted
from backbone.mission.tables import NETWORK_ID, WORLD
from backbone.naming import legal
from ui_console.design.catalogue import stock_resource, stock_type
from ui_console.design.commands import DesignRefused, ElementNameTaken, TextState, command

LAST_NETWORK_ID = 254  # as in the reader
BODY_STEP_M = 1.0  # chosen: distance between the robots' first places, half of it to the wall, so that no bodies touch
WORLD_NAMED_BY = (WORLD, "localizer")  # parameters whose value is the world's name
RADIO_RATE = {"period-s": "0.1", "packet-time-s": "0.002"}  # chosen: as mission.xml, a fiftieth of a radio


@command
def add(text: bytes, parent: Path, element: NewElement, at: int | None = None) -> TextState:
    """Add a given element."""
    return _added(text, parent, element, at)


def _added(text: bytes, parent: Path, element: NewElement, at: int | None = None) -> TextState:
    node = outline(text).at(parent)
    after = edit.add(text, parent, element, at)
    return TextState(after, (*parent, place_for(node, element.tag, at)))


def _section(text: bytes, tag: str) -> tuple[bytes, Path]:
    """Return a text that has this section of the mission, and the section's path."""
    root = outline(text)
    found = root.first(tag)
    if found is None:
        text = edit.add(text, (), NewElement(tag))
        found = outline(text).first(tag)
    if found is None:
        raise AssertionError(f"<{tag}> was added and is not there")
    return text, found.path


@command
def add_type(text: bytes, name: str) -> TextState:
    """Declare a type that the project ships, so that it may be changed; an existing declaration stays."""
    text, section = _section(text, "types")
    for declared in outline(text).at(section).all("type"):
        if declared.text("name") == name:
            return TextState(text, declared.path)
    known = stock_type(name)
    if known is None:
        raise _no_type(name)
    return _added(text, section, _copy(known))


def _must_have_type(text: bytes, name: str) -> None:
    """Refuse a type that neither the file nor the project declares."""
    if stock_type(name) is None and name not in {one.text("name") for one in outline(text) if one.tag == "type"}:
        raise _no_type(name)


def _no_type(name: str) -> DesignRefused:
    return DesignRefused(
        f"no type {quoted(name)} is declared, and the project ships none",
        remedy="Add a <type> with its class first.",
    )


def _copy(node: Element) -> NewElement:
    return NewElement(node.tag, dict(node.values), [_copy(child) for child in node.children])


@command
def add_behavior(text: bytes, parent: Path, kind: str, name: str, priority: int = 1) -> TextState:
    """Add a node of the behavior tree.

    Args:
        parent: A behavior; the mission or its ``<behaviors>`` for a root.
        priority: Among its siblings.
    """
    _free(outline(text), "behavior", name)
    if outline(text).at(parent).tag == "mission":
        text, parent = _section(text, "behaviors")
    _must_have_type(text, kind)
    values = {"type": kind, "name": name, "priority": str(priority)}
    return _added(text, parent, NewElement("behavior", values))


class _Marked:
    """Keeps track of an element while other sections of the file are added or filled."""

    def __init__(self, text: bytes, path: Path) -> None:
        self.text, self._below = text, path[1:]
        root = outline(text)
        self._tag = root.at(path[:1]).tag if path else ""
        self._before = sum(child.tag == self._tag for child in root.children[: path[0]]) if path else 0

    def now(self, text: bytes) -> Path:
        return (*outline(text).all(self._tag)[self._before].path, *self._below) if self._tag else ()


@command
def claim_arc(text: bytes, behavior: Path, kind: str, minimum_runtime_s: str) -> TextState:
    """Set the ARC that a behavior claims; it replaces the present one."""
    node = outline(text).at(behavior)
    if node.tag != "behavior":
        raise DesignRefused(f"a <{node.tag}> claims no ARC", remedy="Pick a behavior.")
    _must_have_type(text, kind)
    arc = node.first("arc")
    if arc is not None:
        text = edit.set_attribute(text, arc.path, "kind", kind)
        return TextState(edit.set_attribute(text, arc.path, "minimum-runtime-s", minimum_runtime_s), arc.path)
    values = {"kind": kind, "minimum-runtime-s": minimum_runtime_s, **RADIO_RATE}
    return _added(text, behavior, NewElement("arc", values))


@command
def add_resource(text: bytes, kind: str, name: str) -> TextState:
    """Add hardware with its initial content and links to existing hardware; add its body if there is a world."""
    _free(outline(text), "resource", name)
    _must_have_type(text, kind)
    text, section = _section(text, "resources")
    root = outline(text)
    shape = stock_resource(kind)
    if shape is None:
        return _added(text, section, NewElement("resource", {"type": kind, "name": name}))
    children = []
    for part in shape.children:
        if part.tag == "uses":
            there = [
                one.text("name") for one in root.at(section).all("resource") if one.text("type") == part.text("type")
            ]
            if there:
                children.append(NewElement("uses", {"type": part.text("type"), "name": there[0]}))
        elif part.text("name") == NETWORK_ID:
            children.append(NewElement("parameter", {"name": NETWORK_ID, "value": str(_free_network_id(root))}))
        else:
            children.append(_copy(part))
    values = {**shape.values, "name": name}
    step = _added(text, section, NewElement("resource", values, children))
    return TextState(_with_bodies(step.text, name), step.touched)


@command
def add_world(text: bytes, width_m: str, depth_m: str) -> TextState:
    """Add the simulated room, with a body for every robot."""
    room = NewElement("room", {"width-m": width_m, "depth-m": depth_m})
    step = _added(text, (), NewElement("world", {"name": "world", "type": "simulated_world"}, [room]))
    return TextState(_with_bodies(step.text), step.touched)


def _with_bodies(text: bytes, only: str = "") -> bytes:
    """Return a text in which simulated robots have bodies, in a row near the lower wall, facing the room.

    Args:
        only: The only robot that gets a body; empty: all robots without a body.
    """
    world = outline(text).first("world")
    section = outline(text).first("resources")
    if world is None or section is None:
        return text
    bodies = [body.text("name") for body in world.all("robot")]
    room = world.first("room")
    depth_m = _number(room.text("depth-m") if room is not None else "", 2.0)
    width_m = _number(room.text("width-m") if room is not None else "", 2.0)
    for resource in section.all("resource"):
        name = resource.text("name")
        is_simulated = resource.text("driver") in ("", "simulated")
        if _network_id(resource) is None or not is_simulated or name in bodies or only not in ("", name):
            continue
        x_m = (BODY_STEP_M * (len(bodies) + 1)) % width_m or width_m / 2
        place = {"name": name, "x-m": f"{x_m:g}", "y-m": f"{min(BODY_STEP_M, depth_m) / 2:g}", "heading-deg": "90"}
        text = edit.add(text, world.path, NewElement("robot", place))
        bodies.append(name)
    return text


def _number(value: str, otherwise: float) -> float:
    try:
        found = float(value)
    except ValueError:
        return otherwise
    return found if 0 < found <= 1000 else otherwise


def _network_id(resource: Element) -> str | None:
    return next((one.text("value") for one in resource.all("parameter") if one.text("name") == NETWORK_ID), None)


def _free_network_id(root: Element) -> int:
    taken = {_network_id(node) for node in root if node.tag == "resource"}
    free = next((number for number in range(1, LAST_NETWORK_ID + 1) if str(number) not in taken), None)
    if free is None:
        raise DesignRefused(f"all {LAST_NETWORK_ID} network ids are taken", remedy="Remove a robot first.")
    return free


@command
def remove(text: bytes, path: Path) -> TextState:
    """Remove an element and its content; with a robot, also its body."""
    node = outline(text).at(path)
    text = edit.remove(text, path)
    if node.tag == "resource":
        world = outline(text).first("world")
        bodies = (
            [] if world is None else [body for body in world.all("robot") if body.text("name") == node.text("name")]
        )
        marked = _Marked(text, path[:-1])
        for body in bodies[:1]:
            text = edit.remove(text, body.path)
        parent = marked.now(text)
    else:
        parent = path[:-1]
    siblings = outline(text).at(parent).children
    return TextState(text, (*parent, min(path[-1], len(siblings) - 1)) if siblings else parent)


@command
def relocate(text: bytes, path: Path, parent: Path, at: int) -> TextState:
    """Move an element; ``at`` is its number among its siblings afterwards."""
    root = outline(text)
    node = root.at(path)
    after = edit.move(text, path, parent, at)
    depth = len(path) - 1
    if len(parent) > depth and parent[:depth] == path[:-1] and parent[depth] > path[-1]:
        parent = (*parent[:depth], parent[depth] - 1, *parent[depth + 1 :])
    target = outline(after).at(parent)
    number = min(max(at, 0), len(target.children) - 1)
    if target.children[number].tag != node.tag:
        raise AssertionError(f"<{node.tag}> was moved and is not where it should be")
    return TextState(after, (*parent, number))


@command
def set_value(text: bytes, path: Path, attribute: str, value: str | None) -> TextState:
    """Set an attribute; None removes it."""
    return TextState(edit.set_attribute(text, path, attribute, value), path)


@command
def write_parameter(text: bytes, path: Path, name: str, value: str | None) -> TextState:
    """Set a parameter of a behavior, a resource or a service; None removes it."""
    node = outline(text).at(path)
    found = next((one for one in node.all("parameter") if one.text("name") == name), None)
    if found is None:
        if value is None:
            return TextState(text, path)
        return TextState(edit.add(text, path, NewElement("parameter", {"name": name, "value": value})), path)
    if value is None:
        return TextState(edit.remove(text, found.path), path)
    return TextState(edit.set_attribute(text, found.path, "value", value), path)


def _free(root: Element, tag: str, name: str) -> None:
    """Refuse a name that is illegal, or that another element of the kind has.

    Raises:
        IllegalName: The name does not follow the rule for names.
        ElementNameTaken: Another element has the name.
    """
    legal(name)
    kinds = _ONE_SPACE if tag in _ONE_SPACE else (tag,)
    for node in root:
        if node.tag in kinds and node.text("name") == name and _is_named(root, node):
            raise ElementNameTaken(f"a {node.tag} has the name {quoted(name)} already")


_ONE_SPACE = ("resource", "behavior", "world")  # components of the mission; all their names differ


def _is_named(root: Element, node: Element) -> bool:
    """Return whether the element has its own name, and is not a reference to another element."""
    return node.tag not in ("wish", "uses", "parameter") and node is not root


@command
def rename(text: bytes, path: Path, name: str) -> TextState:
    """Rename an element, and all references to it."""
    root = outline(text)
    node = root.at(path)
    old = node.text("name")
    if name == old:
        return TextState(text, path)
    if node.tag in ("wish", "uses", "parameter"):
        return TextState(edit.set_attribute(text, path, "name", name), path)
    if node.tag == "robot" and old:
        owner = next((one for one in root if one.tag == "resource" and one.text("name") == old), None)
        node = owner or node
    _free(root, node.tag, name)
    text = edit.set_attribute(text, node.path, "name", name)
    for other, attribute, value in _mentions(root, node, old, name):
        text = edit.set_attribute(text, other.path, attribute, value)
    return TextState(text, path)


def _mentions(root: Element, node: Element, old: str, new: str) -> Iterator[tuple[Element, str, str]]:
    """Yield each element that refers to another by its name, the attribute, and the attribute's new value."""
    find = _MENTIONS.get(node.tag)
    for other in root:
        for attribute in [] if find is None else find(node, other):
            words = other.text(attribute).split()
            if old and old in words:
                yield other, attribute, " ".join(new if word == old else word for word in words)


def _of_type(_node: Element, other: Element) -> list[str]:
    match other.tag:
        case "service" | "resource" | "world" | "behavior" | "needs" | "wish" | "uses":
            return ["type"]
        case "arc":
            return ["kind"]
        case "type":
            return ["uses"]
        case _:
            return []


def _of_resource(node: Element, other: Element) -> list[str]:
    if other.tag == "robot":
        return ["name"]
    is_mention = other.tag in ("wish", "uses") and other.text("type") == node.text("type")
    return ["name"] if is_mention else []


def _of_world(_node: Element, other: Element) -> list[str]:
    return ["value"] if other.tag == "parameter" and other.text("name") in WORLD_NAMED_BY else []


_MENTIONS: dict[str, Callable[[Element, Element], list[str]]] = {
    "host": lambda _node, other: ["host"] if other.tag in ("service", "resource", "world") else [],
    "type": _of_type,
    "resource": _of_resource,
    "world": _of_world,
    "target": lambda _node, other: ["carried-by"] if other.tag == "robot" else [],
}
