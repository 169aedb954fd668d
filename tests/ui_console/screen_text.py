"""Content of a Textual screen as lines of text, and a comparison with the recorded content."""

from __future__ import annotations

import html
import os
import re
from collections import defaultdict
from pathlib import Path
from typing import Any

from textual.app import App

SNAPSHOTS = Path(__file__).parent / "snapshots"
UPDATE = "SCOUT_UPDATE_SNAPSHOTS"
_TEXT = re.compile(r'<text class="[^"]*-r\d+" x="([\d.]+)" y="([\d.]+)"[^>]*>([^<]*)</text>')
CELL = 12.2  # Textual's SVG export draws every cell this wide


def screen_text(app: App[Any]) -> str:
    """Return what the screen shows, without colors."""
    lines: dict[float, dict[int, str]] = defaultdict(dict)
    for x, y, text in _TEXT.findall(app.export_screenshot()):
        lines[float(y)][round(float(x) / CELL)] = html.unescape(text).replace("\xa0", " ")
    return "\n".join(_line(lines[y]) for y in sorted(lines)) + "\n"


def same_as_before(app: App[Any], name: str) -> None:
    """Compare the screen with the snapshot of this name; with ``SCOUT_UPDATE_SNAPSHOTS=1`` take a new one."""
    shown, kept = screen_text(app), SNAPSHOTS / f"{name}.txt"
    if os.environ.get(UPDATE):
        SNAPSHOTS.mkdir(exist_ok=True)
        kept.write_text(shown)
    assert kept.exists(), f"no snapshot {kept.name}: look at the screen, then take one with {UPDATE}=1\n{shown}"
    assert shown == kept.read_text(), f"{name} looks different; if that is meant, take it anew with {UPDATE}=1"


def _line(pieces: dict[int, str]) -> str:
    line = ""
    for column in sorted(pieces):
        line = line.ljust(column) + pieces[column]
    return line.rstrip()
