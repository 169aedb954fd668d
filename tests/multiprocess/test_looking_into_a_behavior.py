"""Debug views of a real mission: the guide's commands print what it says, and a terminal shows a picture live."""

from __future__ import annotations

import asyncio
import os
import pty
import shutil
import tempfile
import termios
from pathlib import Path

import cv2
import pytest
from running_mission import BIN, MISSION_XML, RunningMission, mission_up
from tutorial_commands import run_all

pytestmark = [pytest.mark.processes, pytest.mark.timeout(180)]

GUIDE = MISSION_XML.parent / "docs" / "how-to" / "look-into-a-behavior.md"
WITHIN_S = 60.0


@pytest.mark.thorough
def test_every_command_of_the_guide_prints_what_it_says() -> None:
    with tempfile.TemporaryDirectory(prefix="scout-look-") as name:
        shutil.copy(MISSION_XML, Path(name) / "mission.xml")
        run_all(GUIDE, Path(name))
        saved = cv2.imread(str(Path(name) / "difference.png"), cv2.IMREAD_UNCHANGED)
        assert saved.shape == (120, 160)


@pytest.mark.thorough
async def test_a_picture_is_shown_live_in_a_terminal_and_q_leaves() -> None:
    with mission_up() as mission:
        await asyncio.to_thread(mission.wait_for_components, "watch-scout1", "watch-scout2")
        await asyncio.to_thread(has_shown, mission)
        for terminal in ("xterm-256color", "dumb"):
            await shows_until_q(mission, terminal)


async def shows_until_q(mission: RunningMission, terminal: str) -> None:
    """Start the command in a terminal of this ``TERM``; return after a picture, the key, and a good end."""
    ours, theirs = pty.openpty()
    termios.tcsetwinsize(ours, (40, 132))
    drawn = bytearray()
    is_shown = asyncio.Event()

    def read() -> None:
        drawn.extend(os.read(ours, 65536))
        if "▀".encode() in drawn and b"watch-scout1: difference" in drawn:
            is_shown.set()

    loop = asyncio.get_running_loop()
    loop.add_reader(ours, read)
    words = ("look", "watch-scout1", "difference", "--mission", mission.name)
    process = await asyncio.create_subprocess_exec(
        str(BIN / "scout-console"),
        *words,
        stdin=theirs,
        stdout=theirs,
        stderr=theirs,
        env={**mission.environment, "TERM": terminal},
        start_new_session=True,
    )
    os.close(theirs)
    try:
        async with asyncio.timeout(WITHIN_S):
            await is_shown.wait()
            os.write(ours, b"q")
            assert await process.wait() == 0
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()
        loop.remove_reader(ours)
        os.close(ours)


def has_shown(mission: RunningMission) -> None:
    """Return when the watcher's turn has come: it shows its views from then on."""
    words = ("scout-console", "look", "watch-scout1", "--mission", mission.name)
    for _ in range(60):
        done = mission.command(*words)
        if "difference" in done.stdout:
            return
    raise AssertionError(done.stdout + done.stderr + mission.story())
