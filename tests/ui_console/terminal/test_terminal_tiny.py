"""A console goes on in a very small terminal, and answers keys at once in a very large one."""

from __future__ import annotations

import numpy as np
import pytest
from console_scenes import held_model
from screen_text import screen_text
from written_session import WrittenSession, settle

from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.video import UPPER_HALF
from ui_console.terminal.widgets import MOST_DRAWN


@pytest.mark.parametrize("key", ["", "p", "O", "M", "slash", "question_mark", "c"])
async def test_a_terminal_of_one_character_and_back_ends_no_console(key: str) -> None:
    session = WrittenSession(shown=held_model())
    async with ConsoleApp(session).run_test(size=(80, 24)) as pilot:
        if key:
            await pilot.press(key)
        for size in ((1, 1), (2, 40), (7, 5), (200, 1), (80, 24)):
            await pilot.resize_terminal(*size)
            await settle(pilot)
        session.wanted.clear()
        await pilot.press("X")
        await settle(pilot)
        assert "stop all" in session.wanted


async def test_a_picture_takes_no_more_cells_on_a_wall_of_screens_than_a_key_may_wait_for() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.tile(np.arange(240, dtype=np.uint8)[:, np.newaxis], (1, 320))
    async with ConsoleApp(session).run_test(size=(500, 200)) as pilot:
        await settle(pilot)
        drawn = [line.count(UPPER_HALF) for line in screen_text(pilot.app).splitlines()]
    assert max(drawn) == MOST_DRAWN[0]
    assert sum(count > 0 for count in drawn) == MOST_DRAWN[1]
