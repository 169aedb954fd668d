"""``scout-backbone`` ``why``, ``story``, ``log``: reasons and events of a mission that is up.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from typing import Annotated

import typer

from backbone.command_line.options import (
    AsJson,
    Endpoint,
    MissionName,
    NameOrCause,
    SecretFile,
    chosen,
    complete_person,
    complete_resource,
    run,
)
from backbone.component.log_level import LogLevel

MOST_EVENTS = 10_000  # as in mission_log


def why(
    name: NameOrCause,
    as_json: AsJson = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Explain why a request waits or runs, until when, and why a component is on its host."""
    from backbone.command_line.asking import print_reasons

    where = chosen(mission, connect, secret_file)
    run(lambda: print_reasons(where, name, as_json=as_json))


def story(
    name: NameOrCause,
    as_json: AsJson = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Print the events about a component, request or resource, with their causes."""
    from backbone.command_line.asking import print_story

    where = chosen(mission, connect, secret_file)
    run(lambda: print_story(where, name, as_json=as_json))


def log(
    since: Annotated[
        str, typer.Option("--since", help="Not before: 5m (s, m, h, d ago), 14:05 (time of day), 123.4 (mission time).")
    ] = "0",
    until: Annotated[str, typer.Option("--until", help="Not after; as --since.")] = "",
    robot: Annotated[
        str, typer.Option("--robot", autocompletion=complete_resource, help="Only events about this robot, or name.")
    ] = "",
    person: Annotated[
        str, typer.Option("--person", autocompletion=complete_person, help="Only actions and mentions of this person.")
    ] = "",
    level: Annotated[LogLevel, typer.Option("--level", help="Only events of at least this level.")] = LogLevel.INFO,
    text: Annotated[str, typer.Option("--text", help="Only events that contain this text.")] = "",
    most: Annotated[
        int, typer.Option("--most", min=1, max=MOST_EVENTS, help="Largest number of events, the newest.")
    ] = 1_000,
    as_json: AsJson = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Print the events of the mission and the actions of people: the newest that match, oldest first."""
    from backbone.command_line.asking import print_log
    from backbone.mission_log.question import LogQuestion

    where, question = chosen(mission, connect, secret_file), LogQuestion(text, robot, person, level, since, until)
    run(lambda: print_log(where, question, most, as_json=as_json))
