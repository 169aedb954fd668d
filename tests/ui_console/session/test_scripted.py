"""What a script hears: one line for one cause, and that its robot was lost in words."""

from __future__ import annotations

import asyncio
import json
import os
from typing import Any

import pytest

from resource_pool.arc_client import Suspended
from ui_console.model.events import CommandApplied, ConsoleEvent, Granted, Heard, LinkTrouble
from ui_console.model.script import read_script
from ui_console.session.scripted import ScriptDriver, feed_from

DRIVE = '{"at_s": 0, "left_rad_s": 4, "right_rad_s": 4}\n{"at_s": 2, "left_rad_s": 2, "right_rad_s": 2}'
UNANSWERED = LinkTrouble(2.0, "nobody answered Drive at resource_pool/console-1-drive", "drive")
LATE = LinkTrouble(2.1, "resource_pool/console-1-drive did not answer Halt within 0.5 s", "halt")
APPLIED = CommandApplied(3.0, "scout1", 7, "drive", {"left_rad_s": 4.0}, 0.01)
GRANTED = Granted(4.0, "scout1", {"scout": "scout1"}, {"scout1": 8}, 9.0, 1.0, True)


def heard(*events: ConsoleEvent) -> list[dict[str, Any]]:
    lines: list[bytes] = []
    driver = ScriptDriver(lines.append, read_script(DRIVE))
    for event in events:
        driver.show(event)
    return [json.loads(line) for line in lines]


def test_a_silence_is_one_line_until_there_is_an_answer() -> None:
    assert [line["event"] for line in heard(*[UNANSWERED] * 9)] == ["no_answer"]
    told = heard(UNANSWERED, LATE, UNANSWERED, APPLIED, LATE, UNANSWERED)
    assert [line["event"] for line in told] == ["no_answer", "applied", "no_answer"]
    other = LinkTrouble(2.5, "scout1 did not confirm the stop: nobody answered")
    assert [line["detail"] for line in heard(UNANSWERED, other, UNANSWERED)] == [UNANSWERED.detail, other.detail]


def test_a_robot_that_was_lost_is_told_in_a_sentence() -> None:
    [line] = heard(Heard(3.0, Suspended("arc", "lost", "console-1-drive", -1.0)))
    assert line["event"] == "suspended"
    assert line["why"] == "the ARC that held it for this console has ended"
    [line] = heard(Heard(3.0, Suspended("arc", "higher", "console-9", -1.0)))
    assert line["why"] == "console-9 has the higher priority"


def test_after_a_loss_that_nobody_decided_a_script_moves_nothing_before_a_halt() -> None:
    for reason, is_held_back in (
        ("lost", True),
        ("lease", True),
        ("silent", True),
        ("rc", True),
        ("slice", False),
        ("higher", False),
    ):
        driver = ScriptDriver(lambda _line: None, read_script(DRIVE))
        driver.show(Heard(3.0, Suspended("arc", reason, "console-9", -1.0)))
        driver.show(GRANTED)
        assert driver.must_halt is is_held_back, reason


@pytest.mark.asyncio
async def test_a_pipe_that_does_not_block_is_read_to_its_end() -> None:
    """As ``scout-console attach --json`` gets one from a program that made its side of a terminal non-blocking."""
    reading, writing = os.pipe()
    os.set_blocking(reading, False)
    lines: asyncio.Queue[str | None] = asyncio.Queue()
    cuts: list[OSError] = []
    async with asyncio.timeout(5.0):
        feed_from(reading, lines.put_nowait, cuts.append)
        for line in ("one", "two"):
            await asyncio.sleep(0.02)  # the reader has met the empty pipe
            os.write(writing, f"{line}\n".encode())
            assert await lines.get() == line
        os.close(writing)
        assert await lines.get() is None
    os.close(reading)
    assert not cuts


@pytest.mark.asyncio
async def test_a_script_that_the_system_does_not_read_is_cut() -> None:
    _, writing = pipe = os.pipe()
    cuts: asyncio.Queue[OSError] = asyncio.Queue()
    lines: list[str | None] = []
    async with asyncio.timeout(5.0):
        feed_from(writing, lines.append, cuts.put_nowait)
        assert (await cuts.get()).strerror
    for descriptor in pipe:
        os.close(descriptor)
    assert not lines
