"""``scout-backbone tree``: show, change and save the behavior tree of a mission that is up.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from backbone.command_line.at_mission import AtMission
from backbone.command_line.options import (
    AsJson,
    CommandTable,
    Endpoint,
    MissionName,
    SecretFile,
    chosen,
    complete_behavior,
    json_or_text,
    run,
)
from backbone.command_line.where import Where

tree = typer.Typer(
    cls=CommandTable,
    rich_markup_mode=None,
    help="Show, change or save the behavior tree of a mission that is up.",
)

MOST_PLACES = 20_000  # as many elements as a mission file may have

BehaviorName = Annotated[str, typer.Argument(autocompletion=complete_behavior, help="A behavior of the tree.")]
BranchFile = Annotated[Path, typer.Argument(metavar="BRANCH.xml", help="One <behavior> with all in it; '-': stdin.")]
Place = Annotated[int, typer.Argument(min=0, max=MOST_PLACES, help="Number among its siblings, from 1; 0: the last.")]
Seen = Annotated[
    int | None,
    typer.Option("--seen", min=0, max=10**9, help="Refuse unless the tree still has this version."),
]


@tree.callback(invoke_without_command=True)
def show(
    context: typer.Context,
    as_json: AsJson = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Show the behavior tree of a running mission, with its version; or change it, see the commands."""
    if context.invoked_subcommand is not None:
        return
    from backbone.command_line.tree_orders import print_tree

    where = chosen(mission, connect, secret_file)
    run(lambda: print_tree(where, as_json=as_json))


@tree.command()
@AtMission
def add(
    where: Where,
    branch: BranchFile,
    below: Annotated[
        str, typer.Option("--below", autocompletion=complete_behavior, help="Its parent; default: it is a root.")
    ] = "",
    place: Annotated[
        int, typer.Option("--place", min=0, max=MOST_PLACES, help="Number among its siblings, from 1; 0: the last.")
    ] = 0,
    seen: Seen = None,
) -> None:
    """Add a branch to the tree and start it when its parent wants it."""
    from backbone.command_line.tree_orders import add_branch

    run(lambda: add_branch(where, branch, below, place, seen))


@tree.command()
@AtMission
def remove(where: Where, name: BehaviorName, seen: Seen = None) -> None:
    """End a behavior and its descendants, and remove them from the tree."""
    from backbone.command_line.tree_orders import remove_branch

    run(lambda: remove_branch(where, name, seen))


@tree.command()
@AtMission
def move(
    where: Where,
    name: BehaviorName,
    parent: Annotated[
        str,
        typer.Argument(autocompletion=complete_behavior, help="Its parent from now on; the mission's name: a root."),
    ],
    place: Place = 0,
    seen: Seen = None,
) -> None:
    """Move a branch; below another parent, it ends and starts again."""
    from backbone.command_line.tree_orders import move_branch

    run(lambda: move_branch(where, name, parent, place, seen))


@tree.command()
@AtMission
def replace(where: Where, name: BehaviorName, branch: BranchFile, seen: Seen = None) -> None:
    """End a behavior and its descendants, and start another branch in its place."""
    from backbone.command_line.tree_orders import replace_branch

    run(lambda: replace_branch(where, name, branch, seen))


@tree.command(name="set", context_settings={"ignore_unknown_options": True})  # a priority may be below 0
@AtMission
def set_(
    where: Where,
    name: BehaviorName,
    parameter: Annotated[
        str, typer.Argument(help="priority, minimum_runtime_s, maximum_runtime_s, or a parameter of the behavior.")
    ],
    value: Annotated[str, typer.Argument(help="The new value, JSON or text.")],
    seen: Seen = None,
) -> None:
    """Set a value of a behavior, now and for each later start of it."""
    from backbone.command_line.tree_orders import set_value

    run(lambda: set_value(where, name, parameter, json_or_text(value), seen))


@tree.command()
@AtMission
def save(
    where: Where,
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file; an existing file is replaced as a whole.")],
) -> None:
    """Write the mission file with all changes of the tree; comments and order stay."""
    from backbone.command_line.tree_orders import save_tree

    run(lambda: save_tree(where, file))
