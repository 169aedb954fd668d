"""A recording is exported to tables that hold its messages, and who commanded."""

from __future__ import annotations

import csv
import io
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from pyarrow import parquet
from small_recordings import SCOUT, Said, recorded

from backbone.command_line import exporting
from backbone.command_line.exporting import ROWS_AT_ONCE, CsvTables, export
from backbone.command_line.foxglove_copy import copy_for_foxglove
from backbone.command_line.opened_recording import NothingSelected
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from backbone.rc_manager.messages import Connect
from backbone.recording.parquet_tables import ParquetTables
from backbone.recording.reader import Recording
from backbone.recording.tables import row_of
from backbone.scheduling.requests import RcUse, RequestState
from backbone.scheduling.views import RequestView, Schedule
from resource_pool.messages import Applied, Readings

TABLES, ROWS = 6, 40
RC_MANAGER, ARC = "backbone/rc_manager", "watch-drive"
WAITS = RequestView(ARC, "mission_control/watch", RequestState.WAITING, [], 0.0, -1.0, 2.0, "", [], 5.0, "night:1", 0)
APPLIED, READINGS = "resource_pool_scout1_motions_Applied", "resource_pool_scout1_readings_Readings"


def a_night() -> list[Said]:
    """Return what was said: a behavior gets the robot and moves it, which reports more often than a row group holds."""
    moved = Applied("scout1", 7, 3.0, "move", {"forward_m_s": 0.25})
    return [
        Said(1.0, RC_MANAGER, Conversation.SCHEDULE, Schedule(1.0, [], [WAITS], []), RC_MANAGER),
        Said(2.0, SCOUT, Conversation.ASK, Connect(ARC, 7, 2.0, RcUse([]), {"scout1": 7}), RC_MANAGER),
        Said(3.0, SCOUT, Conversation.MOTIONS, moved),
        *(
            Said(4.0 + number / 100, SCOUT, Conversation.READINGS, Readings("scout1", 4.0, {"way_m": float(number)}))
            for number in range(ROWS_AT_ONCE + 5)
        ),
    ]


@pytest.fixture(scope="module")
def night(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("night") / "night.mcap"
    path.write_bytes(recorded(a_night()).getvalue())
    return path


async def test_parquet_files_hold_the_recording_with_its_types(night: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    assert await export(night, folder, (), ParquetTables, with_videos=False) is ExitCode.DONE
    read = parquet.ParquetFile(folder / f"{READINGS}.parquet")
    with night.open("rb") as file:
        messages = list(Recording(file).messages(("*/readings",)))
    rows = read.read().to_pylist()
    assert [(row["at_s"], row["source"], row["sequence"]) for row in rows] == [
        (message.at_s, message.source, message.sequence) for message in messages
    ]
    assert [row["values.way_m"] for row in rows] == [message.body["values"]["way_m"] for message in messages]
    assert read.num_row_groups == 2
    [applied] = parquet.read_table(folder / f"{APPLIED}.parquet").to_pylist()
    assert (applied["commanded_by"], applied["epoch"], applied["values.forward_m_s"]) == ("watch", 7, 0.25)
    [schedule] = parquet.read_table(folder / "backbone_rc_manager_schedule_Schedule.parquet").to_pylist()
    assert schedule["requests"][0]["arc"] == ARC


def rows_of(path: Path) -> list[dict[str, str]]:
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


async def test_csv_files_hold_the_same_as_text(night: Path, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    await export(night, folder, ("*/motions", "*/schedule"), CsvTables, with_videos=False)
    assert sorted(file.name for file in folder.iterdir()) == [
        "backbone_rc_manager_schedule_Schedule.csv",
        f"{APPLIED}.csv",
    ]
    [applied] = rows_of(folder / f"{APPLIED}.csv")
    assert (applied["at_s"], applied["commanded_by"], applied["values.forward_m_s"]) == ("3.000000", "watch", "0.25")
    [schedule] = rows_of(folder / "backbone_rc_manager_schedule_Schedule.csv")
    assert schedule["requests.0.arc"] == ARC


async def test_each_table_has_the_bytes_that_the_library_for_csv_writes(tmp_path: Path) -> None:
    """Rows wait in a file of another form; no value may change on that way, nor may a later column be lost."""
    numbers = [0.1, 1e22, -0.0, 5.0, 1 / 3, 2.0**53]
    texts = ["", 'a "word"', "a,b", "two\r\nlines", "ä☃", "\u2028"]
    said = [
        Said(1.0 + at, SCOUT, Conversation.MOTIONS, Applied("scout1", 7, at, text, {f"x{at % 3}": number}))
        for at, (number, text) in enumerate(zip(numbers, texts, strict=True))
    ]
    night, folder, expected = tmp_path / "night.mcap", tmp_path / "out", io.StringIO(newline="")
    night.write_bytes(recorded(said).getvalue())
    await export(night, folder, (), CsvTables, with_videos=False)
    with night.open("rb") as file:
        rows = [row_of(one) for one in Recording(file).messages()]
    writer = csv.DictWriter(expected, list(dict.fromkeys(column for row in rows for column in row)))
    writer.writeheader()
    writer.writerows({**row, "at_s": f"{row['at_s']:.6f}"} for row in rows)
    assert (folder / f"{APPLIED}.csv").read_bytes() == expected.getvalue().encode()
    assert {one.name for one in folder.iterdir()} == {f"{APPLIED}.csv"}


async def test_no_message_is_decoded_twice_except_those_that_tell_who_commands(
    night: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Decoding is the most work of an export."""
    read, records = Counter[str](), Recording.records

    def counted(*given: Any, **named: Any) -> Iterator[Any]:
        for one in records(*given, **named):
            read[one[3].schema] += 1
            yield one

    monkeypatch.setattr(Recording, "records", counted)
    await export(night, tmp_path / "out", (), CsvTables, with_videos=False)
    assert read["Readings/1"] == ROWS_AT_ONCE + 5


async def test_keys_that_no_message_has_are_refused_and_nothing_is_made(night: Path, tmp_path: Path) -> None:
    made, keys = tmp_path / "made", ("*/redings",)
    with pytest.raises(NothingSelected, match=r"no message whose key matches \*/redings"):
        await export(night, made, keys, CsvTables, with_videos=False)
    with pytest.raises(NothingSelected):
        await copy_for_foxglove(night, made, keys)
    assert not made.exists()
    assert await export(night, made, ("*/redings", "*/readings"), CsvTables, with_videos=False) is ExitCode.DONE


async def test_keys_whose_parts_join_to_the_same_name_have_files_of_their_own(tmp_path: Path) -> None:
    addresses = ("resource_pool/a/b", "resource_pool/a_b")
    path, folder = tmp_path / "night.mcap", tmp_path / "out"
    told = [Said(1.0, one, Conversation.READINGS, Readings(one, 1.0, {"x": 1.0}), one) for one in addresses]
    path.write_bytes(recorded(told).getvalue())
    await export(path, folder, (), CsvTables, with_videos=False)
    assert [[row["source"] for row in rows_of(file)] for file in sorted(folder.iterdir())] == [
        [one] for one in addresses
    ]


def scout_backbone(*words: str, begin: str = "") -> subprocess.CompletedProcess[str]:
    code = f"import sys\n{begin}\nfrom backbone.command_line.cli import app; app({list(words)!r})"
    return subprocess.run([sys.executable, "-c", code], check=False, capture_output=True, text=True, timeout=60)


async def test_rows_of_many_tables_do_not_wait_for_full_batches(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Hundreds of keys with a thousand rows each would fill the memory."""
    batches = list[int]()

    class Tables(CsvTables):
        def learn(self, table: str, rows: Sequence[Mapping[str, object]]) -> None:
            batches.append(len(rows))
            super().learn(table, rows)

    robots = [f"resource_pool/robot{number}" for number in range(TABLES)]
    said = [
        Said(at_s, robot, Conversation.READINGS, Readings("", at_s, {"way_m": at_s}), robot)
        for at_s in map(float, range(ROWS))
        for robot in robots
    ]
    night = tmp_path / "night.mcap"
    night.write_bytes(recorded(said).getvalue())
    await export(night, tmp_path / "whole", (), Tables, with_videos=False)
    assert batches == [ROWS] * TABLES
    batches.clear()
    monkeypatch.setattr(exporting, "MOST_WAITING_BYTES", TABLES * ROWS * exporting.COLUMN_BYTES)
    await export(night, tmp_path / "parts", (), Tables, with_videos=False)
    assert max(batches) < ROWS
    assert len(batches) < TABLES * ROWS / 2
    for whole in (tmp_path / "whole").iterdir():
        assert whole.read_text() == (tmp_path / "parts" / whole.name).read_text()


@pytest.mark.processes
def test_the_command_tells_what_it_lacks(night: Path, tmp_path: Path) -> None:
    words = ("recording", "export", str(night), str(tmp_path / "out"), "--format", "parquet")
    lacking = scout_backbone(*words, begin="sys.modules['pyarrow'] = None")
    assert (lacking.returncode, "scout-backbone[parquet]" in lacking.stderr) == (2, True), lacking.stderr
    assert not (tmp_path / "out").exists()
    done = scout_backbone(*words)
    assert (done.returncode, f"4 tables with {len(a_night())} rows" in done.stderr) == (0, True), done.stderr
