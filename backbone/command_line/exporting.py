"""The work of ``scout-backbone recording export``: a table for each key, and a video for each camera."""

from __future__ import annotations

import csv
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from pathlib import Path
from typing import Any

from backbone.command_line.recording_work import opened
from backbone.command_line.unusable_file import FileUnusable
from backbone.launcher.endings import ExitCode, say
from backbone.recording.hearing import is_meant
from backbone.recording.reader import Recording
from backbone.recording.tables import FIRST_COLUMNS, Commanders, row_of, table_of
from backbone.spoken import counted

VIDEOS = "mission_control.vision.recorded_video"  # named, because imports run downwards only
ROWS_AT_ONCE = 1000  # chosen: a table is open for a moment only, and there may be hundreds


async def export(path: Path, folder: Path, keys: tuple[str, ...], *, with_videos: bool) -> ExitCode:
    """Write a CSV file for each key and schema into a new folder, and if wanted an MP4 file for each camera."""
    with opened(path) as recording, _new_folder(folder):
        tables, rows = _write_tables(recording, folder, keys)
        videos = import_module(VIDEOS).write_videos(recording, folder, keys) if with_videos else []
    said = f"{folder}: {counted(tables, 'table')} with {counted(rows, 'row')}"
    say(f"{said}, {counted(len(videos), 'video')}" if with_videos else said)
    return ExitCode.DONE


def _write_tables(recording: Recording, folder: Path, keys: tuple[str, ...]) -> tuple[int, int]:
    columns: dict[str, dict[str, None]] = defaultdict(lambda: dict.fromkeys(FIRST_COLUMNS))
    for message in recording.messages(keys):
        columns[table_of(message)].update(dict.fromkeys(row_of(message)))
    waiting: dict[str, list[dict[str, Any]]] = defaultdict(list)
    for table, names in columns.items():
        with (folder / f"{table}.csv").open("x", newline="", encoding="utf-8") as file:
            csv.writer(file).writerow(names)
    commanders, count = Commanders(), 0
    for message in recording.messages():
        commanders.take(message)
        if keys and not is_meant(message.key, keys):
            continue
        table = table_of(message)
        waiting[table].append(row_of(message, commanders.of(message)))
        count += 1
        if len(waiting[table]) >= ROWS_AT_ONCE:
            _append(folder / f"{table}.csv", columns[table], waiting.pop(table))
    for table, rows in waiting.items():
        _append(folder / f"{table}.csv", columns[table], rows)
    return len(columns), count


def _append(file: Path, columns: dict[str, None], rows: list[dict[str, Any]]) -> None:
    with file.open("a", newline="", encoding="utf-8") as opened_file:
        csv.DictWriter(opened_file, list(columns)).writerows(rows)


@contextmanager
def _new_folder(folder: Path) -> Iterator[None]:
    try:
        folder.mkdir(parents=True)
        yield
    except FileExistsError as error:
        raise FileUnusable(f"{folder} exists", remedy="Name a new folder.") from error
    except OSError as error:
        raise FileUnusable(f"{error.filename or folder}: {error.strerror or error}") from error
