"""A terminal that goes away is noticed."""

from __future__ import annotations

import asyncio
import os
import pty
import tty
from pathlib import Path

from ui_console.terminal.hangup import HangupWatch


async def test_a_closed_terminal_is_told_once() -> None:
    ours, theirs = pty.openpty()
    told: list[int] = []
    gone = asyncio.Event()
    watch = HangupWatch(theirs, lambda: (told.append(1), gone.set()))
    os.close(ours)
    async with asyncio.timeout(5):
        await gone.wait()
    watch.close()
    os.close(theirs)
    assert told == [1]


async def test_keys_are_no_hangup_and_stay_for_their_reader() -> None:
    ours, theirs = pty.openpty()
    tty.setraw(theirs)
    told: list[int] = []
    watch = HangupWatch(theirs, lambda: told.append(1))
    os.write(ours, b"w")
    read: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()
    asyncio.get_running_loop().add_reader(theirs, lambda: read.done() or read.set_result(os.read(theirs, 10)))
    async with asyncio.timeout(5):
        assert await read == b"w"
    asyncio.get_running_loop().remove_reader(theirs)
    watch.close()
    os.close(ours)
    os.close(theirs)
    assert not told


async def test_a_file_never_hangs_up(tmp_path: Path) -> None:
    with (tmp_path / "script").open("wb") as file:
        HangupWatch(file.fileno(), lambda: None).close()
