"""The command line ``scout-backbone``.

Data goes to stdout, messages to stderr. A command imports its modules itself, so that ``--help`` and ``check`` stay
quick. Exit codes are those of ``ExitCode``.
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Awaitable, Callable
from contextlib import AbstractAsyncContextManager
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any

import typer

from backbone.cli_options import (
    AsJson,
    CommandTable,
    ComponentName,
    Endpoint,
    MissionFile,
    MissionName,
    NameOrCause,
    SecretFile,
    Version,
    complete_name,
    complete_person,
    complete_resource,
    finite,
    hub_endpoint,
)
from backbone.component.log_level import LogLevel
from backbone.endings import ExitCode, complaint_of, say, show
from backbone.errors import BackboneError
from backbone.spoken import counted, value_text

app = typer.Typer(
    cls=CommandTable,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Operate teams of small robots that share scarce hardware.\n\n"
    "Exit codes: 0 done, 1 unexpected, 2 usage, 3 mission file invalid, 4 cannot reach or start the backbone, "
    "5 refused, 6 the mission itself failed, 130 Ctrl-C.",
)

EXPERIMENTS = "mission_control.experiments.cli"
SIMULATION = "resource_pool.simulation.campaign"  # named, as a mission names its classes: imports run downwards only
LONGEST_DRY_RUN_S = 86_400.0  # chosen: a day of the shipped mission takes seconds to compute
LONGEST_MISSION_S = 366 * 86_400.0  # chosen: a year; a longer time is a typing error
MOST_SEEDS = 1_000_000  # chosen: a day of work
LARGEST_SEED = 2**32 - 1  # the limit of numpy
MOST_EVENTS = 10_000  # as in mission_log
LOG_WITHIN_S = 5.0  # chosen: ten thousand events on a slow link
PIPE_WIDTH = 180  # chosen: no table is wider, so files and pipes get whole tables


def main() -> None:
    """Run the command line."""
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(ExitCode.INTERRUPTED)


def run(work: Callable[[], Awaitable[int]]) -> None:
    """Run a command's coroutine and end the process with its exit code; refusals become one line."""
    import asyncio

    import uvloop

    async def guarded() -> int:
        return await work()

    try:
        with asyncio.Runner(loop_factory=uvloop.new_event_loop) as runner:
            code = runner.run(guarded())
    except BackboneError as error:
        line, code = complaint_of(error)
        say(line)
    raise typer.Exit(int(code))


def connected(
    mission: str | None, endpoint: str | None, secret_file: Path | None
) -> AbstractAsyncContextManager[tuple[Any, Any]]:
    """Return a context manager for a bus to a mission that is up, and its clock."""
    from backbone import mission_connection

    if endpoint is not None and mission is None:
        raise typer.BadParameter("--connect needs --mission NAME")
    secret = read_secret_option(secret_file) if endpoint is not None else ""
    return mission_connection.connected(mission, endpoint, f"ui_console/cli-{os.getpid()}", secret)


def read_secret_option(secret_file: Path | None) -> str:
    """Return the secret in the file, or typed without echo for ``-``; empty if no file is named.

    Raises:
        NoSecret: The file or the input holds no secret.
    """
    from getpass import getpass

    from backbone.authentication import read_secret, read_secret_file

    if secret_file is None:
        return ""
    if str(secret_file) != "-":
        return read_secret_file(secret_file)
    return read_secret(getpass("secret of the mission: ") if sys.stdin.isatty() else sys.stdin.readline())


def read_or_exit(mission_file: Path) -> Any:
    """Return the checked mission description, or print every fault and exit with 3."""
    from backbone.mission.reader import MissionInvalid, read_mission

    try:
        return read_mission(mission_file)
    except MissionInvalid as invalid:
        print(invalid)
        raise typer.Exit(int(ExitCode.MISSION_INVALID)) from None


@app.callback()
def _before_each_command(version: Version = False) -> None:
    """Read the options that go before a command."""


@app.command()
def check(
    mission_file: MissionFile,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Also work out placement and the first minute of the schedule.")
    ] = False,
    for_s: Annotated[
        float | None,
        typer.Option(
            "--for", min=0.1, max=LONGEST_DRY_RUN_S, callback=finite, help="Mission seconds of the dry run; or 60."
        ),
    ] = None,
    trace: Annotated[
        Path | None, typer.Option("--trace", help="Write the dry run's scheduling decisions, JSON lines.")
    ] = None,
) -> None:
    """Check a mission file whole: every fault at once as file:line:column. Starts nothing."""
    if not dry_run and (for_s is not None or trace is not None):
        raise typer.BadParameter("--for and --trace need --dry-run")
    description = read_or_exit(mission_file)
    say(
        f"{mission_file}: mission {description.name} is fine: {counted(len(description.resources), 'resource')}, "
        f"{counted(len(description.types), 'component type')} on {counted(len(description.hosts), 'host')}"
    )
    if dry_run:
        raise typer.Exit(int(_rehearse(description, for_s, trace)))


def _rehearse(description: Any, for_s: float | None, trace: Path | None) -> ExitCode:
    """Print a dry run; return the exit code."""
    from rich.console import Console

    from backbone.dry_run import FIRST_MINUTE_S, dry_run
    from backbone.dry_run_screen import screen
    from backbone.scheduling.own_planner import WrongPlanner

    try:
        dry = dry_run(description, FIRST_MINUTE_S if for_s is None else for_s)
    except WrongPlanner as refused:
        say(f"{refused} (remedy: {refused.remedy})")
        return ExitCode.MISSION_INVALID
    Console(width=_width(), markup=False, emoji=False).print(screen(dry))
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


@app.command()
def schema() -> None:
    """Print the XML schema of mission files."""
    from backbone.mission.declaration.xsd import xsd_text

    print(xsd_text())


@app.command()
def up(
    mission_file: MissionFile,
    headless: Annotated[bool, typer.Option("--headless", help="No live picture; one line a step.")] = False,
    detach: Annotated[bool, typer.Option("--detach", help="Return when all is ready; the mission goes on.")] = False,
    speed: Annotated[
        float, typer.Option("--speed", min=0.01, max=100.0, callback=finite, help="Mission seconds a second.")
    ] = 1.0,
    trace: Annotated[Path | None, typer.Option("--trace", help="Write every scheduling decision, JSON lines.")] = None,
    for_s: Annotated[
        float | None,
        typer.Option("--for", min=0.0, max=LONGEST_MISSION_S, callback=finite, help="End after these mission seconds."),
    ] = None,
    tell_fd: Annotated[int | None, typer.Option("--tell-fd", hidden=True)] = None,
) -> None:
    """Bring a mission up; it ends cleanly on Ctrl-C or 'scout-backbone down'."""
    description = read_or_exit(mission_file)
    if detach:
        from backbone.detached import up_detached

        raise typer.Exit(up_detached(description.name, mission_file, speed=speed, trace=trace, for_s=for_s))
    from backbone.core_launches import UpOptions
    from backbone.mission_console import bring_up_on_console
    from backbone.verdict import VerdictPipe

    options = UpOptions(speed=speed, trace=trace, for_s=for_s)
    verdict = VerdictPipe(os.fdopen(tell_fd, "w", encoding="utf-8")) if tell_fd is not None else None
    run(lambda: bring_up_on_console(description, options, live=not headless and sys.stdout.isatty(), verdict=verdict))


@app.command()
def status(
    as_json: AsJson = False,
    watch: Annotated[bool, typer.Option("--watch", help="Keep showing it.")] = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Show health, components by subsystem, who holds which resource, and the schedule; 6 if the mission failed."""

    async def work() -> int:
        from backbone.status import Shown, show_status

        if connect is not None and mission is None:
            raise typer.BadParameter("--connect needs --mission NAME")
        source = f"ui_console/cli-{os.getpid()}"
        secret = read_secret_option(secret_file) if connect is not None else ""
        return await show_status(mission, connect, source, Shown(as_json=as_json, watch=watch, width=_width()), secret)

    run(work)


@app.command()
def why(
    name: NameOrCause,
    as_json: AsJson = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Explain why a request waits or runs, until when, and why a component is on its host."""

    async def work() -> int:
        from backbone.picture.reasons import reasons_for

        async with connected(mission, connect, secret_file) as (bus, clock):
            reasons = await reasons_for(bus, name, clock)
            show([json.dumps(reasons.to_json())] if as_json else reasons.lines(clock.now_s()))
        return ExitCode.DONE

    run(work)


@app.command()
def story(
    name: NameOrCause,
    as_json: AsJson = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Print the events about a component, request or resource, with their causes."""

    async def work() -> int:
        from backbone.log_lines import story_json, story_lines
        from backbone.picture.reasons import story_of

        async with connected(mission, connect, secret_file) as (bus, clock):
            found = await story_of(bus, name, clock)
        events = [*map(found.people.named_event, found.events)]
        show([json.dumps(story_json(name, found.events, found.missing))] if as_json else story_lines(events))
        if not found.events:
            say(f"no component has an event about {name}")
        if found.missing:
            say(f"incomplete: {counted(len(found.missing), 'component')} did not answer")
            for missing in found.missing:
                say(f"  {missing}")
        return ExitCode.DONE

    run(work)


@app.command()
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

    async def work() -> int:
        from datetime import datetime

        from backbone.log_lines import log_json, log_lines
        from backbone.log_question import LogQuestion
        from backbone.mission_log import Log
        from backbone.moments import Now
        from backbone.naming import LAUNCHER

        async with connected(mission, connect, secret_file) as (bus, clock):
            now = Now(clock.now_s(), datetime.now(), clock.rate)
            asked = LogQuestion(text, robot, person, level, since, until).asked(now, most)
            kept = await bus.ask(LAUNCHER, asked, Log, within_s=LOG_WITHIN_S)
        show([json.dumps(log_json(kept, now))] if as_json else log_lines(kept, now))
        if not kept.events:
            say("no event matches")
        if kept.left_out:
            say(f"{counted(kept.left_out, 'older event')} left out; see --most and --until")
        if kept.since_s > asked.since_s:
            say(f"events before {kept.since_s:.1f} s are no longer kept")
        return ExitCode.DONE

    run(work)


@app.command()
def start(
    type_: Annotated[str, typer.Argument(metavar="TYPE", help="Component type of the mission.")],
    name: Annotated[str, typer.Option("--name", help="Name; default: numbered by the placer.")] = "",
    host: Annotated[str, typer.Option("--host", help="The only possible host.")] = "",
    parameter: Annotated[
        list[str] | None, typer.Option("--parameter", help="NAME=VALUE, value as JSON or text; repeatable.")
    ] = None,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Start one more component through the placer."""
    parameters = dict(_parameter(given) for given in parameter or [])

    async def work() -> int:
        from backbone.naming import component_of
        from backbone.operators import OperatorAction, publish_action
        from backbone.placer.messages import ADDRESS, Start, Started
        from backbone.placer.wishes import START_WITHIN_S
        from backbone.start_by_hand import completed

        async with connected(mission, connect, secret_file) as (bus, clock):
            order, remark = await completed(bus, Start(type_, name, parameters, host))
            started = await bus.ask(ADDRESS, order, Started, within_s=START_WITHIN_S)
            if remark:
                say(remark)
            publish_action(bus, clock, OperatorAction.START_COMPONENT, component_of(started.address), f"a {type_}")
            show([f"{started.address} on {started.host}, process {started.pid}"])
            for reason in started.reasons:
                say(reason)
        return ExitCode.DONE

    run(work)


@app.command()
def stop(
    name: ComponentName,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Stop one component; it is not restarted."""

    async def work() -> int:
        from backbone.operators import OperatorAction, publish_action
        from backbone.placer.messages import ADDRESS, Ended, StopComponent

        async with connected(mission, connect, secret_file) as (bus, clock):
            ended = await bus.ask(ADDRESS, StopComponent(name, "by command"), Ended, within_s=20.0)
            publish_action(bus, clock, OperatorAction.STOP_COMPONENT, name, f"ended by {ended.by}")
            show([f"{name} ended by {ended.by}"])
        return ExitCode.DONE

    run(work)


@app.command(name="set", context_settings={"ignore_unknown_options": True})  # a priority may be below 0
def set_(
    name: Annotated[
        str,
        typer.Argument(
            autocompletion=complete_name, help="A component, an ARC, a console, or a node of the behavior tree."
        ),
    ],
    parameter: Annotated[
        str | None,
        typer.Argument(help="priority, parent, minimum_runtime_s, maximum_runtime_s, or a parameter of the component."),
    ] = None,
    value: Annotated[str | None, typer.Argument(help="The new value, JSON or text; left out: show it.")] = None,
    as_json: AsJson = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Set priority, parent or a run time of an owner of ARCs, or any parameter; without a value show it."""
    if value is not None and as_json:
        raise typer.BadParameter("--json shows attributes; leave the value out")

    async def work() -> int:
        from backbone.attributes import attributes_of, change
        from backbone.operators import OperatorAction, login_name, publish_action

        async with connected(mission, connect, secret_file) as (bus, clock):
            if parameter is not None and value is not None:
                lines = await change(bus, name, parameter, _value(value), login_name())
                publish_action(
                    bus, clock, OperatorAction.SET_PARAMETER, name, f"{parameter} = {value_text(_value(value))}"
                )
            else:
                shown = await attributes_of(bus, name)
                if as_json:
                    lines = [json.dumps(shown.to_json())]
                else:
                    lines = shown.lines() if parameter is None else shown.of(parameter)
            show(lines)
        return ExitCode.DONE

    run(work)


@app.command()
def down(mission: MissionName = None) -> None:
    """Stop a mission of this machine in reverse order: ask, then SIGTERM, then SIGKILL; says which was needed."""

    async def work() -> int:
        from backbone.detached import take_down

        return await take_down(mission)

    run(work)


@app.command()
def creator(
    host: Annotated[str, typer.Option("--host", help="Name of this machine in the mission.")],
    connect: Annotated[str, typer.Option("--connect", callback=hub_endpoint, help="The mission's hub, tcp/HOST:PORT.")],
    mission: Annotated[str, typer.Option("--mission", help="Name of the mission.")],
    secret_file: SecretFile = None,
    tag: Annotated[list[str] | None, typer.Option("--tag", help="A tag of this machine; repeatable.")] = None,
) -> None:
    """Offer this machine to a mission until it ends, or until Ctrl-C: its placer may start components here."""

    async def work() -> int:
        from backbone.creator.kept_creator import Offered
        from backbone.creator.offer import Offering

        offered = Offered(mission, connect, host, tuple(tag or []), read_secret_option(secret_file))
        is_file = secret_file is not None and str(secret_file) != "-"
        say(f"{host} is offered to mission {mission}; end with Ctrl-C")
        await Offering(offered, say, secret_file if is_file else None).run()
        return ExitCode.DONE

    run(work)


@app.command()
def simulate(
    seeds: Annotated[int, typer.Option("--seeds", min=1, max=MOST_SEEDS, help="How many missions.")] = 100,
    first: Annotated[int, typer.Option("--first", min=0, max=LARGEST_SEED, help="Seed of the first.")] = 0,
    chaos: Annotated[
        bool, typer.Option("--chaos", help="Lose and delay messages; pause, end and starve processes; cut links.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Run missions of random shape in one process on virtual time; report the first broken law with its seed."""
    campaign = import_module(SIMULATION)
    outcome = campaign.simulate(first, seeds, chaos=chaos, tell=say)
    print(json.dumps(outcome.to_json()) if as_json else outcome.summary())
    if outcome.finding is not None:
        for line in outcome.finding.lines():
            say(line)
        raise typer.Exit(int(ExitCode.MISSION_FAILED))


@app.command(add_help_option=False, context_settings={"allow_extra_args": True, "ignore_unknown_options": True})
def experiment(context: typer.Context) -> None:
    """Run the papers' experiments on simulated robots: 'surveillance', 'load'; see 'experiment --help'."""
    import_module(EXPERIMENTS).run(context.args)


def _width() -> int | None:
    """Return the width of tables; None: the terminal's."""
    return None if sys.stdout.isatty() else PIPE_WIDTH


def _parameter(given: str) -> tuple[str, Any]:
    name, equals, value = given.partition("=")
    if not equals or not name:
        raise typer.BadParameter(f"{given!r} is not NAME=VALUE")
    return name, _value(value)


def _value(text: str) -> Any:
    try:
        return json.loads(text)
    except json.JSONDecodeError:
        return text


if __name__ == "__main__":
    main()
