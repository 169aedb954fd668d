"""The work of ``scout-backbone recording export``: a table for each key, and a video for each camera."""

from __future__ import annotations

import csv
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import closing
from importlib import import_module
from pathlib import Path
from tempfile import TemporaryFile
from typing import Any, ClassVar, Protocol

import msgspec

from backbone.command_line.opened_recording import opened, require_selected
from backbone.command_line.unusable_file import new_folder
from backbone.launcher.endings import ExitCode, say
from backbone.recording.hearing import is_meant
from backbone.recording.reader import Recorded, Recording
from backbone.recording.tables import FIRST_COLUMNS, TOLD_IN, Commanders, FileNames, row_of
from backbone.spoken import counted

VIDEOS = "mission_control.vision.recorded_video"  # named as text, because imports run downwards only
DATA_SETS = "mission_control.training_data.lerobot_dataset"  # as text for the same reason
ROWS_AT_ONCE = 1000  # chosen: so many rows of a table are in memory, and in a row group of Parquet
MOST_WAITING_BYTES = 1 << 26  # chosen: a mission of hundreds of keys needs no more, and a table's batch stays large
_decode_batch = msgspec.json.Decoder(tuple[str, list[dict[str, Any]]]).decode
COLUMN_BYTES = 150  # measured: a value in its dictionary, with the name of its column
_LONG = str, list


class TableWriter(Protocol):
    """Files of tables in a folder; ``learn`` gets all rows before ``write`` gets the first."""

    splits_lists: ClassVar[bool]
    """True: each item of a list is a column."""

    def learn(self, table: str, rows: Sequence[Mapping[str, object]]) -> None:
        """Note which columns the table has."""

    def write(self, table: str, rows: Sequence[Mapping[str, object]]) -> None:
        """Append rows to the table's file."""

    def close(self) -> None:
        """Write the ends of all files."""


class CsvTables:
    """CSV files. Each file is open only while rows are written, because there may be hundreds."""

    splits_lists: ClassVar[bool] = True

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._columns: dict[str, dict[str, None]] = defaultdict(lambda: dict.fromkeys(FIRST_COLUMNS))
        self._begun: set[str] = set()

    def learn(self, table: str, rows: Sequence[Mapping[str, object]]) -> None:
        """Note the names of the columns."""
        columns = self._columns[table]
        for row in rows:
            if not row.keys() <= columns.keys():
                columns.update(dict.fromkeys(row))

    def write(self, table: str, rows: Sequence[Mapping[str, object]]) -> None:
        """Append rows, the first below a line with the names."""
        with (self._folder / f"{table}.csv").open("a", newline="", encoding="utf-8") as file:
            writer, [at_s, *others] = csv.writer(file), self._columns[table]
            if table not in self._begun:
                self._begun.add(table)
                writer.writerow(self._columns[table])
            writer.writerows([f"{row[at_s]:.6f}", *map(row.get, others)] for row in rows)

    def close(self) -> None:
        """Do nothing: each file is complete already."""


async def export(
    path: Path, folder: Path, keys: tuple[str, ...], make_tables: Callable[[Path], TableWriter], *, with_videos: bool
) -> ExitCode:
    """Write a file for each key and schema into a new folder, with ``with_videos`` also an MP4 file for each camera.

    Raises:
        NothingSelected: No message has one of these keys.
    """
    with opened(path) as recording:
        require_selected(recording, path, keys)
        with new_folder(folder) as made:
            with closing(make_tables(made)) as tables:
                names, rows = _write_tables(recording, made, tables, keys)
            videos = import_module(VIDEOS).write_videos(recording, made, keys) if with_videos else []
    said = f"{folder}: {counted(names, 'table')} with {counted(rows, 'row')}"
    say(f"{said}, {counted(len(videos), 'video')}" if with_videos else said)
    return ExitCode.DONE


async def export_for_lerobot(
    path: Path, folder: Path, robot: str, rate_hz: int, task: str, *, with_pictures: bool
) -> ExitCode:
    """Write the grants of a robot into a new folder, as episodes that LeRobot reads."""
    with opened(path) as recording:
        data_set = import_module(DATA_SETS).data_set(recording, robot, rate_hz, task, with_pictures=with_pictures)
        with new_folder(folder) as made:
            said = data_set.write(made)
    say(f"{folder}: {said}")
    return ExitCode.DONE


def _write_tables(recording: Recording, folder: Path, tables: TableWriter, keys: tuple[str, ...]) -> tuple[int, int]:
    """Write the tables; return their number and that of their rows.

    Decoding is the most work. Therefore the rows wait in a temporary file until all columns are known.
    """
    found = Counter[str]()
    with TemporaryFile(dir=folder) as waiting:
        for table, rows in _batches(FileNames(), _rows(recording, keys, splits_lists=tables.splits_lists)):
            tables.learn(table, rows)
            found[table] += len(rows)
            waiting.write(msgspec.json.encode((table, rows)) + b"\n")
        waiting.seek(0)
        for batch in waiting:
            tables.write(*_decode_batch(batch))
    return len(found), found.total()


def _rows(
    recording: Recording, keys: tuple[str, ...], *, splits_lists: bool
) -> Iterator[tuple[Recorded, dict[str, object]]]:
    commanders = Commanders(recording.messages(TOLD_IN, newest_first=True))
    for message in recording.messages((*keys, *TOLD_IN) if keys else ()):
        commanders.take(message)
        if not keys or is_meant(message.key, keys):
            yield message, row_of(message, commanders.of(message), splits_lists=splits_lists)


def _batches(
    names: FileNames, rows: Iterable[tuple[Recorded, dict[str, object]]]
) -> Iterator[tuple[str, list[dict[str, object]]]]:
    """Yield table and rows, up to ``ROWS_AT_ONCE`` of them; fewer, if all tables have ``MOST_WAITING_BYTES``."""
    waiting: dict[str, list[dict[str, object]]] = defaultdict(list)
    sizes = Counter[str]()
    waiting_bytes = 0
    for message, row in rows:
        table, size = names.of(message.key, message.schema or "bytes"), _size(row)
        waiting[table].append(row)
        sizes[table] += size
        waiting_bytes += size
        if len(waiting[table]) >= ROWS_AT_ONCE:
            full = table
        elif waiting_bytes > MOST_WAITING_BYTES:
            full = max(sizes, key=sizes.__getitem__)
        else:
            continue
        waiting_bytes -= sizes.pop(full)
        yield full, waiting.pop(full)
    yield from waiting.items()


def _size(row: Mapping[str, object]) -> int:
    """Return roughly how many bytes a row takes in memory."""
    return COLUMN_BYTES * len(row) + sum([len(value) for value in row.values() if isinstance(value, _LONG)])
