"""No file is too long to be read as a whole."""

from __future__ import annotations

from pathlib import Path

TOP = Path(__file__).parents[2]
ROOMS = ("backbone", "bench", "docs", "mission_control", "resource_pool", "scout_model", "tests", "ui_console")
MOST_LINES = 400  # chosen: ten screens; of the 800 files half have 120 or fewer


def test_no_file_has_more_than_400_lines() -> None:
    lengths = {
        str(path.relative_to(TOP)): len(path.read_text().splitlines())
        for room in ROOMS
        for path in (TOP / room).rglob("*.py")
        if not any(part.startswith(".") for part in path.relative_to(TOP).parts)
    }
    assert len(lengths) > 700
    assert {path: lines for path, lines in lengths.items() if lines > MOST_LINES} == {}
