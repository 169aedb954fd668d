"""Beside a screen, tasks begin as in every other process: in the loop's next round."""

from __future__ import annotations

import asyncio
from typing import Any

import pytest
from textual.pilot import Pilot

from ui_console.terminal.ending import EndingApp


def begins_at_once(loop: asyncio.AbstractEventLoop, work: Any, **options: Any) -> asyncio.Task[Any]:
    """Stand for the factory that Python 3.11 does not have, as far as this test sees it."""
    return asyncio.Task(work, loop=loop, **options)


def test_tasks_beside_a_screen_begin_in_the_next_round(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(asyncio, "eager_task_factory", begins_at_once, raising=False)
    factories: list[object] = []

    async def look(pilot: Pilot[object]) -> None:
        factories.append(asyncio.get_running_loop().get_task_factory())
        pilot.app.exit()

    async def main() -> None:
        await EndingApp().run_async(headless=True, auto_pilot=look)

    asyncio.run(main())
    assert factories == [None]
