"""Whatever a command writes to a pipe that is not read: it can be ended, and holds up no mission."""

from __future__ import annotations

import os
import signal
import subprocess
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

import pytest
from running_mission import BIN, MISSION_XML, RunningMission, mission_up

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

SMALLEST = MISSION_XML.parent / "docs" / "examples" / "smallest.xml"
UP_WITHIN_S, ENDED_WITHIN_S = 60.0, 30.0


@pytest.fixture
def full_pipe() -> Iterator[int]:
    """Return the end for writing of a pipe that takes no more bytes."""
    reader, its_end = os.pipe()
    os.set_blocking(its_end, False)
    with suppress(BlockingIOError):
        while True:
            os.write(its_end, b" ")
    os.set_blocking(its_end, True)
    yield its_end
    os.close(its_end)
    os.close(reader)


@pytest.fixture(scope="module")
def mission() -> Iterator[RunningMission]:
    with mission_up(mission_xml=SMALLEST) as running:
        yield running


def test_top_ends_when_its_time_is_over(full_pipe: int, mission: RunningMission) -> None:
    words = [str(BIN / "scout-backbone"), "top", "--for", "0.5", "--mission", mission.name]
    done = subprocess.run(
        words, env=mission.environment, stdout=full_pipe, stderr=subprocess.PIPE, text=True, timeout=60, check=False
    )
    assert done.returncode == 0
    assert "came faster than they were read" in done.stderr


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
