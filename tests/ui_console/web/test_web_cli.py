"""``scout-console serve`` refuses early and says what to do."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from typer.testing import CliRunner

from ui_console.cli import app


@pytest.fixture(autouse=True)
def _no_mission_is_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


def test_without_a_mission_nothing_is_served() -> None:
    done = CliRunner().invoke(app, ["serve", "--port", "0"])
    assert done.exit_code == 4
    assert "scout-backbone up" in done.stderr
    assert done.stdout == "", "no token for what is not served"


@pytest.mark.parametrize("arguments", [["--operator", "anna"], ["--operator", "anna=-1"], ["--port", "70000"]])
def test_wrong_options_are_refused_before_a_mission_is_looked_for(arguments: list[str]) -> None:
    assert CliRunner().invoke(app, ["serve", *arguments]).exit_code == 2


@pytest.mark.processes
def test_other_commands_load_neither_the_server_nor_its_library() -> None:
    check = (
        "import sys, ui_console.cli, ui_console.teleoperation, ui_console.scripted;"
        "sys.exit(', '.join({'websockets', 'cv2', 'ui_console.web.server'} & set(sys.modules)) or 0)"
    )
    done = subprocess.run([sys.executable, "-c", check], check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.processes
def test_without_its_library_it_says_what_to_install() -> None:
    check = (
        "import sys, asyncio; sys.modules['websockets'] = None\n"
        "from ui_console.cli import app; app(['serve', '--port', '0'])"
    )
    done = subprocess.run([sys.executable, "-c", check], check=False, capture_output=True, text=True)
    assert done.returncode == 2, done.stderr
    assert "scout-backbone[web]" in done.stderr
