"""A draft as styled lines: the tree, the properties of one element, problems, the first minute.

Pure: a draft in, rich texts out.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

from rich.text import Text

from backbone.dry_run import DryRun
from backbone.dry_run_screen import KEYS, NO_KEY, bars
from backbone.mission.edit import Node, Path
from backbone.mission.reader import Fault
from backbone.spoken import counted
from ui_console.design.draft import Draft
from ui_console.design.properties import Property
from ui_console.terminal.lines import Row

NAME_COLUMNS = 22
TAG_STYLES = {"behavior": "bold green", "arc": "cyan", "wish": "cyan", "resource": "bold yellow", "type": "magenta"}
FAULT = ("✗ ", "bold red")


def key_of(path: Path) -> str:
    """Return the row key of an element."""
    return "/".join(map(str, path)) or "root"


def path_of(key: str) -> Path:
    """Return the element of a row key."""
    return () if key in ("", "root") else tuple(map(int, key.split("/")))


def tree_rows(draft: Draft, folded: Collection[str] = ()) -> list[Row]:
    """Return one row for each element but parameters, which are among the properties; wrong ones are marked.

    Args:
        draft: The draft.
        folded: Tags of sections of which only the first line is shown.
    """
    wrong = {draft.element_of(fault) for fault in draft.problems}
    rows = []
    for node in draft.mission:
        is_folded = bool(node.path) and draft.mission.at(node.path[:1]).tag in folded
        if node.tag == "parameter" or (is_folded and len(node.path) > 1):
            continue
        inside = {child.path for child in (node if is_folded else node.all("parameter"))}
        text = Text("  " * len(node.path))
        if node.path in wrong or inside & wrong:
            text.append(*FAULT)
        text.append(node.tag, TAG_STYLES.get(node.tag, "bold" if len(node.path) <= 1 else ""))
        text.append(f" … {len(node.children)}" if is_folded else f" {summary(node)}", "dim" if is_folded else "")
        rows.append(Row(key_of(node.path), node.text("name"), text))
    return rows


def summary(node: Node) -> str:
    """Return what tells an element from its siblings, in a few words."""
    words = [node.text(name) for name in ("name", "type", "kind") if node.text(name)]
    if node.tag in ("wish", "uses"):
        words = [part for part in (node.text("type"), node.text("name"), node.text("features")) if part]
    if node.text("priority"):
        words.append(f"priority {node.text('priority')}")
    if node.text("minimum-runtime-s"):
        words.append(f"at least {node.text('minimum-runtime-s')} s")
    if node.text("x-m"):
        words.append(f"at {node.text('x-m')}, {node.text('y-m')}")
    if node.text("width-m") and not node.text("x-m"):
        words.append(f"{node.text('width-m')} m × {node.text('depth-m')} m")
    return " ".join(words)


def property_rows(found: Sequence[Property]) -> list[Row]:
    """Return a row for each property; what is only a default is dim, what is missing red."""
    rows = []
    for one in found:
        text = Text(f"{one.name:<{NAME_COLUMNS}} ", style="" if not one.is_parameter else "italic")
        if one.value is not None:
            text.append(one.value, "bold")
        elif one.is_missing:
            text.append("missing", "bold red")
        else:
            text.append(one.default if one.default is not None else "-", "dim")
        rows.append(Row(("parameter " if one.is_parameter else "") + one.name, one.name, text))
    return rows


def problem_rows(problems: Sequence[Fault]) -> list[Row]:
    """Return a row for each problem, as ``scout-backbone check`` tells it, without the file's name."""
    return [
        Row(
            str(number),
            "",
            Text.assemble((f"{one.line}:{one.column} ", "dim"), (one.message, "red"), f" ({one.remedy})"),
        )
        for number, one in enumerate(problems)
    ]


def rehearsal_rows(dry: DryRun) -> list[Row]:
    """Return who runs when in the first minute, a bar each, and who never does and why."""
    keys = {claimed.arc: key for claimed, key in zip(dry.claimed, [*KEYS, *NO_KEY * len(dry.claimed)], strict=False)}
    widest = max((len(name) for name in bars(dry, keys)), default=0)
    rows = [
        Row(f"bar {name}", name, Text(f"{keys.get(name, ' ')} {name:<{widest}} {bar}", no_wrap=True))
        for name, bar in bars(dry, keys).items()
    ]
    for one in dry.claimed:
        if one.never_runs:
            reason = one.refused or "nothing of what it needs is ever left over"
            rows.append(Row(f"never {one.arc}", one.arc, Text(f"{one.arc} never runs: {reason}", style="bold red")))
        else:
            told = f"{counted(one.turns, 'turn')}, longest wait {one.worst_wait_s:.1f} s, with {', '.join(one.rcs)}"
            rows.append(Row(f"turns {one.arc}", one.arc, Text(f"{one.arc}: {told}")))
    homeless = [placed for placed in dry.placed if not placed.host]
    rows += [
        Row(f"host {one.name}", one.name, Text(f"{one.name} has no host: {'; '.join(one.reasons)}", style="bold red"))
        for one in homeless
    ]
    return rows
