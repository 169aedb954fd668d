"""The folder of a mission's files is missed when it is no longer at its path."""

from __future__ import annotations

import asyncio
from pathlib import Path

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.launcher.folder_watch import LOOK_EVERY_S, wait_removed


@pytest.mark.parametrize("by_another", [False, True], ids=["removed", "replaced"])
def test_a_folder_is_missed_soon_after_its_removal(tmp_path: Path, *, by_another: bool) -> None:
    folder = tmp_path / "one"
    folder.mkdir()

    async def scene() -> None:
        clock = VirtualClock()
        missed = asyncio.create_task(wait_removed(folder, clock), name="missed")
        await clock.sleep_s(60.0)
        assert not missed.done()
        folder.rename(folder.with_name("away"))
        if by_another:
            folder.mkdir()
        await missed
        assert clock.now_s() <= 60.0 + 2 * LOOK_EVERY_S

    run_virtual(scene())
