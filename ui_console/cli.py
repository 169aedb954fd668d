"""``scout-console``: take over a robot, or watch."""

from __future__ import annotations

import asyncio
import os
import re
import signal
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from backbone.cli import ExitCode, read_secret_option, run, say
from backbone.cli_options import SecretFile, WholeHelp, complete_mission, finite, hub_endpoint, picture_for

if TYPE_CHECKING:
    from ssl import SSLContext

    from backbone.bus.interface import Clock
    from backbone.component.launch import Launch
    from ui_console.console_events import ConsoleEvent
    from ui_console.design.draft import Draft
    from ui_console.observer import Observer
    from ui_console.web.door import Pass
    from ui_console.web.token_file import TokenFile

KINDS = {"terminal": "capture", "pendant": "video_drive", "script": "drive"}
"""With a screen, pictures come to this machine; a person with a video monitor leaves the framegrabber to
others; a script needs no picture, so it waits for none to settle and leaves the video frequency to others too."""

LOOPBACK = ("127.0.0.1", "::1", "localhost")
ANYWHERE = ("0.0.0.0", "::", "")  # noqa: S104  only compared with what the operator said
WEB_PORT = 8420  # chosen: free on most machines
MOST_OF_HOST = 24  # chosen: leaves room in a component's name for its number, and for its ARC's
LEAST_PRIORITY, MOST_PRIORITY = -(2**31), 2**31 - 1  # as in a mission file
LONGEST_WAIT_S = 86_400.0  # chosen: a day, as in a mission file
SHORTEST_RUNTIME_S = 0.01  # chosen: shorter than a switch
AWAY_AFTER_S = 120.0  # chosen: longer than a look at something else; then the robot goes on with useful work

app = typer.Typer(
    cls=WholeHelp,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    add_completion=True,
    help="Consoles of a mission. Exit codes: 0 done, 1 unexpected, 2 usage or wrong script, 4 backbone not reached, "
    "5 refused, 130 Ctrl-C.",
)


def complete_robot(ctx: typer.Context) -> list[str]:
    """Return the robots of the mission that is up, for a shell."""
    from ui_console.team_model import ROBOT_KIND

    picture = picture_for(ctx)
    rcs = picture.schedule.rcs if picture is not None and picture.schedule is not None else []
    return sorted(rc.rc for rc in rcs if rc.kind == ROBOT_KIND)


class Profile(StrEnum):
    """How a console looks."""

    TERMINAL = "terminal"  # picture, tables, keys
    PENDANT = "pendant"  # six keys and the state of one robot; the picture is on a video monitor
    MONITOR = "monitor"  # tables only; drives nothing


Mission = Annotated[
    str | None,
    typer.Option("--mission", autocompletion=complete_mission, help="Name of a mission that is up on this machine."),
]
Connect = Annotated[
    str | None, typer.Option("--connect", callback=hub_endpoint, help="Hub elsewhere, tcp/HOST:PORT; needs --mission.")
]


User = Annotated[str, typer.Option("--user", help="Who you are, for the record; default: who is logged in.")]


@dataclass(frozen=True)
class _Where:
    """Which mission a console joins."""

    mission: str | None
    connect: str | None
    secret_file: Path | None


@dataclass(frozen=True)
class _Looks:
    """How a console with a screen looks, and who sits at it."""

    profile: Profile
    user: str
    is_bare: bool
    has_gamepad: bool


@dataclass(frozen=True)
class _Script:
    """What a console is driven by instead of keys, and for how long it waits for its grant."""

    file: str
    within_s: float


@dataclass(frozen=True)
class _Site:
    """Where a page is served, and what its operators claim."""

    host: str
    port: int
    certificate: str
    key: str
    kind: str
    away_after_s: float
    has_new_tokens: bool

    @property
    def encryption(self) -> SSLContext | None:
        """What is encrypted with; None: nothing is.

        Raises:
            NoCertificate: There is none where one should be.
        """
        from ui_console.web.encryption import encryption_with

        return encryption_with(self.certificate, self.key) if self.certificate else None


@app.command()
def attach(
    robot: Annotated[
        str,
        typer.Argument(autocompletion=complete_robot, help="Robot to take over; none: any free one with a camera."),
    ] = "",
    priority: Annotated[
        int, typer.Option(min=LEAST_PRIORITY, max=MOST_PRIORITY, help="Beside the mission's own; larger is higher.")
    ] = 100,
    profile: Annotated[Profile, typer.Option(help="How the console looks.")] = Profile.TERMINAL,
    script: Annotated[str, typer.Option(help="Drive by the JSON lines of this file, '-' for standard input.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="JSON lines, no screen; implies --script -.")] = False,
    within: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=LONGEST_WAIT_S,
            callback=finite,
            help="Mission seconds a script waits for the grant; 0: for ever.",
        ),
    ] = 0.0,
    minimum_runtime: Annotated[
        float,
        typer.Option(
            min=SHORTEST_RUNTIME_S,
            max=LONGEST_WAIT_S,
            callback=finite,
            help="Shortest useful time beside equals, seconds.",
        ),
    ] = 5.0,
    kind: Annotated[str, typer.Option(help="Kind of ARC; default: what the console shows needs.")] = "",
    away_after: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=LONGEST_WAIT_S,
            callback=finite,
            help="Give the robot back when no key was pressed for so many seconds; 0: never.",
        ),
    ] = AWAY_AFTER_S,
    video_only: Annotated[bool, typer.Option("--video-only", help="Begin with the picture alone.")] = False,
    gamepad: Annotated[bool, typer.Option("--gamepad", help="Drive by the gamepad of this machine, too.")] = False,
    user: User = "",
    mission: Mission = None,
    connect: Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Take over a robot, drive it, give it back."""
    where = _Where(mission, connect, secret_file)
    script = script or ("-" if as_json else "")
    if profile is Profile.MONITOR:
        run(lambda: _watch(where, user or _user(), as_json=as_json))
    wished = {
        "robot": robot,
        "priority": priority,
        "kind": kind or KINDS["script" if script else profile],
        "minimum_runtime_s": minimum_runtime,
    }
    if script:
        run(lambda: _drive_by_script(where, wished, user or _user(), _Script(script, within)))
    _need_a_terminal("attach", "--script FILE or --json")
    looks = _Looks(profile, user or _user(), is_bare=video_only, has_gamepad=gamepad)
    run(lambda: _drive_by_hand(where, {**wished, "away_after_s": away_after}, looks))


@app.command()
def monitor(
    as_json: Annotated[bool, typer.Option("--json", help="JSON lines instead of a screen.")] = False,
    once: Annotated[bool, typer.Option("--once", help="All that screens show now, as one JSON object.")] = False,
    user: User = "",
    mission: Mission = None,
    connect: Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Watch who holds what, who waits why, and what happens; claim nothing, but stop robots in an emergency."""
    where = _Where(mission, connect, secret_file)
    if once:
        run(lambda: _look_once(where, user or _user()))
    if not as_json:
        _need_a_terminal("monitor", "--json")
    run(lambda: _watch(where, user or _user(), as_json=as_json))


@app.command()
def serve(
    host: Annotated[
        str, typer.Option(help="Address to listen at; beyond this machine only if you say so, 0.0.0.0 is all.")
    ] = "127.0.0.1",
    port: Annotated[int, typer.Option(min=0, max=65535, help="Port; 0: any that is free.")] = WEB_PORT,
    priority: Annotated[
        int,
        typer.Option(
            min=LEAST_PRIORITY,
            max=MOST_PRIORITY,
            help="The most an operator may ask for, beside the mission's own.",
        ),
    ] = 100,
    operator: Annotated[
        list[str] | None,
        typer.Option(help="NAME=PRIORITY: a token for this operator alone; again for each. Default: one for all."),
    ] = None,
    certificate: Annotated[
        str, typer.Option(help="PEM file with a certificate: the page is served over HTTPS.", metavar="FILE")
    ] = "",
    key: Annotated[
        str, typer.Option(help="PEM file with its key; default: it is in the certificate's file.", metavar="FILE")
    ] = "",
    design: Annotated[
        str, typer.Option(help="Serve the designer of this mission file instead; nothing needs to be up.")
    ] = "",
    kind: Annotated[str, typer.Option(help="Kind of ARC that operators claim.")] = KINDS["terminal"],
    new_tokens: Annotated[
        bool,
        typer.Option("--new-tokens", help="Forget the tokens of the server before; its open pages do not come back."),
    ] = False,
    away_after: Annotated[
        float,
        typer.Option(
            min=0.0,
            max=LONGEST_WAIT_S,
            callback=finite,
            help="Give a robot back when its operator touched nothing for so many seconds; 0: never.",
        ),
    ] = AWAY_AFTER_S,
    mission: Mission = None,
    connect: Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Serve the console, or with --design the mission designer, as a web page: for browsers, tablets and phones."""
    where = _Where(mission, connect, secret_file)
    from ui_console.web.door import WrongOperator, passes_for, read_operator

    try:
        passes = passes_for([read_operator(one) for one in operator or []], priority)
    except WrongOperator as wrong:
        say(f"--operator {wrong}")
        raise typer.Exit(ExitCode.USAGE) from wrong
    if key and not certificate:
        say("--key belongs to a --certificate")
        raise typer.Exit(ExitCode.USAGE)
    site = _Site(host, port, certificate, key, kind, away_after, new_tokens)
    if design:
        if mission is not None or connect is not None:
            say("--design serves a mission file; --mission and --connect are for missions that are up")
            raise typer.Exit(ExitCode.USAGE)
        run(lambda: _serve_design(design, passes, site))
    run(lambda: _serve(where, passes, site))


@app.command()
def design(
    file: Annotated[str, typer.Argument(help="Mission file to change, or to begin if there is none.")] = "mission.xml",
    new: Annotated[bool, typer.Option("--new", help="Begin from nothing, whatever the file holds.")] = False,
) -> None:
    """Build or change a mission file by keys, checked while you build it; nothing needs to be up."""
    _need_a_terminal("design", "an editor and scout-backbone check")
    run(lambda: _design(file, is_new=new or not Path(file).exists()))


def main() -> None:
    """Run the command line."""
    try:
        app()
    except KeyboardInterrupt:
        sys.exit(ExitCode.INTERRUPTED)


def _need_a_terminal(command: str, instead: str) -> None:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        say(f"{command} needs a terminal; without one use {instead}")
        raise typer.Exit(ExitCode.USAGE)


async def _drive_by_script(where: _Where, wished: dict[str, Any], user: str, given: _Script) -> int:
    from ui_console.script import WrongScript, read_script
    from ui_console.scripted import ScriptDriver, feed_from
    from ui_console.teleoperation import Teleoperation

    script = given.file
    try:
        steps = None if script == "-" else read_script(await asyncio.to_thread(Path(script).read_text))
    except (OSError, UnicodeDecodeError) as error:
        say(f"{script}: {error}")
        return ExitCode.USAGE
    except WrongScript as wrong:
        say(f"{script}: {wrong}")
        return ExitCode.USAGE
    launch, clock, secret = await _launch(where, wished)
    driver = ScriptDriver(_write_line, steps, within_s=given.within_s)
    bus = await _open_bus(launch, clock, secret)
    console = Teleoperation(launch, bus, clock, show=driver.show, work=driver.drive, watches=False, user=user)
    if script == "-":
        feed_from(sys.stdin.fileno(), driver.feed)
    interrupted = _end_on_signals(console)
    await console.run()
    return ExitCode.INTERRUPTED if interrupted() else driver.exit_code(console)


async def _drive_by_hand(where: _Where, wished: dict[str, Any], looks: _Looks) -> int:
    from ui_console.gamepad import find_gamepad
    from ui_console.teleoperation import Teleoperation
    from ui_console.terminal import keys
    from ui_console.terminal.session import TerminalSession

    pad = find_gamepad() if looks.has_gamepad else None
    launch, clock, secret = await _launch(where, wished)
    sees = wished["kind"] == KINDS[Profile.TERMINAL] and looks.profile is Profile.TERMINAL
    session = TerminalSession(
        launch.name,
        launch.mission,
        looks.user,
        profile=keys.Profile(looks.profile),
        is_bare=looks.is_bare,
        sees=sees,
        gamepad=pad,
    )
    bus = await _open_bus(launch, clock, secret)
    see = session.see if sees else None
    console = Teleoperation(launch, bus, clock, show=session.show, see=see, keeps_arc=True, user=looks.user)
    interrupted = _end_on_signals(console)
    ended = await session.run(console)
    if console.refusal is not None and console.given_back is None:
        raise console.refusal
    return ExitCode.INTERRUPTED if interrupted() else ended


async def _watch(where: _Where, user: str, *, as_json: bool) -> int:
    from backbone.component.component import NoParameters
    from ui_console.console_events import for_scripts
    from ui_console.observer import Observer, nobody_here

    launch, clock, secret = await _launch(where, {})
    bus = await _open_bus(launch, clock, secret)
    if as_json:

        def show(event: ConsoleEvent) -> None:
            for line in for_scripts(event):
                _write_line(line)

        console: Observer[NoParameters] = Observer(launch, bus, clock, show=show, user=user, answers_of=nobody_here)
        interrupted = _end_on_signals(console)
        await console.run()
        return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE
    from ui_console.terminal.session import TerminalSession

    session = TerminalSession(launch.name, launch.mission, user, sees=False)
    console = Observer(launch, bus, clock, show=session.show, user=user)
    interrupted = _end_on_signals(console)
    ended = await session.run(console)
    return ExitCode.INTERRUPTED if interrupted() else ended


async def _look_once(where: _Where, user: str) -> int:
    from backbone.component.component import NoParameters
    from ui_console.console_model import ConsoleModel
    from ui_console.observer import Observer
    from ui_console.team_model import TeamModel
    from ui_console.views import view_json

    launch, clock, secret = await _launch(where, {})
    model = ConsoleModel(launch.name, user, TeamModel(launch.mission), sees=False)
    console: Observer[NoParameters] = Observer(
        launch, await _open_bus(launch, clock, secret), clock, show=model.apply, signs_in=False
    )
    interrupted = _end_on_signals(console)

    async def end_when_listed() -> None:
        await console.feed.listed.wait()
        console.end("all was told")

    ending = asyncio.create_task(end_when_listed(), name="end when listed")
    try:
        await console.run()
    finally:
        ending.cancel()
    if interrupted():
        return ExitCode.INTERRUPTED
    _write_line(view_json(model.view(clock.now_s())))
    return ExitCode.DONE


async def _serve(where: _Where, passes: Mapping[str, Pass], site: _Site) -> int:
    import msgspec

    from ui_console.web.door import Doorkeeper
    from ui_console.web.hub import WebHub

    try:
        from ui_console.web.reception import CannotListen
        from ui_console.web.server import WebServer
    except ModuleNotFoundError as missing:
        say(f"{missing.name} is not installed; install scout-backbone[web]")
        return ExitCode.USAGE
    encryption = site.encryption
    launch, clock, secret = await _launch(where, {})
    launch = msgspec.structs.replace(launch, name=f"web-{os.getpid()}")
    tokens = _tokens_of_mission(where, launch.mission, secret, site)
    passes = _passes_with(tokens, passes, site)

    async def join(one_more: Launch) -> Any:
        return await _open_bus(one_more, clock, secret)

    bus = await join(launch)
    hub = WebHub(launch, bus, clock, join, kind=site.kind, away_after_s=site.away_after_s)
    interrupted = _end_on_signals(hub.observer)

    def ready(port: int) -> None:
        _keep(tokens, passes)
        _tell_where(site, port, passes)

    try:
        await WebServer(hub, Doorkeeper(passes)).run(site.host, site.port, ready, encryption)
    except CannotListen:
        await bus.close()
        raise
    return ExitCode.INTERRUPTED if interrupted() else ExitCode.DONE


def _tokens_of_mission(where: _Where, mission: str, secret: str, site: _Site) -> TokenFile | None:
    """Return where the tokens of a console's page are kept; None: nowhere, see ``token_file``."""
    from ui_console.web.token_file import TokenFile

    if not site.port:
        return None
    if where.connect is None:
        return TokenFile.of_mission_here(mission, site.port)
    return TokenFile.of_mission_elsewhere(mission, where.connect, secret, site.port)


def _passes_with(tokens: TokenFile | None, passes: Mapping[str, Pass], site: _Site) -> Mapping[str, Pass]:
    """Return what opens the server: the tokens of the server before, where they are kept and wanted."""
    from ui_console.web.token_file import kept_or_new

    return passes if tokens is None or site.has_new_tokens else kept_or_new(passes, tokens.read())


def _keep(tokens: TokenFile | None, passes: Mapping[str, Pass]) -> None:
    """Have the next server know the pages that are open; this one serves also if it cannot."""
    from ui_console.web.token_file import TokensNotKept

    try:
        if tokens is not None:
            tokens.keep(passes)
    except TokensNotKept as refusal:
        say(str(refusal))


async def _serve_design(file: str, passes: Mapping[str, Pass], site: _Site) -> int:
    from backbone.mission.reader import MissionInvalid
    from ui_console.design.look_up import look_up
    from ui_console.web.design_room import DesignRoom
    from ui_console.web.door import Doorkeeper
    from ui_console.web.token_file import TokenFile

    try:
        from ui_console.web.design_server import DesignServer, begin
    except ModuleNotFoundError as missing:
        say(f"{missing.name} is not installed; install scout-backbone[web]")
        return ExitCode.USAGE
    encryption = site.encryption
    try:
        draft, kept = begin(file)
    except MissionInvalid as invalid:
        say(str(invalid))
        return ExitCode.MISSION_INVALID
    if kept.path.exists():
        say(f"goes on with what was not saved, from {kept.path}")
    end, came = asyncio.Event(), set[signal.Signals]()

    def ended(number: signal.Signals) -> None:
        came.add(number)
        end.set()

    for number in (signal.SIGINT, signal.SIGTERM):
        asyncio.get_running_loop().add_signal_handler(number, ended, number)
    tokens = TokenFile.of_design(file, site.port) if site.port else None
    passes = _passes_with(tokens, passes, site)

    def ready(port: int) -> None:
        _keep(tokens, passes)
        _tell_where(site, port, passes)

    room = DesignRoom(draft, kept, look_up)
    server = DesignServer(room, Doorkeeper(passes))
    await server.run(site.host, site.port, ready, end, encryption)
    return ExitCode.INTERRUPTED if signal.SIGINT in came else ExitCode.DONE


def _tell_where(site: _Site, port: int, passes: Mapping[str, Pass]) -> None:
    """Print the page's address for each token, as soon as browsers can come."""
    scheme = "https" if site.certificate else "http"
    for token, granted in passes.items():
        who = f"{granted.user}: " if granted.user else ""
        _write_line(f"{who}{scheme}://{_shown(site.host)}:{port}/#token={token}".encode())
    if site.host not in LOOPBACK and not site.certificate:
        say(
            "whoever can listen on the way to this address can read what is sent: use it on networks you trust, "
            "or give a --certificate"
        )


def _shown(host: str) -> str:
    """Return how a browser names an address that is listened at."""
    import socket

    if host in ANYWHERE:
        return socket.gethostname()
    return f"[{host}]" if ":" in host else host


async def _design(file: str, *, is_new: bool) -> int:
    from backbone.mission.reader import MissionInvalid
    from ui_console.design.draft import Draft
    from ui_console.design.look_up import look_up
    from ui_console.design.screen import DesignApp

    try:
        draft = Draft.new(file) if is_new else Draft.opened(file)
    except MissionInvalid as invalid:
        say(str(invalid))
        return ExitCode.MISSION_INVALID
    screen = DesignApp(draft, look_up)
    await screen.run_async()
    if screen.return_code:
        _rescue(screen.draft)
    return screen.return_code or ExitCode.DONE


def _rescue(draft: Draft) -> None:
    """Write what a designer that crashed had not saved beside the mission file."""
    from ui_console.design.file import save

    if draft.is_changed:
        beside = Path(f"{draft.source}.rescued")
        save(draft, beside, overwrite=True)
        say(f"what was not saved is in {beside}")


def _user() -> str:
    """Return who is logged in, as far as the system knows."""
    from backbone.operators import login_name

    return login_name()


async def _launch(where: _Where, parameters: dict[str, Any]) -> tuple[Launch, Clock, str]:
    """Return who this console is in the mission found, that mission's clock, and the secret its hub asks for."""
    import socket

    from backbone import run_files
    from backbone.bus.clock import MissionClock
    from backbone.component.launch import Launch
    from backbone.naming import Subsystem
    from backbone.visit import clock_elsewhere

    mission, connect = where.mission, where.connect
    name = f"console-{os.getpid()}" if connect is None else _name_elsewhere(socket.gethostname())
    if connect is None:
        found = run_files.find(mission)
        mission, endpoint, secret = found.mission, found.endpoint, run_files.secret(found)
        clock, host = MissionClock(found.clock_origin_monotonic_s, found.clock_rate), found.host
    elif mission is None:
        raise typer.BadParameter("--connect needs --mission NAME")
    else:
        endpoint, host, secret = connect, socket.gethostname(), read_secret_option(where.secret_file)
        clock = await clock_elsewhere(mission, connect, f"{Subsystem.UI_CONSOLE}/{name}", secret)
    launch = Launch(
        mission,
        Subsystem.UI_CONSOLE,
        name,
        "console",
        "ui_console.teleoperation:Teleoperation",
        host,
        endpoint,
        clock.origin_monotonic_s,
        clock.rate,
        parameters,
    )
    return launch, clock, secret


def _name_elsewhere(host: str) -> str:
    """Return a console's name that those of other machines do not have: processes are numbered anew on each.

    Example:
        >>> _name_elsewhere("Lab PC.local").rpartition("-")[0]
        'console-lab-pc-local'
    """
    plain = re.sub(r"[^a-z0-9]+", "-", host.lower()).strip("-")[:MOST_OF_HOST].strip("-")
    return f"console-{plain}-{os.getpid()}"


async def _open_bus(launch: Launch, clock: Clock, secret: str) -> Any:
    from backbone.bus.zenoh_bus import ZenohBus, client_config

    return await ZenohBus.open_when_up(launch.mission, launch.address, clock, client_config(launch.endpoint, secret))


def _end_on_signals(console: Observer[Any]) -> Callable[[], bool]:
    """Have the console end in good order on SIGINT and SIGTERM; return whether SIGINT came."""
    came: list[signal.Signals] = []

    def end(number: signal.Signals) -> None:
        came.append(number)
        console.end(number.name)

    loop = asyncio.get_running_loop()
    for number in (signal.SIGINT, signal.SIGTERM):
        loop.add_signal_handler(number, end, number)
    return lambda: signal.SIGINT in came


def _write_line(line: bytes) -> None:
    """Write one line at once: whoever reads it may wait for it."""
    sys.stdout.buffer.write(line + b"\n")
    sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
