"""``scout-console``: take over a robot, or watch."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from backbone.command_line.options import (
    CommandTable,
    SecretFile,
    Version,
    chosen,
    complete_behavior,
    complete_mission,
    finite,
    hub_endpoint,
    names_for,
    run,
    run_table,
)
from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode, say
from ui_console.model.profile import Profile, Sight

SIGHTS = {Profile.TERMINAL: Sight.PICTURES, Profile.PENDANT: Sight.BROADCAST, Profile.HEADLESS: Sight.BROADCAST}
"""With a screen, pictures come to this machine; a person without one looks at a video monitor, or at the robot."""

WEB_PORT = 8420  # chosen: free on most machines
LEAST_PRIORITY, MOST_PRIORITY = -(2**31), 2**31 - 1  # as in a mission file
LONGEST_WAIT_S = 86_400.0  # chosen: a day, as in a mission file
SHORTEST_RUNTIME_S = 0.01  # chosen: shorter than a switch
AWAY_AFTER_S = 120.0  # chosen: longer than a look at something else; then the robot goes on with useful work

app = typer.Typer(
    cls=CommandTable,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    add_completion=True,
    help="Consoles of a mission. Exit codes: 0 done, 1 unexpected, 2 usage or wrong script, 4 backbone not reached, "
    "5 refused, 130 Ctrl-C.",
)


def complete_robot(ctx: typer.Context) -> list[str]:
    """Return the robots of the mission that is up, for a shell."""
    names = names_for(ctx)
    return names.robots if names is not None else []


Mission = Annotated[
    str | None,
    typer.Option("--mission", autocompletion=complete_mission, help="Name of a mission that is up on this machine."),
]
Connect = Annotated[
    str | None, typer.Option("--connect", callback=hub_endpoint, help="Hub elsewhere, tcp/HOST:PORT; needs --mission.")
]


User = Annotated[str, typer.Option("--user", help="Who you are, for the record; default: who is logged in.")]


@app.callback()
def _before_each_command(version: Version = False) -> None:
    """Read the options that go before a command."""


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
    kind: Annotated[str, typer.Option(help="Kind of ARC; default: the robot's, for what the console shows.")] = "",
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
    where, user = chosen(mission, connect, secret_file), user or _user()
    script = script or ("-" if as_json else "")
    if profile is Profile.MONITOR:
        _watch(where, user, as_json=as_json)
    wished = {
        "robot": robot,
        "priority": priority,
        "kind": kind,
        "sight": Sight.NOTHING if script else SIGHTS[profile],
        "minimum_runtime_s": minimum_runtime,
    }
    if script:
        from ui_console.session.headless import drive_by_script

        run(lambda: drive_by_script(where, wished, user, script, within))
    if profile is Profile.HEADLESS:
        from ui_console.session.gamepad_session import drive_by_gamepad

        run(lambda: drive_by_gamepad(where, {**wished, "away_after_s": away_after}, user))
    _need_a_terminal("attach", "--script FILE, --json or --profile headless")
    from ui_console.terminal.on_screen import Looks, drive_by_hand

    sees = SIGHTS[profile] is Sight.PICTURES
    looks = Looks(profile, user, sees, is_bare=video_only, has_gamepad=gamepad)
    run(lambda: drive_by_hand(where, {**wished, "away_after_s": away_after}, looks))


@app.command()
def monitor(
    as_json: Annotated[bool, typer.Option("--json", help="JSON lines instead of a screen.")] = False,
    once: Annotated[bool, typer.Option("--once", help="All that screens show now, as one JSON object.")] = False,
    recording: Annotated[
        Path | None,
        typer.Option(help="Watch this recording instead: play it, go to any time, ask why; nothing needs to be up."),
    ] = None,
    user: User = "",
    mission: Mission = None,
    connect: Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Watch who holds what, who waits why, and what happens; claim nothing, but stop robots in an emergency."""
    if recording is not None:
        names_mission = mission is not None or connect is not None
        _watch_recording(recording, user or _user(), names_mission=names_mission, for_programs=as_json or once)
    where, user = chosen(mission, connect, secret_file), user or _user()
    if once:
        from ui_console.session.headless import look_once

        run(lambda: look_once(where, user))
    _watch(where, user, as_json=as_json)


@app.command()
def look(
    behavior: Annotated[str, typer.Argument(autocompletion=complete_behavior, help="A behavior of the mission.")],
    view: Annotated[str, typer.Argument(help="One of its debug views; none: list them with their newest values.")] = "",
    as_json: Annotated[bool, typer.Option("--json", help="The list as one JSON object; a view as JSON lines.")] = False,
    save: Annotated[
        Path | None, typer.Option(help="Save one picture of the view and end.", metavar="FILE.png", dir_okay=False)
    ] = None,
    for_s: Annotated[
        float,
        typer.Option(
            "--for", min=0.0, max=LONGEST_WAIT_S, callback=finite, help="End after so many seconds; 0: at Ctrl-C."
        ),
    ] = 0.0,
    mission: Mission = None,
    connect: Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Look into a behavior: the pictures and values that it goes by, live; it makes them only while you look."""
    where = chosen(mission, connect, secret_file)
    if save is not None and not view:
        raise _usage("--save needs a view")
    from ui_console.terminal.look import LookOptions, look_into

    run(lambda: look_into(where, behavior, view, LookOptions(as_json, save, for_s)))


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
    recording: Annotated[
        Path | None,
        typer.Option(help="Serve this recording instead: play it, go to any time, ask why; nothing needs to be up."),
    ] = None,
    kind: Annotated[str, typer.Option(help="Kind of ARC that operators claim; default: the robot's.")] = "",
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
    mission: Annotated[
        list[str] | None,
        typer.Option(
            autocompletion=complete_mission,
            help="Name of a mission that is up on this machine; again for each of several, each with its own page.",
        ),
    ] = None,
    connect: Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Serve the console, the mission designer (--design) or a recording as a web page, for any browser."""
    from ui_console.web.login import WrongOperator, new_rights, read_operator

    try:
        rights = new_rights([read_operator(one) for one in operator or []], priority)
    except WrongOperator as wrong:
        raise _usage(f"--operator {wrong}") from wrong
    if key and not certificate:
        raise _usage("--key belongs to a --certificate")
    if (design or recording) and (mission or connect is not None):
        raise _usage("--design and --recording serve a file; --mission and --connect are for missions that are up")
    names: list[str | None] = list(mission) if mission else [None]
    if (connect is not None and len(names) > 1) or len(set(names)) < len(names):
        raise _usage("several --mission have different names, and are up on this machine, without --connect")
    if design and recording:
        raise _usage("--design and --recording cannot be served by one server")
    try:
        from ui_console.design.serving import serve_designer
        from ui_console.web.recording_serving import serve_recording
        from ui_console.web.serving import Claims, ServerOptions, serve_consoles
    except ModuleNotFoundError as missing:
        raise _usage(f"{missing.name} is not installed; install scout-backbone[web]") from missing
    options, claims = ServerOptions(host, port, certificate, key, new_tokens), Claims(kind, away_after)
    if design:
        run(lambda: serve_designer(design, rights, options))
    if recording is not None:
        run(lambda: serve_recording(recording, rights, options))
    missions = [chosen(name, connect, secret_file) for name in names]
    run(lambda: serve_consoles(missions, rights, options, claims))


@app.command(hidden=True, context_settings={"ignore_unknown_options": True, "allow_extra_args": True})
def design(ctx: typer.Context) -> None:
    """Refuse: the designer is a web page."""
    file = next((word for word in ctx.args if not word.startswith("-")), "mission.xml")
    raise _usage(
        f"the designer is a web page: scout-console serve --design {file}; with only a terminal, change {file} with "
        "an editor, then scout-backbone check"
    )


def main() -> None:
    """Run the command line."""
    run_table(app)


def _watch(where: Where, user: str, *, as_json: bool) -> None:
    if as_json:
        from ui_console.session.headless import watch_as_json

        run(lambda: watch_as_json(where, user))
    _need_a_terminal("monitor", "--json")
    from ui_console.terminal.on_screen import watch_on_screen

    run(lambda: watch_on_screen(where, user))


def _watch_recording(path: Path, user: str, *, names_mission: bool, for_programs: bool) -> None:
    if names_mission:
        raise _usage("--recording watches a file; --mission and --connect are for missions that are up")
    if for_programs:
        raise _usage("--json and --once are for missions that are up; for a recording: scout-backbone recording print")
    _need_a_terminal("monitor --recording", "scout-backbone recording")
    from ui_console.terminal.recorded_session import watch_recording

    run(lambda: watch_recording(path, user))


def _usage(complaint: str) -> typer.Exit:
    """Print what is wrong with the words of the command, and return what ends it."""
    say(complaint)
    return typer.Exit(ExitCode.USAGE)


def _need_a_terminal(command: str, instead: str) -> None:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise _usage(f"{command} needs a terminal; without one use {instead}")


def _user() -> str:
    """Return who is logged in, as far as the system knows."""
    from backbone.mission_log.operators import login_name

    return login_name()


if __name__ == "__main__":
    main()
