"""The terminal of ``up`` is closed or not read: its mission ends in good order, and its recording is whole."""

from __future__ import annotations

import fcntl
import os
import pty
import select
import signal
import struct
import subprocess
import sys
import termios
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

from backbone.recording.reader import Recording, open_file

pytestmark = [pytest.mark.processes, pytest.mark.thorough, pytest.mark.timeout(180)]

BIN = Path(sys.executable).parent
SMALLEST = Path(__file__).parents[2] / "docs" / "examples" / "smallest.xml"
LIVE_PICTURE = b"\x1b[?1049h"  # the terminal's other screen
UP_WITHIN_S, ENDED_WITHIN_S = 60.0, 30.0


@pytest.fixture
def hangups() -> Iterator[None]:
    """Let processes of a test notice SIGHUP, also if the tests run under ``nohup``."""
    ignored = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, ignored)


def wait_shown(terminal: int, what: bytes) -> None:
    """Return when the words are on the terminal."""
    shown, deadline = b"", time.monotonic() + UP_WITHIN_S
    while what not in shown:
        assert time.monotonic() < deadline, shown.decode(errors="replace")
        if select.select([terminal], [], [], 1.0)[0]:
            shown += os.read(terminal, 1 << 16)


@pytest.mark.usefixtures("hangups")
def test_the_mission_goes_down_and_its_recording_is_whole(short_path: Path, tmp_path: Path) -> None:
    recording = tmp_path / "all.mcap"
    terminal, its_end = pty.openpty()
    with subprocess.Popen(
        [str(BIN / "scout-backbone"), "up", str(SMALLEST), "--record", str(recording)],
        env={**os.environ, "XDG_RUNTIME_DIR": str(short_path), "TERM": "xterm-256color"},
        stdin=its_end,
        stdout=its_end,
        stderr=its_end,
        start_new_session=True,
    ) as up:
        try:
            os.close(its_end)
            wait_shown(terminal, LIVE_PICTURE)
            os.close(terminal)
            up.send_signal(signal.SIGHUP)
            assert up.wait(ENDED_WITHIN_S) == 0
        finally:
            up.kill()
    [end] = (short_path / "scout-backbone").iterdir()
    assert "SIGHUP, as its terminal was closed" in end.read_text()
    with open_file(recording) as file:
        assert Recording(file).contents().messages > 0


def test_a_terminal_that_is_not_read_holds_up_no_mission(short_path: Path) -> None:
    terminal, its_end = pty.openpty()
    fcntl.ioctl(its_end, termios.TIOCSWINSZ, struct.pack("HHHH", 200, 500, 0, 0))  # one picture is more than it takes
    environment = {**os.environ, "XDG_RUNTIME_DIR": str(short_path), "TERM": "xterm-256color"}
    with subprocess.Popen(
        [str(BIN / "scout-backbone"), "up", str(SMALLEST)],
        env=environment,
        stdin=its_end,
        stdout=its_end,
        stderr=its_end,
        start_new_session=True,
    ) as up:
        try:
            wait_shown(terminal, LIVE_PICTURE)
            time.sleep(2.0)  # in which nobody reads
            down = [str(BIN / "scout-backbone"), "down"]
            done = subprocess.run(down, env=environment, capture_output=True, text=True, timeout=60, check=False)
            assert (done.returncode, "asking was enough" in done.stderr) == (0, True), done.stderr
            assert up.wait(ENDED_WITHIN_S) == 0
        finally:
            up.kill()
            os.close(its_end)
            os.close(terminal)
