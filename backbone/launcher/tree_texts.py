"""Tree texts: the mission file after an operator's change of the behavior tree, read and checked as any other. Pure.

Therefore a changed tree is always a tree with which the mission could have come up.

The launcher imports this file with the first change: the readers of mission files take 12 MB.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass

from backbone.launcher.messages import (
    AddBranch,
    MoveBranch,
    RemoveBranch,
    ReplaceBranch,
    SetInTree,
    TreeChange,
    TreeInvalid,
    UnknownBehavior,
)
from backbone.launcher.tree_changes import PRIORITY, RUN_TIMES, ChangedMission
from backbone.mission import edit
from backbone.mission.document import parse
from backbone.mission.edit import Element, NewElement, Path
from backbone.mission.reader import read_mission_bytes
from backbone.mission.report import Fault, MissionInvalid, Report
from backbone.mission.tables import parameter_value
from backbone.naming import did_you_mean
from backbone.spoken import counted

SECTION, BEHAVIOR, ARC, PARAMETER = "behaviors", "behavior", "arc", "parameter"


def applied(text: bytes, change: TreeChange, source: str) -> ChangedMission:
    """Return the mission after a change.

    Args:
        text: Content of the mission file before it.
        source: Path of the mission file.

    Raises:
        UnknownBehavior: The tree has no behavior of this name.
        EditRefused: The file cannot be changed so.
        TreeInvalid: The mission would have faults, or the branch is no ``<behavior>``.
    """
    edited = changed(text, change)
    try:
        mission = read_mission_bytes(edited.text, source)
    except MissionInvalid as invalid:
        raise edited.invalid(invalid.faults) from None
    value = None
    if isinstance(change, SetInTree):
        value = parameter_value(written(change.name, change.parameter, change.value))
    return ChangedMission(mission, edited.text, edited.anew, value)


@dataclass(frozen=True, slots=True)
class Branch:
    """A branch as written in its own file.

    Attributes:
        text: Content of the file.
        source: Name of the file, for faults.
        root: Its ``<behavior>``.
    """

    text: bytes
    source: str
    root: Element

    @property
    def name(self) -> str:
        """Name of the root behavior."""
        return self.root.text("name")


@dataclass(frozen=True, slots=True)
class EditedFile:
    """The text of the mission file after a change.

    Attributes:
        text: Content of the whole file.
        anew: Names of behaviors that start again although the tree had such names, because their declarations are new.
        branch: The added branch; None: no branch was added.
    """

    text: bytes
    anew: frozenset[str] = frozenset()
    branch: Branch | None = None

    def invalid(self, faults: Sequence[Fault]) -> TreeInvalid:
        """Return the refusal of this change; a fault in the new branch has its place in the branch's own file."""
        return TreeInvalid("\n".join(map(str, map(self._named, faults))), faults=len(faults))

    def _named(self, fault: Fault) -> Fault:
        if self.branch is None:
            return fault
        root, whole = self.branch.root, edit.outline(self.text)
        here = whole.at(_path_of(whole, self.branch.name))
        line = fault.line - here.place.line + root.place.line
        if (
            not here.place.line
            <= fault.line
            <= here.place.line + self.text.count(b"\n", here.span.begin, here.span.end)
        ):
            return fault
        column = fault.column - here.place.column + root.place.column
        return Fault(self.branch.source, line, max(1, column), fault.message, fault.remedy)


def changed(text: bytes, change: TreeChange) -> EditedFile:
    """Return the text of the mission file after a change.

    Raises:
        UnknownBehavior: The tree has no behavior of this name.
        EditRefused: The file cannot be changed so.
        TreeInvalid: The branch is no ``<behavior>``, or the place is beyond the end.
    """
    match change:
        case AddBranch(parent=parent, place=place):
            branch = _branch(change)
            text, at = _with_section(text) if parent == edit.outline(text).text("name") else (text, None)
            at = _path_of(edit.outline(text), parent) if at is None else at
            number = _number(edit.outline(text).at(at), place)
            return EditedFile(edit.insert(text, at, branch.text, number), frozenset({branch.name}), branch)
        case RemoveBranch(name=name):
            return EditedFile(edit.remove(text, _path_of(edit.outline(text), name)))
        case MoveBranch(name=name, parent=parent, place=place):
            whole = edit.outline(text)
            path = _path_of(whole, name)
            at = _section_of(whole) if parent == whole.text("name") else _path_of(whole, parent)
            return EditedFile(edit.move(text, path, at, _number(whole.at(at), place, without=path)))
        case ReplaceBranch(name=name):
            branch = _branch(change)
            path = _path_of(edit.outline(text), name)
            without = edit.remove(text, path)
            return EditedFile(edit.insert(without, path[:-1], branch.text, path[-1]), frozenset({branch.name}), branch)
        case SetInTree(name=name, parameter=parameter, value=value):
            return EditedFile(_with_value(text, name, parameter, written(name, parameter, value)))


def written(name: str, parameter: str, value: object) -> str:
    """Return a value as written in a mission file.

    Raises:
        TreeInvalid: The value is not text, a number, true or false.
    """
    if isinstance(value, str):
        return value
    if isinstance(value, bool | int | float):
        return json.dumps(value)
    raise TreeInvalid(f"{parameter} of {name} cannot be {value!r}: write a text, a number, true or false")


def _with_value(text: bytes, name: str, parameter: str, value: str) -> bytes:
    whole = edit.outline(text)
    path = _path_of(whole, name)
    node = whole.at(path)
    if parameter == PRIORITY:
        return edit.set_attribute(text, path, PRIORITY, value)
    for number, child in enumerate(node.children):
        if child.tag == ARC and parameter in RUN_TIMES:
            return edit.set_attribute(text, (*path, number), parameter.replace("_", "-"), value)
        if child.tag == PARAMETER and child.text("name") == parameter:
            return edit.set_attribute(text, (*path, number), "value", value)
    if parameter in RUN_TIMES:
        raise TreeInvalid(f"{name} claims no ARC: it has no {parameter}", remedy="Set it at a behavior with an ARC.")
    return edit.add(text, path, NewElement(PARAMETER, {"name": parameter, "value": value}))


def _branch(change: AddBranch | ReplaceBranch) -> Branch:
    data, report = change.branch.encode(), Report(change.source)
    parse(data, report)
    if faults := report.faults():
        raise TreeInvalid("\n".join(map(str, faults)), faults=len(faults))
    root = edit.outline(data)
    if root.tag != BEHAVIOR:
        raise TreeInvalid(f"{change.source}:{root.place.line}:1: a branch is one <{BEHAVIOR}>, not a <{root.tag[:40]}>")
    return Branch(data, change.source, root)


def _with_section(text: bytes) -> tuple[bytes, Path]:
    whole = edit.outline(text)
    if whole.first(SECTION) is None:
        text = edit.add(text, (), NewElement(SECTION))
        whole = edit.outline(text)
    return text, _section_of(whole)


def _section_of(whole: Element) -> Path:
    return next((child.path for child in whole.children if child.tag == SECTION), ())


def _path_of(whole: Element, name: str) -> Path:
    section = whole.first(SECTION)
    behaviors = {} if section is None else {one.text("name"): one.path for one in section if one.tag == BEHAVIOR}
    if name not in behaviors:
        raise UnknownBehavior(f"the tree has no behavior {name!r}{did_you_mean(name, behaviors)}", name=name)
    return behaviors[name]


def _number(parent: Element, place: int, without: Path | None = None) -> int:
    """Convert a place among the behaviors of the parent to a place among all its elements, with ``without`` removed.

    Raises:
        TreeInvalid: The place is beyond the end.
    """
    children = [child for child in parent.children if child.path != without]
    numbers = [number for number, child in enumerate(children) if child.tag == BEHAVIOR]
    if 0 < place <= len(numbers):
        return numbers[place - 1]
    if place > len(numbers) + 1:
        raise TreeInvalid(
            f"place {place} is beyond the end: {parent.text('name') or 'the mission'} has "
            f"{counted(len(numbers), 'other behavior')}",
            remedy=f"Write a place from 1 to {len(numbers) + 1}, or 0 for the last.",
        )
    return numbers[-1] + 1 if numbers else len(children)
