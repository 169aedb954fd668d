"""``scout-backbone swap``: exchange a class of a mission that is up.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from typing import Annotated

import typer

from backbone.command_line.at_mission import AtMission
from backbone.command_line.options import complete_exchangeable, named_value, run
from backbone.command_line.where import Where

LONGEST_S = 3_600.0  # chosen: an hour; a longer proof is not useful
PROVE_S = 5.0  # as in exchange
READY_WITHIN_S = 10.0  # as in exchange
SILENT_S = 1.0  # as in exchange


def class_path_of(value: str) -> str:
    """Refuse a text that is neither a class path nor a name; only a built-in driver has a name instead of a path."""
    from backbone.mission.class_paths import CLASS_PATH
    from backbone.naming import is_legal

    if CLASS_PATH.fullmatch(value) is None and not is_legal(value):
        raise typer.BadParameter(f"{value!r} is no class; write package.module:Class")
    return value


@AtMission
def swap(
    where: Where,
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME",
            autocompletion=complete_exchangeable,
            help="A module, a behavior, or a resource: its driver.",
        ),
    ],
    class_path: Annotated[
        str,
        typer.Argument(
            metavar="PACKAGE.MODULE:CLASS",
            callback=class_path_of,
            help="Its new class, or the name of a built-in driver; the file is read anew.",
        ),
    ],
    parameter: Annotated[
        list[str] | None,
        typer.Option("--set", help="NAME=VALUE, value as JSON or text; repeatable. Others stay as they are."),
    ] = None,
    prove_s: Annotated[
        float,
        typer.Option("--prove", min=0.0, max=LONGEST_S, help="Mission seconds for which the old one is kept."),
    ] = PROVE_S,
    ready_within_s: Annotated[
        float,
        typer.Option("--ready-within", min=0.1, max=LONGEST_S, help="Mission seconds to become ready."),
    ] = READY_WITHIN_S,
    silent_s: Annotated[
        float,
        typer.Option(
            "--silent",
            min=0.0,
            max=LONGEST_S,
            help="Modules: mission seconds without an output that the old one has.",
        ),
    ] = SILENT_S,
) -> None:
    """Exchange a module, a behavior or a driver while it runs: the old one comes back if the new one fails (exit 5)."""
    from backbone.command_line.swapping import swap_class
    from backbone.exchange import SwapModule
    from backbone.mission_log.operators import login_name

    values = dict(map(named_value, parameter or []))
    asked = SwapModule(name, class_path, values, prove_s, ready_within_s, silent_s, login_name())
    run(lambda: swap_class(where, asked))
