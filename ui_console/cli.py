"""``scout-console``: take over a robot, or watch a mission."""

from __future__ import annotations

import sys
from pathlib import Path

import typer

from backbone.command_line.options import CommandTable, SecretFile, Version, chosen, run, run_table
from backbone.command_line.where import Where
from ui_console import options as words
from ui_console.model.profile import Profile, Sight

SIGHTS = {Profile.TERMINAL: Sight.PICTURES, Profile.PENDANT: Sight.BROADCAST, Profile.HEADLESS: Sight.BROADCAST}
"""With a screen, pictures come to this machine; a person without one looks at a video monitor, or at the robot."""

WEB_PORT = 8420  # chosen: free on most machines
AWAY_AFTER_S = 120.0  # chosen: longer than a short distraction; afterwards the robot continues with useful work

app = typer.Typer(
    cls=CommandTable,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    no_args_is_help=True,
    add_completion=True,
    help="Consoles of a mission. Exit codes: 0 done, 1 unexpected, 2 usage or wrong script, 4 backbone not reached, "
    "5 refused, 130 Ctrl-C.",
)


@app.callback()
def _before_each_command(version: Version = False) -> None:
    """Read the options before a command."""


@app.command()
def attach(
    robot: words.Robot = "",
    priority: words.Priority = 100,
    profile: words.ProfileName = Profile.TERMINAL,
    script: words.Script = "",
    as_json: words.ScriptAsJson = False,
    within: words.Within = 0.0,
    minimum_runtime: words.MinimumRuntime = 5.0,
    kind: words.Kind = "",
    away_after: words.AwayAfter = AWAY_AFTER_S,
    video_only: words.VideoOnly = False,
    gamepad: words.Gamepad = False,
    user: words.User = "",
    mission: words.Mission = None,
    connect: words.Connect = None,
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
    as_json: words.WatchAsJson = False,
    once: words.Once = False,
    recording: words.WatchedRecording = None,
    user: words.User = "",
    mission: words.Mission = None,
    connect: words.Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Watch holders, waiting requests, reasons and events; claim no robot, but stop robots in an emergency."""
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
    behavior: words.Behavior,
    view: words.View = "",
    as_json: words.LookAsJson = False,
    save: words.Save = None,
    for_s: words.LooksFor = 0.0,
    mission: words.Mission = None,
    connect: words.Connect = None,
    secret_file: SecretFile = None,
) -> None:
    """Watch a behavior's intermediate pictures and values live; it makes them only while you watch."""
    where = chosen(mission, connect, secret_file)
    if save is not None and not view:
        raise _usage("--save needs a view")
    from ui_console.terminal.look import LookOptions, look_into

    run(lambda: look_into(where, behavior, view, LookOptions(as_json, save, for_s)))


@app.command()
def serve(
    host: words.Host = "127.0.0.1",
    port: words.Port = WEB_PORT,
    priority: words.HighestPriority = 100,
    operator: words.OperatorPriorities = None,
    certificate: words.Certificate = "",
    key: words.Key = "",
    design: words.DesignedFile = "",
    recording: words.ServedRecording = None,
    kind: words.ServedKind = "",
    new_tokens: words.NewTokens = False,
    away_after: words.PageAwayAfter = AWAY_AFTER_S,
    mission: words.Missions = None,
    connect: words.Connect = None,
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
    names = _missions_to_serve(mission, is_elsewhere=connect is not None, is_file=bool(design or recording))
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


def _missions_to_serve(mission: list[str] | None, *, is_elsewhere: bool, is_file: bool) -> list[str | None]:
    """Return the names of the missions; None: the only running mission."""
    if is_file and (mission or is_elsewhere):
        raise _usage("--design and --recording serve a file; --mission and --connect are for missions that are up")
    names: list[str | None] = list(mission) if mission else [None]
    if (is_elsewhere and len(names) > 1) or len(set(names)) < len(names):
        raise _usage("several --mission have different names, and are up on this machine, without --connect")
    return names


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


def _usage(complaint: str) -> typer.BadParameter:
    """Return the exception that ends the command with the fault in its arguments."""
    return typer.BadParameter(complaint)


def _need_a_terminal(command: str, instead: str) -> None:
    if not (sys.stdin.isatty() and sys.stdout.isatty()):
        raise _usage(f"{command} needs a terminal; without one use {instead}")


def _user() -> str:
    """Return the name of the logged-in user, as far as the system knows it."""
    from backbone.mission_log.operators import login_name

    return login_name()


if __name__ == "__main__":
    main()
