"""A terminal that is made very small ends no console, whatever is on its screen."""

from __future__ import annotations

import pytest
from console_scenes import held_model
from written_session import WrittenSession, settle

from ui_console.terminal.app import ConsoleApp


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
