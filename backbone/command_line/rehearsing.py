"""``check --dry-run``: prints the predicted placement and schedule of a mission, and writes the trace."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console

from backbone.dry_run.run import FIRST_MINUTE_S, dry_run
from backbone.dry_run.screen import screen
from backbone.launcher.endings import ExitCode, complaint_of, say
from backbone.mission.model import MissionDescription
from backbone.run_files import TraceUnwritable, begin_trace
from backbone.scheduling.own_planner import WrongPlanner


def print_dry_run(
    description: MissionDescription, for_s: float | None, trace: Path | None, width: int | None
) -> ExitCode:
    """Print a dry run, write its trace if a file is named, and return the exit code.

    Args:
        for_s: Mission seconds; None: the first minute.
        trace: File for the trace, which must be new or empty.
        width: Width of tables; None: the terminal's.
    """
    try:
        if trace is not None:
            begin_trace(trace)
        dry = dry_run(description, FIRST_MINUTE_S if for_s is None else for_s)
    except (WrongPlanner, TraceUnwritable) as refused:
        say(complaint_of(refused)[0])
        return ExitCode.REFUSED if isinstance(refused, TraceUnwritable) else ExitCode.MISSION_INVALID
    Console(width=width, markup=False, emoji=False).print(screen(dry))
    if trace is not None:
        try:
            dry.write_trace(trace)
        except OSError as error:
            say(f"the trace cannot be written: {error}")
            return ExitCode.UNEXPECTED
    if not dry.can_come_up:
        say(f"mission {description.name} cannot come up as it is")
        return ExitCode.MISSION_INVALID
    return ExitCode.DONE
