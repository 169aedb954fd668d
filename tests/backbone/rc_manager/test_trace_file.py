"""A trace that cannot be written stops, with whole lines only, and says why."""

from __future__ import annotations

import json
from pathlib import Path

from full_disk import disk_full_at

from backbone.rc_manager.trace_file import TraceFile

LINE = {"ev": "grant", "t": 1.5, "arc": "one"}


def test_lines_are_appended_to_what_is_there(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    for _ in range(2):
        trace = TraceFile(str(path))
        assert trace.write(LINE)
        trace.close()
    assert [json.loads(line) for line in path.read_text().splitlines()] == [LINE, LINE]


def test_a_full_disk_stops_the_trace_once_and_leaves_whole_lines_and_no_gap(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"
    trace = TraceFile(str(path))
    with disk_full_at(100):
        written = [trace.write(LINE) for _ in range(5)]
    assert written == [True, True, False, True, True], "told once"
    assert "too large" in trace.stopped_by
    trace.write(LINE)  # there is room again, but what is missing stays missing
    assert [json.loads(line) for line in path.read_text().splitlines()] == [LINE, LINE]


def test_a_device_that_takes_nothing_stops_the_trace() -> None:
    trace = TraceFile("/dev/full")
    assert not trace.write(LINE)
    assert trace.stopped_by == "No space left on device"


def test_a_file_that_cannot_be_opened_is_told_and_writing_goes_nowhere(tmp_path: Path) -> None:
    trace = TraceFile(str(tmp_path / "no" / "trace.jsonl"))
    assert "No such file" in trace.stopped_by
    assert trace.write(LINE)
    trace.close()


def test_no_trace_is_no_complaint() -> None:
    trace = TraceFile("")
    assert trace.write(LINE)
    assert trace.stopped_by == ""
