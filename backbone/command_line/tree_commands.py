"""``scout-backbone tree``: show, change and save the behavior tree of a mission that is up.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

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
def add(
    branch: BranchFile,
    below: Annotated[
        str, typer.Option("--below", autocompletion=complete_behavior, help="Its parent; default: it is a root.")
    ] = "",
    place: Annotated[
        int, typer.Option("--place", min=0, max=MOST_PLACES, help="Number among its siblings, from 1; 0: the last.")
    ] = 0,
    seen: Seen = None,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Add a branch to the tree and start it when its parent wants it."""
    from backbone.command_line.tree_orders import add_branch

    where = chosen(mission, connect, secret_file)
    run(lambda: add_branch(where, branch, below, place, seen))


@tree.command()
def remove(
    name: BehaviorName,
    seen: Seen = None,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """End a behavior and its descendants, and remove them from the tree."""
    from backbone.command_line.tree_orders import remove_branch

    where = chosen(mission, connect, secret_file)
    run(lambda: remove_branch(where, name, seen))


@tree.command()
def move(
    name: BehaviorName,
    parent: Annotated[
        str,
        typer.Argument(autocompletion=complete_behavior, help="Its parent from now on; the mission's name: a root."),
    ],
    place: Place = 0,
    seen: Seen = None,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Move a branch; below another parent, it ends and starts again."""
    from backbone.command_line.tree_orders import move_branch

    where = chosen(mission, connect, secret_file)
    run(lambda: move_branch(where, name, parent, place, seen))


@tree.command()
def replace(
    name: BehaviorName,
    branch: BranchFile,
    seen: Seen = None,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """End a behavior and its descendants, and start another branch in its place."""
    from backbone.command_line.tree_orders import replace_branch

    where = chosen(mission, connect, secret_file)
    run(lambda: replace_branch(where, name, branch, seen))


@tree.command(name="set", context_settings={"ignore_unknown_options": True})  # a priority may be below 0
def set_(
    name: BehaviorName,
    parameter: Annotated[
        str, typer.Argument(help="priority, minimum_runtime_s, maximum_runtime_s, or a parameter of the behavior.")
    ],
    value: Annotated[str, typer.Argument(help="The new value, JSON or text.")],
    seen: Seen = None,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Set a value of a behavior, now and for each later start of it."""
    from backbone.command_line.tree_orders import set_value

    where = chosen(mission, connect, secret_file)
    run(lambda: set_value(where, name, parameter, json_or_text(value), seen))


@tree.command()
def save(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="The file; an existing file is replaced as a whole.")],
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Write the mission file with all changes of the tree; comments and order stay."""
    from backbone.command_line.tree_orders import save_tree

    where = chosen(mission, connect, secret_file)
    run(lambda: save_tree(where, file))
