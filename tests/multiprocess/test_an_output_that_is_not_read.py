"""Whatever ``up`` writes to a pipe that is not read: it can be ended, and holds up no mission."""

from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path

import pytest
from running_mission import BIN, MISSION_XML

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

SMALLEST = MISSION_XML.parent / "docs" / "examples" / "smallest.xml"
ENDED_WITHIN_S = 30.0


def test_up_goes_on_and_ends_in_good_order(full_pipe: int, short_path: Path) -> None:
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(short_path)}
    verdict, its_end = os.pipe()
    words = [str(BIN / "scout-backbone"), "up", str(SMALLEST), "--headless", "--tell-fd", str(its_end)]
    with subprocess.Popen(words, env=environment, stderr=full_pipe, pass_fds=[its_end]) as up:
        try:
            os.close(its_end)
            told = b""
            while b"all ready" not in told:
                told += os.read(verdict, 1 << 16)
            up.send_signal(signal.SIGTERM)
            assert up.wait(ENDED_WITHIN_S) == 0
        finally:
            up.kill()
            os.close(verdict)
    assert os.listdir(short_path / "scout-backbone") == []
