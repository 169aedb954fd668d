"""The command line ``scout-backbone``.

Rules of this file: it declares commands and decides nothing. A command imports the one module that does its work, so
that ``--help`` and ``check`` stay quick. Data goes to stdout, messages to stderr. Exit codes are those of ``ExitCode``.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Annotated, Any, cast

import typer

from backbone.command_line.asking_commands import log, story, why
from backbone.command_line.at_mission import AtMission
from backbone.command_line.message_commands import inject, top, watch
from backbone.command_line.module_commands import swap
from backbone.command_line.options import (
    AsJson,
    CommandTable,
    ComponentName,
    MissionFile,
    MissionName,
    SecretFile,
    Version,
    complete_name,
    complete_resource,
    complete_type,
    hub_endpoint,
    json_or_text,
    legal_name,
    legal_names,
    named_value,
    run,
    run_table,
    shown_name,
)
from backbone.command_line.recording_commands import compare, record, recording, replay
from backbone.command_line.standard_streams import can_redraw
from backbone.command_line.tool_commands import bridge, metrics
from backbone.command_line.tree_commands import tree
from backbone.command_line.unusable_file import open_output
from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode, say, show
from backbone.spoken import counted

app = typer.Typer(
    cls=CommandTable,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    help="Operate teams of small robots that share scarce hardware.\n\n"
    "Exit codes: 0 done, 1 unexpected, 2 usage, 3 mission file invalid, 4 cannot reach or start the backbone, "
    "5 refused, 6 the mission itself failed, 130 Ctrl-C.",
)

# Named as text, as a mission names its classes, because imports run downwards only.
EXPERIMENTS = "mission_control.laboratory.experiments.cli"
SIMULATION = "mission_control.laboratory.simulation.campaign"
LONGEST_DRY_RUN_S = 86_400.0  # chosen: a day of the shipped mission takes seconds to compute
LONGEST_MISSION_S = 366 * 86_400.0  # chosen: a year; a longer time is a typing error
MOST_SEEDS = 1_000_000  # chosen: a day of work
LARGEST_SEED = 2**32 - 1  # the limit of numpy
PIPE_WIDTH = 180  # chosen: no table is wider, so files and pipes get whole tables


def main() -> None:
    """Run the command line."""
    run_table(app)


def or_exit(read: Callable[[], tuple[Any, bytes]]) -> tuple[Any, bytes]:
    """Return the checked mission description and the file's text, or print every fault and exit with 3."""
    from backbone.mission.report import MissionInvalid

    try:
        return read()
    except MissionInvalid as invalid:
        show(map(str, invalid.faults))
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
        typer.Option("--for", min=0.1, max=LONGEST_DRY_RUN_S, help="Mission seconds of the dry run; or 60."),
    ] = None,
    trace: Annotated[
        Path | None, typer.Option("--trace", help="Write the dry run's scheduling decisions, JSON lines.")
    ] = None,
) -> None:
    """Check a mission file whole: every fault at once as file:line:column. Starts nothing."""
    if not dry_run and (for_s is not None or trace is not None):
        raise typer.BadParameter("--for and --trace need --dry-run")
    from backbone.mission.reader import read_written_mission

    description, _ = or_exit(lambda: read_written_mission(mission_file, say))
    say(
        f"{mission_file}: mission {description.name} is fine: {counted(len(description.resources), 'resource')}, "
        f"{counted(len(description.types), 'component type')} on {counted(len(description.hosts), 'host')}"
        + (f"; last branch {last.behavior.name}, within {last.within_s:g} s" if (last := description.last) else "")
    )
    if dry_run:
        from backbone.command_line.rehearsing import print_dry_run

        raise typer.Exit(int(print_dry_run(description, for_s, trace, _width())))


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
    speed: Annotated[float, typer.Option("--speed", min=0.01, max=100.0, help="Mission seconds a second.")] = 1.0,
    trace: Annotated[Path | None, typer.Option("--trace", help="Write every scheduling decision, JSON lines.")] = None,
    for_s: Annotated[
        float | None,
        typer.Option("--for", min=0.0, max=LONGEST_MISSION_S, help="End after these mission seconds."),
    ] = None,
    record_to: Annotated[
        Path | None, typer.Option("--record", metavar="FILE.mcap", help="Record all from the first message on.")
    ] = None,
    pack: Annotated[
        int | None,
        typer.Option(
            "--pack",
            metavar="N",
            min=0,
            max=64,
            help="Pack components into N processes a host; 0: each has its own. Left out: where a host has many of one "
            "type, these share some.",
        ),
    ] = None,
    tell_fd: Annotated[int | None, typer.Option("--tell-fd", hidden=True)] = None,
) -> None:
    """Bring a mission up; it ends cleanly on Ctrl-C or 'scout-backbone down'."""
    from backbone.mission.reading_apart import begin_reading

    finish_reading = begin_reading(mission_file)
    if not detach:  # in the time in which the child reads
        from backbone.command_line.mission_console import bring_up_on_console
        from backbone.launcher.verdict import VerdictPipe
    from backbone.launcher.core_launches import UpOptions

    description, text = or_exit(finish_reading)
    options = UpOptions(speed=speed, trace=trace, for_s=for_s, text=text, record=record_to, pack=pack)
    if detach:
        from backbone.launcher.detached import up_detached

        raise typer.Exit(up_detached(description.name, mission_file, options))
    live = not headless and can_redraw()
    verdict = VerdictPipe(open_output(tell_fd)) if tell_fd is not None else None
    run(lambda: bring_up_on_console(description, options, live=live, verdict=verdict))


@app.command()
@AtMission
def status(
    where: Where,
    as_json: AsJson = False,
    watch: Annotated[bool, typer.Option("--watch", help="Keep showing it.")] = False,
) -> None:
    """Show health, components by subsystem, who holds which resource, and the schedule; 6 if the mission failed."""
    from backbone.command_line.status import Display, JsonLines, show_status

    display = cast("Display", JsonLines())
    if not as_json:
        from backbone.command_line.tables import MissionTables

        display = MissionTables(_width())
    run(lambda: show_status(where, display, watch=watch))


@app.command()
@AtMission
def components(
    where: Where,
    type_: Annotated[
        str,
        typer.Option(
            "--type", metavar="TYPE", autocompletion=complete_type, help="Only this type, with commands and reports."
        ),
    ] = "",
    as_json: AsJson = False,
) -> None:
    """Show the component types of the mission: class, needs, numbers allowed and running; with --type the abilities."""
    from backbone.command_line.inventory import print_types

    run(lambda: print_types(where, type_, as_json=as_json, width=_width()))


@app.command()
@AtMission
def resources(
    where: Where,
    name: Annotated[str, typer.Argument(autocompletion=complete_resource, help="Only this resource.")] = "",
    changes: Annotated[
        bool, typer.Option("--changes", help="Also the shares before and after each of the last re-plannings.")
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Show the resources: host, capacity, holder, utilization over 1 and 10 minutes."""
    from backbone.command_line.inventory import print_resources

    run(lambda: print_resources(where, name, changes=changes, as_json=as_json, width=_width()))


@app.command()
@AtMission
def load(
    where: Where,
    for_s: Annotated[float, typer.Option("--for", min=0.1, max=3600.0, help="Seconds between the two readings.")] = 1.0,
    as_json: AsJson = False,
) -> None:
    """Show the processor time of each robot, each module and each process."""
    from backbone.command_line.load_table import print_loads

    run(lambda: print_loads(where, for_s, as_json=as_json, width=_width()))


app.command()(why)
app.command()(story)
app.command()(log)


@app.command()
@AtMission
def start(
    where: Where,
    type_: Annotated[
        str, typer.Argument(metavar="TYPE", autocompletion=complete_type, help="Component type of the mission.")
    ],
    name: Annotated[str, typer.Option("--name", help="Name; default: numbered by the placer.")] = "",
    host: Annotated[str, typer.Option("--host", help="The only possible host.")] = "",
    parameter: Annotated[
        list[str] | None, typer.Option("--parameter", help="NAME=VALUE, value as JSON or text; repeatable.")
    ] = None,
) -> None:
    """Start one more component through the placer."""
    from backbone.command_line.ordering import start_component
    from backbone.placer.messages import Start

    order = Start(type_, name, dict(map(named_value, parameter or [])), host)
    run(lambda: start_component(where, order))


@app.command()
@AtMission
def stop(where: Where, name: ComponentName) -> None:
    """Stop one component; it is not restarted."""
    from backbone.command_line.ordering import stop_component

    run(lambda: stop_component(where, name))


@app.command(name="set", context_settings={"ignore_unknown_options": True})  # a priority may be below 0
@AtMission
def set_(
    where: Where,
    name: Annotated[
        str,
        typer.Argument(
            callback=shown_name,
            autocompletion=complete_name,
            help="A component, an ARC, a console, or a node of the behavior tree.",
        ),
    ],
    parameter: Annotated[
        str | None,
        typer.Argument(help="priority, parent, minimum_runtime_s, maximum_runtime_s, or a parameter of the component."),
    ] = None,
    value: Annotated[str | None, typer.Argument(help="The new value, JSON or text; left out: show it.")] = None,
    as_json: AsJson = False,
) -> None:
    """Set priority, parent or a run time of an owner of ARCs, or any parameter; without a value show it."""
    if value is not None and as_json:
        raise typer.BadParameter("--json shows attributes; leave the value out")
    if value is None and parameter is not None and "=" in parameter:
        raise typer.BadParameter(f"write the value apart: set {name} {parameter.replace('=', ' ', 1)}")

    from backbone.command_line.ordering import print_attributes, set_attribute

    if parameter is not None and value is not None:
        run(lambda: set_attribute(where, name, parameter, json_or_text(value)))
    run(lambda: print_attributes(where, name, parameter, as_json=as_json))


app.command()(swap)
app.add_typer(tree, name="tree")
app.add_typer(record, name="record")
app.add_typer(recording, name="recording")
app.command()(watch)
app.command()(top)
app.command()(inject)
app.command()(replay)
app.command()(compare)
app.command()(bridge)
app.command()(metrics)


@app.command()
def down(
    now: Annotated[bool, typer.Option("--now", help="Without the last branch; a second 'down' ends it, too.")] = False,
    mission: MissionName = None,
) -> None:
    """Stop a mission of this machine: its last branch, then all; ask, SIGTERM, then SIGKILL; print which was needed."""
    from backbone.launcher.detached import take_down

    run(lambda: take_down(mission, at_once=now))


@app.command()
def creator(
    host: Annotated[str, typer.Option("--host", callback=legal_name, help="Name of this machine in the mission.")],
    connect: Annotated[str, typer.Option("--connect", callback=hub_endpoint, help="The mission's hub, tcp/HOST:PORT.")],
    mission: Annotated[str, typer.Option("--mission", callback=legal_name, help="Name of the mission.")],
    secret_file: SecretFile = None,
    tag: Annotated[
        list[str] | None, typer.Option("--tag", callback=legal_names, help="A tag of this machine; repeatable.")
    ] = None,
    record_to: Annotated[
        Path | None, typer.Option("--record", metavar="FILE.mcap", help="Record all messages of the components here.")
    ] = None,
) -> None:
    """Offer this machine to a mission until it ends, or until Ctrl-C: its placer may start components here."""
    from backbone.command_line.offering import offer_this_machine

    run(lambda: offer_this_machine(mission, connect, secret_file, host, tuple(tag or []), record_to))


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
    """Run experiments on simulated robots, among them those of the papers; see 'experiment --help'."""
    raise typer.Exit(import_module(EXPERIMENTS).run(context.args))


def _width() -> int | None:
    """Return the width of tables; None: the terminal's."""
    return None if sys.stdout.isatty() else PIPE_WIDTH


if __name__ == "__main__":
    main()
