"""The shipped missions, as drafts open them."""

from __future__ import annotations

from pathlib import Path

ROOT = Path(__file__).parents[3]
EVERYTHING_DECLARED = ROOT / "tests" / "backbone" / "mission" / "everything_declared.xml"
SHIPPED = [
    ROOT / "mission.xml",
    *(ROOT / "docs" / "examples" / name for name in ("behaviors.xml", "home-at-the-end.xml")),
]
