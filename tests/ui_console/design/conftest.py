"""What tests of the designer share."""

from __future__ import annotations

from pathlib import Path

import pytest
from design_stage import MISSION_XML


@pytest.fixture
def file(tmp_path: Path) -> Path:
    made = tmp_path / "guard.xml"
    made.write_bytes(MISSION_XML)
    return made
