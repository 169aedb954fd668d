"""``down`` of a mission that ends meanwhile by itself, or by another ``down``."""

from __future__ import annotations

import asyncio
import subprocess
from pathlib import Path
from typing import Any

import pytest

from backbone import run_files
from backbone.errors import HubUnreachable
from backbone.launcher import detached
from backbone.run_files import RunFile

pytestmark = pytest.mark.processes


@pytest.mark.parametrize("when", ["before it is asked", "while it is asked"])
def test_a_launcher_that_ends_meanwhile_is_down(
    when: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    launcher = subprocess.Popen(["sleep", "60"])
    found = RunFile("m", "unixsock-stream/nowhere", launcher.pid, 0.0, 1.0, "base", "m.xml")

    class Unreachable:
        @staticmethod
        async def open_when_up(*_given: Any) -> Any:
            end()
            raise HubUnreachable("nowhere")

    def end() -> None:
        launcher.kill()
        launcher.wait()

    def find(_mission: str | None) -> RunFile:
        if when == "before it is asked":
            end()
        return found

    monkeypatch.setattr(detached, "ZenohBus", Unreachable)
    monkeypatch.setattr(run_files, "find", find)
    assert asyncio.run(detached.take_down("m")) == 0
    assert "mission m is down; its launcher has ended meanwhile" in capsys.readouterr().err
