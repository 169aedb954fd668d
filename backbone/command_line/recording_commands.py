"""``scout-backbone`` ``record``, ``recording``, ``replay``, ``compare``: recorded messages.

Rules of this file: as those of ``cli``.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import StrEnum
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from backbone.command_line.options import (
    MOST_LINES,
    AsJson,
    CommandTable,
    Endpoint,
    For,
    MissionName,
    SecretFile,
    chosen,
    named_value,
    run,
)

if TYPE_CHECKING:
    from backbone.command_line.exporting import TableWriter

EARLIEST_S, LATEST_S = -86_400.0, 1e9  # chosen: thirty years; within ``ranges.Instant``, which would load msgspec

record = typer.Typer(cls=CommandTable, rich_markup_mode=None, help="Record a mission that is up, until Ctrl-C.")
recording = typer.Typer(
    cls=CommandTable,
    rich_markup_mode=None,
    no_args_is_help=True,
    help="Look into a recording; needs no mission.",
)

File = Annotated[Path, typer.Argument(metavar="FILE.mcap", help="A recording.")]
Keys = Annotated[
    list[str] | None,
    typer.Option("--keys", metavar="GLOB", help="Only keys that match, as 'resource_pool/*/readings'; repeatable."),
]
Since = Annotated[float, typer.Option("--since", min=0, max=LATEST_S, help="Not before this mission time, seconds.")]
Until = Annotated[float | None, typer.Option("--until", min=0, max=LATEST_S, help="Not after this time, seconds.")]
Tolerances = Annotated[
    list[str] | None,
    typer.Option("--tolerance", metavar="FIELD=X", help="Numbers of this field may be so far apart; repeatable."),
]
DELAY = "delay_s"


class TableFormat(StrEnum):
    """Formats of exported tables."""

    CSV = "csv"
    PARQUET = "parquet"


MOST_TOLERANCE = 1e18  # as the largest number of a message


@record.callback(invoke_without_command=True)
def record_mission(
    context: typer.Context,
    to: Annotated[
        Path | None, typer.Option("--to", metavar="FILE.mcap", help="A new file; default: named by mission and time.")
    ] = None,
    keys: Keys = None,
    for_s: For = None,
    split_s: Annotated[
        float, typer.Option("--split", min=1.0, max=1e6, help="Go on in a further file after so many seconds.")
    ] = 3_600.0,
    split_mb: Annotated[
        int, typer.Option("--split-mb", min=1, max=1_000_000, help="The same when a file is so large, in megabytes.")
    ] = 1_000,
    keep: Annotated[
        int, typer.Option("--keep", min=0, max=1_000_000, help="Keep so many files, delete older ones; 0: all.")
    ] = 0,
    is_lossless: Annotated[
        bool,
        typer.Option("--lossless", help="Lose nothing of a burst: senders keep up to 128 MiB."),
    ] = False,
    is_described: Annotated[bool, typer.Option("--described", hidden=True)] = False,
    host_folder: Annotated[Path | None, typer.Option("--host-folder", hidden=True)] = None,
    host_only: Annotated[bool, typer.Option("--host-only", hidden=True)] = False,
    mission: MissionName = None,
    connect: Endpoint = None,
    secret_file: SecretFile = None,
) -> None:
    """Record all messages of a mission that is up, until Ctrl-C; a file that exists is refused."""
    if context.invoked_subcommand is not None:
        return
    from backbone.command_line.recording_work import OfLauncher, Splitting, record_to

    where, splitting = chosen(mission, connect, secret_file), Splitting(split_s, split_mb, keep)
    told = OfLauncher(is_described, host_folder, host_only, is_lossless)
    run(lambda: record_to(where, to, keys or [], for_s, splitting, told))


@record.command()
def recover(
    file: Annotated[Path, typer.Argument(metavar="FILE.mcap", help="A recording whose recorder was killed.")],
    to: Annotated[Path, typer.Argument(metavar="TO.mcap", help="The new file.")],
) -> None:
    """Write what is readable of a broken recording to a new file."""
    from backbone.command_line.recording_work import recover_to

    run(lambda: recover_to(file, to))


@record.command()
def join(
    files: Annotated[
        list[Path], typer.Argument(metavar="A.mcap… OUT.mcap", help="Recordings of one mission, and the new file.")
    ],
) -> None:
    """Write recordings of one mission to one new file: each message once, in mission time, with clocks corrected."""
    from backbone.command_line.joining import join_to

    if len(files) < 2:
        raise typer.BadParameter("name at least one recording, and the new file")
    *recordings, to = files
    run(lambda: join_to(recordings, to))


@recording.command()
def info(file: File, as_json: AsJson = False) -> None:
    """Print facts about a recording: mission, times, versions, numbers of messages."""
    from backbone.command_line.recording_work import print_info

    run(lambda: print_info(file, as_json=as_json))


@recording.command()
def check(file: File, as_json: AsJson = False) -> None:
    """Read a recording to its end, and print which senders' messages are missing; a damaged file is refused."""
    from backbone.command_line.recording_work import check_whole

    run(lambda: check_whole(file, as_json=as_json))


@recording.command("keys")
def list_keys(file: File, as_json: AsJson = False) -> None:
    """List its keys, with sender, schema, number and rate of messages."""
    from backbone.command_line.recording_work import print_keys

    run(lambda: print_keys(file, as_json=as_json))


@recording.command("print")
def print_(
    file: File,
    keys: Keys = None,
    since: Since = 0.0,
    until: Until = None,
    most: Annotated[int, typer.Option("--most", min=1, max=MOST_LINES, help="Largest number of messages.")] = 1_000,
    as_json: AsJson = False,
) -> None:
    """Print its messages in the order of sending; with --json, whole, one in each line."""
    from backbone.command_line.recording_work import print_messages

    _require_ordered(since, until)
    run(lambda: print_messages(file, tuple(keys or ()), since, until, most, as_json=as_json))


@recording.command("story")
def print_story(
    file: File,
    name: Annotated[str, typer.Argument(help="A component, robot, behavior or person; default: all.")] = "",
    since: Since = 0.0,
    until: Until = None,
    as_json: AsJson = False,
) -> None:
    """Print the events of the mission's log that it holds, as 'story' and 'log' print them live."""
    from backbone.command_line.recording_work import print_events

    _require_ordered(since, until)
    run(lambda: print_events(file, name, since, until, as_json=as_json))


@recording.command()
def why(
    file: File,
    name: Annotated[str, typer.Argument(help="An ARC, behavior, console, resource or component.")],
    at_s: Annotated[
        float | None,
        typer.Option("--at", min=0, max=LATEST_S, help="Mission time, seconds; default: the end of the recording."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print why something was as it was at any instant, as 'why' printed it live."""
    from backbone.command_line.replaying import print_reasons_at

    run(lambda: print_reasons_at(file, name, at_s, as_json=as_json))


@recording.command()
def export(
    file: File,
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A new folder.")],
    keys: Keys = None,
    table_format: Annotated[
        TableFormat, typer.Option("--format", help="parquet: columns keep their types, lists stay lists.")
    ] = TableFormat.CSV,
    video: Annotated[bool, typer.Option("--video", help="Also an MP4 file for each camera.")] = False,
) -> None:
    """Write a table for each key, with who commanded the robot in each row."""
    from backbone.command_line.exporting import CsvTables
    from backbone.command_line.exporting import export as export_to
    from backbone.command_line.extras import needing_extras

    make_tables: Callable[[Path], TableWriter] = CsvTables
    if table_format is TableFormat.PARQUET:
        with needing_extras():
            from backbone.recording.parquet_tables import ParquetTables
        make_tables = ParquetTables
    run(lambda: export_to(file, folder, tuple(keys or ()), make_tables, with_videos=video))


@recording.command()
def lerobot(
    file: File,
    folder: Annotated[Path, typer.Argument(metavar="FOLDER", help="A new folder.")],
    robot: Annotated[str, typer.Option("--robot", metavar="NAME", help="The robot.")],
    rate_hz: Annotated[int, typer.Option("--rate", min=1, max=100, help="Steps in a second.")] = 10,
    task: Annotated[str, typer.Option("--task", help="What was done, in words; default: by a behavior's name.")] = "",
    without_pictures: Annotated[
        bool, typer.Option("--without-pictures", help="No pictures, and also grants that had none.")
    ] = False,
) -> None:
    """Write what a robot saw and did in each grant as a data set that LeRobot reads, with who commanded it."""
    from backbone.command_line.exporting import DATA_SETS, export_for_lerobot
    from backbone.command_line.extras import needing_extras

    with needing_extras():
        import_module(DATA_SETS)
    run(lambda: export_for_lerobot(file, folder, robot, rate_hz, task, with_pictures=not without_pictures))


@recording.command()
def foxglove(
    file: File,
    to: Annotated[Path, typer.Argument(metavar="TO.mcap", help="The new file.")],
    keys: Keys = None,
) -> None:
    """Write a copy that Foxglove, Lichtblick and Rerun show: pictures, robots in their room, log, all numbers."""
    from backbone.command_line.extras import needing_extras

    with needing_extras():
        from backbone.command_line.foxglove_copy import copy_for_foxglove
    run(lambda: copy_for_foxglove(file, to, tuple(keys or ())))


@recording.command("mission")
def print_mission(file: File) -> None:
    """Print the mission file that was up."""
    from backbone.command_line.recording_work import print_mission_file

    run(lambda: print_mission_file(file))


def replay(
    file: File,
    speed: Annotated[
        float | None, typer.Option("--speed", min=0.01, max=100.0, help="Mission seconds a second; default: 1.")
    ] = None,
    is_stepped: Annotated[
        bool, typer.Option("--step", help="Message by message: a line of input plays the one that is shown.")
    ] = False,
    since_s: Annotated[
        float | None,
        typer.Option("--from", min=EARLIEST_S, max=LATEST_S, help="Begin at this mission time; default: at the begin."),
    ] = None,
    keys: Keys = None,
    without: Annotated[
        list[str] | None,
        typer.Option("--without", metavar="NAME", help="Run it for real, and compare its messages; repeatable."),
    ] = None,
    class_path: Annotated[
        str, typer.Option("--class", metavar="MODULE:CLASS", help="With one --without: another class.")
    ] = "",
    values: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="NAME=VALUE", help="With one --without: another parameter or rule; repeatable."),
    ] = None,
    tolerances: Tolerances = None,
    as_json: AsJson = False,
    mission: Annotated[
        str | None, typer.Option("--mission", help="Name under which it is up; default: replay-NAME.")
    ] = None,
) -> None:
    """Play a recording as a mission that is up; with --without NAME, run these components on it and compare instead."""
    from backbone.command_line import replaying

    given, allowed = dict(map(named_value, values or [])), dict(map(_tolerance, tolerances or []))
    names = list(dict.fromkeys(without or []))
    if "" in names:
        raise typer.BadParameter("--without needs the name of a component")
    if len(names) > 1 and (class_path or given or "rc_manager" in names):
        raise typer.BadParameter("--class, --set and the rc_manager are for a single --without NAME")
    if names:
        _refuse({"--speed": speed, "--step": is_stepped, "--keys": keys, "--mission": mission}, "--without NAME")
    if names == ["rc_manager"]:
        _refuse({"--class": class_path, "--tolerance": allowed}, "--without rc_manager")
        run(lambda: replaying.decide_anew(file, since_s or 0.0, given, as_json=as_json))
    if names:
        _refuse({"--from": since_s}, "--without NAME, except rc_manager")
        run(lambda: replaying.run_without(file, names, class_path, given, allowed, as_json=as_json))
    if class_path or given or allowed or as_json:
        raise typer.BadParameter("--class, --set, --tolerance and --json are for --without NAME")
    wanted = replaying.Playing(mission, since_s, speed or 1.0, is_stepped, tuple(keys or ()))
    run(lambda: replaying.play(file, wanted))


def _require_ordered(since_s: float, until_s: float | None) -> None:
    """Refuse times between which no message can be."""
    if until_s is not None and until_s < since_s:
        raise typer.BadParameter(f"--until {until_s:g} comes before --since {since_s:g}: exchange them")


def _refuse(options: Mapping[str, object], with_what: str) -> None:
    """Refuse options that would have no effect."""
    given = [name for name, value in options.items() if value not in (None, False, "", {}, [])]
    if given:
        raise typer.BadParameter(f"{', '.join(given)}: no effect with {with_what}")


def compare(
    files: Annotated[list[Path], typer.Argument(metavar="A.mcap…", help="Two recordings; with --detect any number.")],
    keys: Keys = None,
    tolerances: Tolerances = None,
    marks: Annotated[
        Path | None,
        typer.Option("--detect", metavar="MARKS.jsonl", help="What watchers saw of these marks, instead of all keys."),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare recordings key by key, or with --detect what was seen in them; exit code 5: they differ, or are worse."""
    from backbone.command_line import comparing

    allowed = dict(_tolerance(one) for one in tolerances or [])
    if marks is not None:
        if keys or not allowed.keys() <= {DELAY}:
            raise typer.BadParameter(f"with --detect only --tolerance {DELAY}=X, for later detections, counts")
        run(lambda: comparing.compare_detection(files, marks, allowed.get(DELAY, 0.0), as_json=as_json))
    if len(files) != 2:
        raise typer.BadParameter("two recordings are compared; more or one only with --detect")
    first, second = files
    run(lambda: comparing.compare(first, second, tuple(keys or ()), allowed, as_json=as_json))


def _tolerance(given: str) -> tuple[str, float]:
    field, value = named_value(given)
    if not isinstance(value, int | float) or isinstance(value, bool) or not 0 <= value <= MOST_TOLERANCE:
        raise typer.BadParameter(f"{given!r} is not FIELD=X with a number of at least 0")
    return field, float(value)
