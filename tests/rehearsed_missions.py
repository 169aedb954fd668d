"""Missions rehearsed as ``scout-backbone check --dry-run`` does it, in this process."""

from __future__ import annotations

from pathlib import Path

from typer.testing import CliRunner

from backbone.command_line.cli import app


def assert_each_gets_its_turn(mission: Path) -> None:
    """Fail unless the mission file is sound and every request of the mission is granted."""
    done = CliRunner().invoke(app, ["check", str(mission), "--dry-run"])
    assert (done.exit_code, "every request gets its turn" in done.output) == (0, True), done.output
