"""Shared parts of the command lines: options, completed names, uncut summaries, and a table of commands.

A completion imports its modules when a shell asks for it, so that ``--help`` stays quick.
"""

from __future__ import annotations

import json
import math
import os
import re
import socket
import sys
from collections.abc import Awaitable, Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NoReturn

import typer
from typer.core import TyperGroup
from typer.main import get_command_name
from typer.models import CommandInfo, TyperInfo

from backbone import __version__
from backbone.authentication import is_address, is_of_one_link
from backbone.command_line.standard_streams import standard_streams
from backbone.command_line.where import Where
from backbone.command_line.wrong_words import WRONG_WORDS, is_request_for_help, refusal_of
from backbone.errors import BackboneError
from backbone.launcher.endings import ExitCode, complaint_of, say
from backbone.naming import IllegalName, legal

DISTRIBUTION = "scout-backbone"
LONGEST_NAME = 255  # as ``ranges.LONGEST_MENTION``, whose module would load msgspec
MOST_PORT = 65_535  # RFC 9293: a port has 16 bits


class CommandTable(TyperGroup):
    """Shows each command's whole summary, and converts only values that need conversion.

    Typer cuts summaries at the end of the line. It also imports pydantic to convert a value, even for an absent value,
    a plain text, or the completions of a shell. This import takes a third of the processor time of a short command.
    """

    def __init__(self, **attributes: Any) -> None:
        super().__init__(**attributes)
        for command in self.commands.values():
            command.short_help = command.short_help or _first_paragraph(command.help or "")

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Read the words before the command's name."""
        _convert_only_what_needs_it(self.get_params(ctx))
        return super().parse_args(ctx, args)

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Find the command that the words name."""
        name, command, rest = super().resolve_command(ctx, args)
        if command is not None:
            _convert_only_what_needs_it(command.get_params(ctx))
        return name, command, rest


def run_table(table: typer.Typer) -> None:
    """Run the command line of this process.

    If the words name a command, only that command is built; for ``--version`` none is built, else all are. Building all
    takes a third of the time of a short command.
    """
    tables: tuple[list[Any], ...] = (table.registered_commands, table.registered_groups)
    named = _words_before_the_cursor()[:1]
    if named in [["--version"], *([_name_of(each)] for commands in tables for each in commands)]:
        for commands in tables:
            commands[:] = [each for each in commands if [_name_of(each)] == named]
    with standard_streams():
        try:
            sys.exit(table(standalone_mode=False))
        except KeyboardInterrupt:
            sys.exit(ExitCode.INTERRUPTED)
        except (BackboneError, WRONG_WORDS) as error:
            if is_request_for_help(error):
                table()
            message, code = complaint_of(error if isinstance(error, BackboneError) else refusal_of(error))
            say(message)
            sys.exit(code)


def _words_before_the_cursor() -> list[str]:
    """Return the words of the command line; while a shell completes one, those before it."""
    if len(sys.argv) > 1 or not (typed := os.environ.get("_TYPER_COMPLETE_ARGS", os.environ.get("COMP_WORDS", ""))):
        return sys.argv[1:]
    words = typed.split() if typed[-1].isspace() else typed.split()[:-1]
    return words[1 : int(os.environ.get("COMP_CWORD", len(words)))]


def _name_of(command: CommandInfo | TyperInfo) -> str:
    """Return the name under which Typer lists a command or a group."""
    return command.name or get_command_name(getattr(command.callback, "__name__", ""))


class _Text:
    """Typer's way to convert a value, for a parameter that is a text: the value stays as it was typed."""

    def coerce(self, value: object, **_where: object) -> object:
        """Return the value."""
        return value


def _convert_only_what_needs_it(parameters: Iterable[Any]) -> None:
    for parameter in parameters:
        if getattr(getattr(parameter, "type_descriptor", None), "annotation", None) is str:
            parameter.get_runtime_param = _Text
        parameter.process_value = partial(_processed, parameter, parameter.process_value)


def _processed(parameter: Any, process_value: Callable[[Any, Any], Any], ctx: Any, value: Any) -> Any:
    """Return the value for the command; an absent optional value, or a value during completion, stays unchanged."""
    if (value is None and not parameter.required) or ctx.resilient_parsing:
        return value
    given = process_value(ctx, value)
    several = isinstance(given, list | tuple)
    for typed, read in zip(value, given, strict=True) if several else [(value, given)]:
        if isinstance(read, float) and not math.isfinite(read):  # no range refuses NaN, and some have no upper end
            raise typer.BadParameter(f"{read} is no finite number; see the range in --help", ctx, parameter)
        if isinstance(typed, str) and isinstance(read, int | float) and ("_" in typed or not typed.isascii()):
            raise typer.BadParameter(f"{typed} is no number; write it in digits 0 to 9", ctx, parameter)
    return given


def _first_paragraph(text: str) -> str:
    return " ".join(text.partition("\n\n")[0].split())


def run(work: Callable[[], Awaitable[int]]) -> NoReturn:
    """Run a command's coroutine and end the process with its exit code; a refusal becomes one line."""
    from backbone.command_line.event_loop import exit_code_of

    raise typer.Exit(exit_code_of(work))


def chosen(mission: MissionName = None, connect: Endpoint = None, secret_file: SecretFile = None) -> Where:
    """Return the mission that the options name; a hub elsewhere needs the mission's name."""
    if connect is not None and mission is None:
        raise typer.BadParameter("--connect needs --mission NAME")
    return Where(legal_name(mission) if connect is not None else mission, connect, secret_file)


def legal_name(value: str | None) -> str | None:
    """Refuse a text that is no name; for options that name a host, or a mission that this machine does not know."""
    if value is None:
        return None
    try:
        return legal(value)
    except IllegalName as illegal:
        raise typer.BadParameter(str(illegal)) from None


def legal_names(values: list[str] | None) -> list[str]:
    """Refuse texts that are no names; for options that may be repeated, as a mission file's lists of names."""
    return [str(legal_name(value)) for value in values or []]


def shown_name(value: str) -> str:
    """Refuse a name that messages cannot contain, or that texts cannot show as it is; for names of anything."""
    if len(value) > LONGEST_NAME or not value.isprintable() or value != value.strip():
        raise typer.BadParameter(
            f"write a name of at most {LONGEST_NAME} printable characters, the first and last of them no space"
        )
    return value


def print_version(is_asked: bool) -> None:
    """Print the installed version and end the command; for the option ``--version``."""
    if is_asked:
        print(f"{DISTRIBUTION} {__version__}")
        raise typer.Exit


ENDPOINT = re.compile(
    r"((tcp|tls)/(?P<host>[^\s/?#]+):(?P<port>[0-9]{1,5})|unixsock-stream/[^\s?#]+)(\?[^\s?#]+)?(#[^\s?]+)?"
)
"""The form that Zenoh reads, with metadata and configuration at its end. No hub listens by another protocol."""


def hub_endpoint(value: str | None) -> str | None:
    """Refuse a text that is not a hub endpoint, and number its network interface; for options that take an endpoint."""
    if value is None:
        return None
    found = ENDPOINT.fullmatch(value)
    is_right = found is not None and 0 < int(found["port"] or 1) <= MOST_PORT
    if found is None or not is_right or not is_address(host := (found["host"] or "").strip("[]")):
        raise typer.BadParameter(f"{value!r} is no endpoint; write tcp/HOST:PORT, for example tcp/192.0.2.7:7447")
    return value.replace(host, _with_interface(host), 1) if is_of_one_link(host) else value


def _with_interface(address: str) -> str:
    """Return an address of one link with the number of its network interface, because zenoh resolves no name of one."""
    interface = address.partition("%")[2]
    if not interface:
        raise typer.BadParameter(f"{address} is an address of one link; write its interface, too: [{address}%eth0]")
    if interface.isdigit():
        return address
    try:
        return address.replace(f"%{interface}", f"%{socket.if_nametoindex(interface)}")
    except OSError:
        raise typer.BadParameter(f"this machine has no network interface {interface}; 'ip link' lists them") from None


def complete_mission() -> list[str]:
    """Return the missions that are up on this machine."""
    from backbone.run_files import find_all

    try:
        return [run_file.mission for run_file in find_all()]
    except (BackboneError, OSError):
        return []


def typed_mission(ctx: typer.Context) -> tuple[str | None, str | None, Path | None] | None:
    """Return name, endpoint and secret file of the mission that the typed words name; None if it is not up."""
    mission, endpoint = ctx.params.get("mission"), ctx.params.get("connect")
    can_ask = (mission and ENDPOINT.fullmatch(endpoint)) if endpoint is not None else complete_mission()
    if not can_ask:
        return None
    secret_file = ctx.params.get("secret_file")
    return mission, endpoint, Path(secret_file) if secret_file is not None else None


def names_for(ctx: typer.Context) -> Any:
    """Return the names of the mission that the typed words name; None if it is not up.

    For a mission on this machine, they come from its run folder. The bus is loaded only if that file is missing, or for
    a mission elsewhere.
    """
    typed = typed_mission(ctx)
    if typed is None:
        return None
    from backbone import run_names

    mission, endpoint, _ = typed
    try:
        names = run_names.read(mission) if endpoint is None else None
    except (BackboneError, OSError):
        return None
    if names is not None:
        return names
    from backbone.command_line.completion import names_now

    return names_now(*typed)


def completing(*lists: str) -> Callable[[typer.Context], list[str]]:
    """Return a completion with the names in these lists of ``MissionNames``, of the mission that is up."""

    def complete(ctx: typer.Context) -> list[str]:
        names = names_for(ctx)
        return sorted({name for each in lists for name in getattr(names, each)}) if names is not None else []

    return complete


complete_name = completing("all")
complete_resource = completing("resources")
complete_robot = completing("robots")
complete_behavior = completing("behaviors")
complete_exchangeable = completing("behaviors", "resources")
complete_type = completing("types")
complete_person = completing("people")
Version = Annotated[
    bool, typer.Option("--version", callback=print_version, is_eager=True, help="Show the version and exit.")
]
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
        callback=shown_name,
        autocompletion=complete_name,
        help="A component, resource, host, person or alarm; or a cause as stories show it: rc_manager#112.",
    ),
]
ComponentName = Annotated[
    str, typer.Argument(callback=shown_name, autocompletion=complete_name, help="A component of the mission.")
]
MOST_LINES = 1_000_000  # chosen: more than a person reads
For = Annotated[float | None, typer.Option("--for", min=0.1, max=1e9, help="End after so many seconds.")]
AsJson = Annotated[bool, typer.Option("--json", help="Print one JSON object.")]


def named_value(given: str) -> tuple[str, object]:
    """Return name and value of NAME=VALUE; for options that set parameters."""
    name, equals, value = given.partition("=")
    if not equals or not name:
        raise typer.BadParameter(f"{given!r} is not NAME=VALUE")
    return name, json_or_text(value)


def json_or_text(text: str) -> object:
    """Return the value of a JSON text; return any other text unchanged."""
    try:
        return json.loads(text)
    except (ValueError, RecursionError):  # ValueError is also raised for a number of thousands of digits
        return text
