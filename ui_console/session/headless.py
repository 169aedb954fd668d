"""Consoles without a screen: a script that drives, a monitor with JSON lines, a single view."""

from __future__ import annotations

import asyncio
import sys
from pathlib import Path

from backbone.command_line.unusable_file import unreadable
from backbone.command_line.where import Where
from backbone.component.component import NoParameters
from backbone.launcher.endings import ExitCode, say
from ui_console.model.console import ConsoleModel
from ui_console.model.events import ConsoleEvent, for_scripts
from ui_console.model.script import Step, WrongScript, read_script
from ui_console.model.team import TeamModel
from ui_console.model.views import view_json
from ui_console.session.joining import end_on_signals, join, line_writer, write_line
from ui_console.session.observer import Observer, no_person_here
from ui_console.session.scripted import ScriptDriver, feed_from
from ui_console.session.teleoperation import Teleoperation

STANDARD_INPUT = "-"


async def drive_by_script(where: Where, wished: dict[str, object], user: str, script: str, within_s: float) -> int:
    """Drive a robot by a script; return the command's exit code.

    Args:
        wished: Parameters of ``Teleoperation``.
        user: The driver, for the record.
        script: File of JSON lines; ``-``: standard input.
        within_s: Longest wait for the grant, mission seconds; 0: no limit.

    Raises:
        FileUnusable: The script cannot be read.
    """
    steps: list[Step] | None = None
    try:
        if script != STANDARD_INPUT:
            steps = read_script(await asyncio.to_thread(Path(script).read_text))
    except OSError as error:
        raise unreadable(Path(script), error) from error
    except (UnicodeDecodeError, WrongScript) as error:
        say(f"{script}: {error}")
        return ExitCode.USAGE
    joining = await join(where, wished)
    async with line_writer() as write:
        driver = ScriptDriver(write, steps, within_s=within_s)
        bus = await joining.open_bus()
        console = Teleoperation(
            joining.launch, bus, joining.clock, show=driver.show, work=driver.drive, watches=False, user=user
        )
        if script == STANDARD_INPUT:
            feed_from(sys.stdin.fileno(), driver.feed, driver.cut)
        interrupted = end_on_signals(console)
        await console.run()
    return ExitCode.INTERRUPTED if interrupted() else driver.exit_code(console)


async def watch_as_json(where: Where, user: str) -> int:
    """Write the events as JSON lines until a signal ends it; return the command's exit code."""
    joining = await join(where)
    async with line_writer() as write:

        def show(event: ConsoleEvent) -> None:
            for line in for_scripts(event):
                write(line)

        console: Observer[NoParameters] = Observer(
            joining.launch, await joining.open_bus(), joining.clock, show=show, user=user, answers_of=no_person_here
        )
        interrupted = end_on_signals(console)
        await console.run()
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


async def look_once(where: Where, user: str) -> int:
    """Write the present content of the screens as one JSON object; return the command's exit code."""
    joining = await join(where)
    launch, clock = joining.launch, joining.clock
    model = ConsoleModel(launch.name, user, TeamModel(launch.mission), sees=False)
    console: Observer[NoParameters] = Observer(
        launch, await joining.open_bus(), clock, show=model.apply, signs_in=False
    )
    interrupted = end_on_signals(console)

    async def end_when_listed() -> None:
        await console.feed.listed.wait()
        console.end("all was listed")

    ending = asyncio.create_task(end_when_listed(), name="end when listed")
    try:
        await console.run()
    finally:
        ending.cancel()
    if interrupted():
        return ExitCode.INTERRUPTED
    write_line(view_json(model.view(clock.now_s())))
    return ExitCode.DONE
