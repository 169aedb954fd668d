"""A script that is not there is told in plain words, before any mission is looked for."""

from __future__ import annotations

from pathlib import Path

import pytest

from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode
from ui_console.session.headless import drive_by_script


async def test_a_script_that_cannot_be_read_is_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    missing = str(tmp_path / "none.jsonl")
    assert await drive_by_script(Where(None, None, None), {}, "", missing, 0.0) == ExitCode.USAGE
    assert capsys.readouterr().err == f"{missing} cannot be read: No such file or directory\n"
