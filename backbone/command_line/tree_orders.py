"""A person's changes to the behavior tree of a mission that is up; the launcher checks and carries them out."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from backbone.addresses import LAUNCHER, NAMESERVER
from backbone.atomic_file import replace_file
from backbone.bus.interface import Bus
from backbone.command_line.connection import REPLY_TIME_S, connected
from backbone.command_line.unusable_file import FileUnusable, unreadable
from backbone.command_line.where import Where
from backbone.component.messages import ComponentState
from backbone.launcher.endings import ExitCode, say, show
from backbone.launcher.messages import (
    AddBranch,
    AskTree,
    MoveBranch,
    RemoveBranch,
    ReplaceBranch,
    SetInTree,
    Tree,
    TreeChange,
    TreeChanged,
)
from backbone.mission.document import Element, outline
from backbone.mission_log.operators import OperatorAction, publish_action
from backbone.mission_log.people import People
from backbone.nameserver.messages import Components, ListComponents
from backbone.naming import Subsystem, component_of
from backbone.spoken import value_text

CHANGED_WITHIN_S = 240.0  # chosen: longer than the longest start of a new root


async def print_tree(where: Where, *, as_json: bool) -> ExitCode:
    """Print the tree with its version, and which of its behaviors run."""
    async with connected(where) as (bus, _):
        tree = await _tree(bus)
        there = (await bus.ask(NAMESERVER, ListComponents(), Components, within_s=REPLY_TIME_S)).components
    whole = outline(tree.text.encode())
    if as_json:
        running = _running(there)
        found = [_plain(node, running) for node in _behaviors(whole.first("behaviors"))]
        show([json.dumps({"mission": whole.text("name"), "version": tree.version, "tree": found})])
        return ExitCode.DONE
    show([f"mission {whole.text('name')}, version {tree.version} of its tree", *tree_lines(whole, there)])
    return ExitCode.DONE


def tree_lines(mission: Element, there: Sequence[ComponentState]) -> list[str]:
    """Return the tree as lines, with the names of people.

    Args:
        mission: The mission file with all changes of its tree.
    """
    lines = _lines(mission.first("behaviors"), _running(there), "  ")
    return [*map(People(there).named, lines)]


async def add_branch(where: Where, file: Path, below: str, place: int, seen: int | None) -> ExitCode:
    """Add the branch in the file, and print the outcome."""
    branch, source = _read(file)
    return await _change(where, seen, lambda now: AddBranch(now.version, below or _mission(now), branch, source, place))


async def remove_branch(where: Where, name: str, seen: int | None) -> ExitCode:
    """Remove the branch, and print the outcome."""
    return await _change(where, seen, lambda now: RemoveBranch(now.version, name), name)


async def move_branch(where: Where, name: str, parent: str, place: int, seen: int | None) -> ExitCode:
    """Move the branch, and print the outcome."""
    return await _change(where, seen, lambda now: MoveBranch(now.version, name, parent, place), name)


async def replace_branch(where: Where, name: str, file: Path, seen: int | None) -> ExitCode:
    """Replace the branch by the one in the file, and print the outcome."""
    branch, source = _read(file)
    return await _change(where, seen, lambda now: ReplaceBranch(now.version, name, branch, source), name)


async def set_value(where: Where, name: str, parameter: str, value: object, seen: int | None) -> ExitCode:
    """Set the value in the tree, and print the outcome."""
    detail = f"{parameter} = {value_text(value)}"
    return await _change(where, seen, lambda now: SetInTree(now.version, name, parameter, value), name, detail)


async def save_tree(where: Where, file: Path) -> ExitCode:
    """Replace the file by the mission file with all changes of the tree.

    Raises:
        FileUnusable: The file cannot be written; its old content is unchanged.
    """
    async with connected(where) as (bus, _):
        tree = await _tree(bus)
    write_mission(file, tree.text.encode())
    say(f"{file}: version {tree.version} of the tree")
    return ExitCode.DONE


def write_mission(file: Path, text: bytes) -> None:
    """Replace the file; a symbolic link is followed.

    Raises:
        FileUnusable: The file cannot be written; its old content is unchanged.
    """
    try:
        replace_file(file.resolve(), text)
    except OSError as error:
        raise FileUnusable(f"{file} cannot be written: {error.strerror or error}") from error


async def _change(
    where: Where, seen: int | None, change: Callable[[Tree], TreeChange], name: str = "", detail: str = ""
) -> ExitCode:
    async with connected(where) as (bus, clock):
        now = await _tree(bus)
        ordered = change(now if seen is None else Tree(seen, now.text))
        done = await bus.ask(LAUNCHER, ordered, TreeChanged, within_s=CHANGED_WITHIN_S)
        if isinstance(ordered, AddBranch):
            name = _name_in(ordered.branch)
        publish_action(bus, clock, OperatorAction.CHANGE_TREE, name, _detail(ordered, detail))
        for remark in done.remarks:
            say(remark)
        show([f"{name}: {_detail(ordered, detail)}; version {done.version} of the tree"])
    return ExitCode.DONE


def _detail(change: TreeChange, detail: str) -> str:
    match change:
        case AddBranch(parent=parent):
            return f"added below {parent}"
        case RemoveBranch():
            return "removed"
        case MoveBranch(parent=parent):
            return f"moved below {parent}"
        case ReplaceBranch(branch=branch):
            return f"replaced by {_name_in(branch)}"
        case SetInTree():
            return detail


async def _tree(bus: Bus) -> Tree:
    return await bus.ask(LAUNCHER, AskTree(), Tree, within_s=REPLY_TIME_S)


def _read(file: Path) -> tuple[str, str]:
    """Return the text of a branch and the name of its file."""
    try:
        data = sys.stdin.buffer.read() if str(file) == "-" else file.read_bytes()
        return data.decode(), "stdin" if str(file) == "-" else str(file)
    except OSError as error:
        raise unreadable(file, error) from error
    except UnicodeDecodeError as error:
        raise FileUnusable(f"{file} is no UTF-8: byte {error.start}") from error


def _name_in(branch: str) -> str:
    """Return the name of the branch, which the launcher has validated already."""
    return outline(branch.encode()).text("name")


def _mission(now: Tree) -> str:
    return outline(now.text.encode()).text("name")


def _behaviors(node: Element | None) -> list[Element]:
    return [] if node is None else node.all("behavior")


def _running(there: Sequence[ComponentState]) -> dict[str, ComponentState]:
    behaviors = [one for one in there if one.address.startswith(f"{Subsystem.MISSION_CONTROL}/")]
    return {component_of(one.address): one for one in behaviors}


def _lines(node: Element | None, running: dict[str, ComponentState], margin: str) -> Iterator[str]:
    for one in _behaviors(node):
        state = running.get(one.text("name"))
        doing = f"{state.host}, process {state.pid}: {state.feedback or state.state}" if state else "not started"
        yield f"{margin}{one.text('name')} ({one.text('type')}, priority {one.text('priority')})  {doing}"
        yield from _lines(one, running, margin + "  ")


def _plain(node: Element, running: dict[str, ComponentState]) -> dict[str, object]:
    state = running.get(node.text("name"))
    return {
        "name": node.text("name"),
        "type": node.text("type"),
        "priority": int(node.text("priority")),
        "host": state.host if state else "",
        "pid": state.pid if state else 0,
        "children": [_plain(child, running) for child in _behaviors(node)],
    }
