"""A trace that cannot be written stops, with whole lines only, and says why; a slow disk delays no decision."""

from __future__ import annotations

import asyncio
import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from full_disk import disk_full_at

from backbone.bus.clock import run_virtual
from backbone.rc_manager import trace_file
from backbone.rc_manager.trace_file import TraceFile

LINE = {"ev": "grant", "t": 1.5, "arc": "one"}


def lines(path: Path) -> list[object]:
    return [json.loads(line) for line in path.read_text().splitlines()]


def test_lines_are_appended_to_what_is_there(tmp_path: Path) -> None:
    path = tmp_path / "trace.jsonl"

    async def main() -> None:
        for _ in range(2):
            trace = TraceFile(str(path))
            for _ in range(3):
                trace.write(LINE)
            await trace.close()
            trace.write(LINE)
            await trace.close()

    run_virtual(main())
    assert lines(path) == [LINE] * 6


def test_a_full_disk_stops_the_trace_once_and_leaves_whole_lines_and_no_gap(tmp_path: Path) -> None:
    path, stops = tmp_path / "trace.jsonl", list[str]()

    async def main() -> None:
        trace = TraceFile(str(path), lambda: stops.append(trace.stopped_by))
        with disk_full_at(100):
            for _ in range(5):
                trace.write(LINE)
                await asyncio.sleep(1.0)
        trace.write(LINE)  # there is room again, but what is missing stays missing
        await trace.close()

    run_virtual(main())
    assert len(stops) == 1
    assert "too large" in stops[0]
    assert lines(path) == [LINE, LINE]


def test_a_device_that_takes_nothing_stops_the_trace() -> None:
    async def main() -> None:
        trace = TraceFile("/dev/full")
        trace.write(LINE)
        await trace.close()
        assert trace.stopped_by == "No space left on device"

    run_virtual(main())


def test_a_file_that_cannot_be_opened_is_told_and_writing_goes_nowhere(tmp_path: Path) -> None:
    trace = TraceFile(str(tmp_path / "no" / "trace.jsonl"))
    assert "No such file" in trace.stopped_by
    trace.write(LINE)
    run_virtual(trace.close())


def test_no_trace_is_no_complaint() -> None:
    trace = TraceFile("")
    trace.write(LINE)
    run_virtual(trace.close())
    assert trace.stopped_by == ""


@contextmanager
def hung_disk(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """Let each write wait for the event, and set it at the end."""
    works, write_all = threading.Event(), trace_file.write_all

    def write_when_it_works(descriptor: int, content: bytes) -> None:
        works.wait()
        write_all(descriptor, content)

    monkeypatch.setattr(trace_file, "write_all", write_when_it_works)
    try:
        yield works
    finally:
        works.set()


async def test_a_disk_that_hangs_delays_no_decision_and_loses_no_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "trace.jsonl"
    trace = TraceFile(str(path))
    numbered = [{**LINE, "t": number} for number in range(1000)]
    with hung_disk(monkeypatch) as works:
        for line in numbered:
            trace.write(line)
        await asyncio.sleep(0.05)
        assert lines(path) == []
        works.set()
        await trace.close()
    assert (lines(path), trace.stopped_by) == (numbered, "")


async def test_a_disk_that_hangs_for_too_long_stops_the_trace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace_file, "MOST_WAITING", 10)
    stops = list[str]()
    trace = TraceFile(str(tmp_path / "trace.jsonl"), lambda: stops.append(trace.stopped_by))
    with hung_disk(monkeypatch):
        for _ in range(100):
            trace.write(LINE)
        assert stops == ["the disk is too slow"]
    await trace.close()
    assert len(lines(tmp_path / "trace.jsonl")) <= 1, "what waited is not written after the gap"
    assert len(stops) == 1


async def test_an_end_does_not_wait_for_ever(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(trace_file, "CLOSE_WITHIN_S", 0.05)
    stops = list[str]()
    trace = TraceFile(str(tmp_path / "trace.jsonl"), lambda: stops.append(trace.stopped_by))
    with hung_disk(monkeypatch):
        trace.write(LINE)
        await trace.close()
        assert stops == ["the disk was too slow for the last lines"]
