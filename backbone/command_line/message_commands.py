"""``scout-backbone`` ``watch``, ``top``, ``inject``: the messages of a mission that is up.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from typing import Annotated

import typer

from backbone.command_line.at_mission import AtMission
from backbone.command_line.options import MOST_LINES, AsJson, For, run
from backbone.command_line.where import Where

KeyGlobs = Annotated[
    list[str] | None,
    typer.Argument(metavar="KEY…", help="Keys or patterns, as 'resource_pool/*/readings'; default: all."),
]


@AtMission
def watch(
    where: Where,
    keys: KeyGlobs = None,
    field: Annotated[str, typer.Option("--field", help="Only this field, as 'x_m' or 'rcs.0.rc'.")] = "",
    rate: Annotated[
        bool, typer.Option("--rate", help="Rates and sizes each second instead, as 'top' prints them.")
    ] = False,
    most: Annotated[
        int | None, typer.Option("--most", min=1, max=MOST_LINES, help="End after so many messages.")
    ] = None,
    for_s: For = None,
    as_json: AsJson = False,
) -> None:
    """Print the messages at these keys of a mission that is up, questions and answers too, until Ctrl-C."""
    from backbone.command_line import watching
    from backbone.operating_system.own_process import go_behind_others

    wanted = watching.Watched(tuple(keys or ()), field, most, for_s, as_json)
    go_behind_others()
    run(lambda: watching.top(where, wanted, once=False) if rate else watching.watch(where, wanted))


@AtMission
def top(
    where: Where,
    keys: KeyGlobs = None,
    for_s: Annotated[float, typer.Option("--for", min=0.1, max=1e6, help="Seconds to listen.")] = 2.0,
    as_json: AsJson = False,
) -> None:
    """Print rates and sizes of the keys of a mission that is up, the busiest first."""
    from backbone.command_line import watching
    from backbone.operating_system.own_process import go_behind_others

    wanted = watching.Watched(tuple(keys or ()), for_s=for_s, as_json=as_json)
    go_behind_others()
    run(lambda: watching.top(where, wanted, once=True))


@AtMission
def inject(
    where: Where,
    key: Annotated[str, typer.Argument(metavar="KEY", help="As 'watch' prints it; a question's ends with '/ask'.")],
    message: Annotated[str, typer.Argument(metavar="JSON", help="An object with 'schema' and the message's fields.")],
    within_s: Annotated[
        float, typer.Option("--within", min=0.1, max=600.0, help="Seconds to wait for the answer to a question.")
    ] = 5.0,
) -> None:
    """Send a message on the bus of a mission that is up, checked against its schema; the log names its sender."""
    from backbone.command_line.injecting import inject as inject_message

    run(lambda: inject_message(where, key, message, within_s))
