"""``scout-backbone`` ``why``, ``story``, ``log``: reasons and events of a mission that is up.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from typing import Annotated

import typer

from backbone.command_line.at_mission import AtMission
from backbone.command_line.options import AsJson, NameOrCause, complete_person, complete_resource, run
from backbone.command_line.where import Where
from backbone.component.log_level import LogLevel

MOST_EVENTS = 10_000  # as in mission_log


@AtMission
def why(where: Where, name: NameOrCause, as_json: AsJson = False) -> None:
    """Explain why a request waits or runs, until when, and why a component is on its host."""
    from backbone.command_line.asking import print_reasons

    run(lambda: print_reasons(where, name, as_json=as_json))


@AtMission
def story(where: Where, name: NameOrCause, as_json: AsJson = False) -> None:
    """Print the events about a component, request or resource, with their causes."""
    from backbone.command_line.asking import print_story

    run(lambda: print_story(where, name, as_json=as_json))


@AtMission
def log(
    where: Where,
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
) -> None:
    """Print the events of the mission and the actions of people: the newest that match, oldest first."""
    from backbone.command_line.asking import print_log
    from backbone.mission_log.question import LogQuestion

    question = LogQuestion(text, robot, person, level, since, until)
    run(lambda: print_log(where, question, most, as_json=as_json))
