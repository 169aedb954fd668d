"""A command ends as it should, whatever its standard streams are."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from examples import rest_thorough

pytestmark = pytest.mark.processes

COMMAND = f"{sys.executable} -c 'from backbone.command_line.cli import main; main()'"
NOT_UP = 4


def ended(words: str, where: Path, **more: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(where), **more}
    return subprocess.run(
        ["/bin/sh", "-c", f"{COMMAND} {words}"],
        capture_output=True,
        text=True,
        env=environment,
        timeout=60,
        check=False,
    )


@pytest.mark.parametrize("closed", rest_thorough(["<&- >&- 2>&-", "<&-", ">&-", "2>&-"]))
def test_a_command_with_a_closed_stream_ends_as_without(closed: str, tmp_path: Path) -> None:
    assert ended(f"status {closed}", tmp_path).returncode == NOT_UP
    assert ended(f"schema {closed}", tmp_path).returncode == 0


def test_an_output_without_room_is_told_in_a_line(tmp_path: Path) -> None:
    done = ended("schema >/dev/full", tmp_path)
    assert done.returncode == 1
    [line] = done.stderr.splitlines()
    assert "No space left on device" in line


def test_a_reader_that_goes_away_is_no_fault_to_tell(tmp_path: Path) -> None:
    assert ended("schema | head -c 1", tmp_path).stderr == ""


def test_a_character_that_the_encoding_lacks_is_shown_as_an_escape(tmp_path: Path) -> None:
    done = ended("check 'n\u00e4chste.xml'", tmp_path, PYTHONIOENCODING="ascii", PYTHONUTF8="1")
    assert "Traceback" not in done.stderr + done.stdout
    done = ended("status --help", tmp_path, PYTHONIOENCODING="ascii")
    assert (done.returncode, done.stderr) == (0, "")
