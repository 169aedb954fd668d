"""``scout-console look --save`` writes one picture, or refuses a file that it cannot write."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest

from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.command_line.unusable_file import FileUnusable
from backbone.command_line.where import Where
from backbone.debug_views import LookAt, LookedAt, ViewEntry, ViewKind, ViewPicture, Views, view_address
from backbone.keys import Conversation
from backbone.launcher.endings import ExitCode
from ui_console.terminal import look

BEHAVIOR, VIEW = "mission_control/watch", "difference"
WITHIN_S = 100.0


@pytest.fixture
def behavior(monkeypatch: pytest.MonkeyPatch) -> None:
    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        network = LocalNetwork("night")
        shown_by = LocalBus(network, BEHAVIOR, VirtualClock())

        async def answer(_asked: object) -> LookedAt:
            picture = ViewPicture(VIEW, 1.0, 2, 1, False, b"\x00\xff")
            asyncio.get_running_loop().call_later(
                1.0, shown_by.publish, view_address(BEHAVIOR, VIEW), Conversation.VIEWS, picture
            )
            return LookedAt(VIEW, ViewKind.PICTURE, WITHIN_S)

        shown_by.serve(BEHAVIOR, LookAt, answer)
        yield LocalBus(network, "ui_console/cli-1", VirtualClock()), VirtualClock()

    async def found(_bus: object, _name: str) -> str:
        return BEHAVIOR

    async def views(_bus: object, _behavior: str) -> Views:
        return Views([ViewEntry(VIEW, ViewKind.PICTURE)])

    monkeypatch.setattr(look, "connected", connected)
    monkeypatch.setattr(look, "find_behavior", found)
    monkeypatch.setattr(look, "views_of", views)


async def save(file: Path) -> int:
    async with asyncio.timeout(WITHIN_S):
        return await look.look_into(Where(None, None, None), "watch", VIEW, look.LookOptions(save=file))


@pytest.mark.usefixtures("behavior")
def test_a_picture_is_saved(tmp_path: Path) -> None:
    file = tmp_path / "seen.png"
    assert run_virtual(save(file)) is ExitCode.DONE
    assert file.read_bytes().startswith(b"\x89PNG")


@pytest.mark.usefixtures("behavior")
def test_a_file_in_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(FileUnusable, match=r"seen\.png cannot be written: No such file or directory"):
        run_virtual(save(tmp_path / "no" / "seen.png"))
