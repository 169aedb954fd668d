"""Shared parts of the command lines: options, completion of names, and help with whole summaries.

A completion imports its modules itself, so that ``--help`` stays quick.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup


class WholeHelp(TyperGroup):
    """Lists commands with their whole summaries, which typer cuts at the end of the line."""

    def format_commands(self, ctx: Any, formatter: Any) -> None:
        """Write a row for each command."""
        commands = [(name, self.get_command(ctx, name)) for name in self.list_commands(ctx)]
        rows = [
            (name, _first_paragraph(one.help or "")) for name, one in commands if one is not None and not one.hidden
        ]
        with formatter.section("Commands"):
            formatter.write_dl(rows)


def _first_paragraph(text: str) -> str:
    return " ".join(text.partition("\n\n")[0].split())


ENDPOINT = re.compile(r"(tcp|tls|quic|udp|ws)/[^\s/]+:[0-9]{1,5}([?#]\S*)?|unixsock-stream/\S+")


def hub_endpoint(value: str | None) -> str | None:
    """Refuse a text that is no endpoint of a hub; for options that take an endpoint."""
    if value is not None and ENDPOINT.fullmatch(value) is None:
        raise typer.BadParameter(f"{value!r} is no endpoint; write tcp/HOST:PORT, for example tcp/192.0.2.7:7447")
    return value


def complete_mission() -> list[str]:
    """Return the missions that are up on this machine."""
    from backbone.completion import missions_now

    return missions_now()


def picture_for(ctx: typer.Context) -> Any:
    """Return the picture of the mission that the typed words name; None if it is not up."""
    from backbone.completion import picture_now

    return picture_now(ctx.params.get("mission"), ctx.params.get("connect"), ctx.params.get("secret_file"))


def complete_name(ctx: typer.Context) -> list[str]:
    """Return the names that questions may use in the mission that is up."""
    from backbone.completion import names_of

    picture = picture_for(ctx)
    return names_of(picture) if picture is not None else []


def complete_resource(ctx: typer.Context) -> list[str]:
    """Return the resources of the mission that is up."""
    from backbone.completion import resources_of

    picture = picture_for(ctx)
    return resources_of(picture) if picture is not None else []


def complete_person(ctx: typer.Context) -> list[str]:
    """Return the people at the consoles of the mission that is up."""
    from backbone.completion import people_of

    picture = picture_for(ctx)
    return people_of(picture) if picture is not None else []


MissionFile = Annotated[Path, typer.Argument(help="The mission file.", metavar="MISSION.xml")]
MissionName = Annotated[
    str | None,
    typer.Option("--mission", autocompletion=complete_mission, help="Name of the mission; needed if several are up."),
]
Endpoint = Annotated[
    str | None,
    typer.Option(
        "--connect", callback=hub_endpoint, help="Hub of a mission elsewhere, e.g. tcp/192.0.2.7:7447, with --mission."
    ),
]
SecretFile = Annotated[
    Path | None,
    typer.Option(
        "--secret-file",
        envvar="SCOUT_SECRET_FILE",
        help="File with the mission's secret, with --connect; '-' reads it from standard input.",
    ),
]
NameOrCause = Annotated[
    str,
    typer.Argument(
        autocompletion=complete_name,
        help="A component, resource, host, person or alarm; or a cause as stories show it: rc_manager#112.",
    ),
]
ComponentName = Annotated[str, typer.Argument(autocompletion=complete_name, help="A component of the mission.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def finite(value: float | None) -> float | None:
    """Refuse NaN, which no range refuses; for options with a range."""
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"{value} is no finite number; see the range in --help")
    return value
