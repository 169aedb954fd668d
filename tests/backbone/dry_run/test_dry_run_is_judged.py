"""The independent checker of traces finds nothing wrong with the trace of a dry run."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from trace_checker import check

from backbone.dry_run.run import dry_run
from backbone.mission.reader import read_mission

MISSION_XML = Path(__file__).parents[3] / "mission.xml"


@pytest.mark.parametrize("lower", [False, True], ids=["equals", "one is lower"])
@pytest.mark.parametrize("for_s", [0.0, 7.3, 300.0])
def test_the_checker_finds_nothing_wrong_with_a_dry_run(for_s: float, lower: bool, tmp_path: Path) -> None:
    text = MISSION_XML.read_text()
    if lower:
        text = text.replace('name="watch-scout2" priority="1"', 'name="watch-scout2" priority="0"')
    file, trace = tmp_path / "mission.xml", tmp_path / "trace.jsonl"
    file.write_text(text)
    dry_run(read_mission(file), for_s).write_trace(trace)
    lines = [json.loads(line) for line in trace.read_text().splitlines()]
    assert check(lines) == []
