"""The arguments and options of the commands of ``scout-console``."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from backbone.command_line.options import complete_behavior, complete_mission, complete_robot, hub_endpoint, shown_name
from ui_console.model.profile import Profile

LEAST_PRIORITY, MOST_PRIORITY = -(2**31), 2**31 - 1  # as in a mission file
LONGEST_WAIT_S = 86_400.0  # chosen: a day, as in a mission file
SHORTEST_RUNTIME_S = 0.01  # chosen: shorter than a switch


def _named_or_left_out(ctx: typer.Context, parameter: typer.CallbackParam, value: str) -> str:
    """Refuse an empty name, such as that of an unset variable of a shell, which means no robot in particular."""
    source = ctx.get_parameter_source(parameter.name or "")
    if not value and source is not None and source.name == "COMMANDLINE":
        raise typer.BadParameter("the name is empty: name a robot, or leave it out to take any free one")
    return value


_seconds = partial(typer.Option, min=0.0, max=LONGEST_WAIT_S)
_priority = partial(typer.Option, min=LEAST_PRIORITY, max=MOST_PRIORITY)
RECORDING = "this recording instead: play it, go to any time, ask why; nothing needs to be up."

Mission = Annotated[
    str | None,
    typer.Option("--mission", autocompletion=complete_mission, help="Name of a mission that is up on this machine."),
]
Connect = Annotated[
    str | None, typer.Option("--connect", callback=hub_endpoint, help="Hub elsewhere, tcp/HOST:PORT; needs --mission.")
]
User = Annotated[
    str, typer.Option("--user", callback=shown_name, help="Your name in the log; default: the logged-in user.")
]

Robot = Annotated[
    str,
    typer.Argument(
        callback=_named_or_left_out,
        autocompletion=complete_robot,
        help="Robot to take over; none: any free one with a camera.",
    ),
]
Priority = Annotated[int, _priority(help="Compared with the priority of the mission; larger is higher.")]
ProfileName = Annotated[Profile, typer.Option(help="How the console looks.")]
Script = Annotated[str, typer.Option(help="Drive by the JSON lines of this file, '-' for standard input.")]
ScriptAsJson = Annotated[bool, typer.Option("--json", help="JSON lines, no screen; implies --script -.")]
Within = Annotated[float, _seconds(help="Mission seconds a script waits for the grant; 0: for ever.")]
MinimumRuntime = Annotated[float, _seconds(min=SHORTEST_RUNTIME_S, help="Shortest useful time beside equals, seconds.")]
Kind = Annotated[str, typer.Option(help="Kind of ARC; default: the robot's, for what the console shows.")]
AwayAfter = Annotated[
    float, _seconds(help="Give the robot back when no key was pressed for so many seconds; 0: never.")
]
VideoOnly = Annotated[bool, typer.Option("--video-only", help="Begin with the picture alone.")]
Gamepad = Annotated[bool, typer.Option("--gamepad", help="Drive by the gamepad of this machine, too.")]

WatchAsJson = Annotated[bool, typer.Option("--json", help="JSON lines instead of a screen.")]
Once = Annotated[bool, typer.Option("--once", help="All that screens show now, as one JSON object.")]
WatchedRecording = Annotated[Path | None, typer.Option(help=f"Watch {RECORDING}")]
Behavior = Annotated[str, typer.Argument(autocompletion=complete_behavior, help="A behavior of the mission.")]
View = Annotated[str, typer.Argument(help="One of its debug views; none: list them with their newest values.")]
LookAsJson = Annotated[bool, typer.Option("--json", help="The list as one JSON object; a view as JSON lines.")]
Save = Annotated[
    Path | None, typer.Option(help="Save one picture of the view and end.", metavar="FILE.png", dir_okay=False)
]
LooksFor = Annotated[float, _seconds("--for", help="End after so many seconds; 0: at Ctrl-C.")]

Host = Annotated[
    str, typer.Option(help="Address to listen at: this machine only, unless you set another; 0.0.0.0: all.")
]
Port = Annotated[int, typer.Option(min=0, max=65535, help="Port; 0: any that is free.")]
HighestPriority = Annotated[int, _priority(help="Highest priority of an operator, compared with that of the mission.")]
OperatorPriorities = Annotated[
    list[str] | None,
    typer.Option(help="NAME=PRIORITY: a token for this operator alone; again for each. Default: one for all."),
]
Certificate = Annotated[
    str, typer.Option(help="PEM file with a certificate: the page is served over HTTPS.", metavar="FILE")
]
Key = Annotated[
    str, typer.Option(help="PEM file with its key; default: it is in the certificate's file.", metavar="FILE")
]
DesignedFile = Annotated[
    str, typer.Option(help="Serve the designer of this mission file instead; nothing needs to be up.")
]
ServedRecording = Annotated[Path | None, typer.Option(help=f"Serve {RECORDING}")]
ServedKind = Annotated[str, typer.Option(help="Kind of ARC that operators claim; default: the robot's.")]
NewTokens = Annotated[
    bool,
    typer.Option("--new-tokens", help="Forget the tokens of the server before; its open pages do not come back."),
]
PageAwayAfter = Annotated[
    float, _seconds(help="Give a robot back when its operator touched nothing for so many seconds; 0: never.")
]
Missions = Annotated[
    list[str] | None,
    typer.Option(
        autocompletion=complete_mission,
        help="Name of a mission that is up on this machine; again for each of several, each with its own page.",
    ),
]
