"""A script that is not there is refused with a remedy, before any mission is looked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from backbone.command_line.unusable_file import FileUnusable
from backbone.command_line.where import Where
from ui_console.session.headless import drive_by_script


async def test_a_script_that_cannot_be_read_is_refused_with_a_remedy(tmp_path: Path) -> None:
    with pytest.raises(FileUnusable, match=r"none\.jsonl cannot be read: No such file or directory") as refused:
        await drive_by_script(Where(None, None, None), {}, "", str(tmp_path / "none.jsonl"), 0.0)
    assert "Name a file" in refused.value.remedy
