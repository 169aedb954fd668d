"""``status --watch`` shows a mission whose hub is away, and ends when the mission has ended."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest

from backbone import run_files
from backbone.addresses import NAMESERVER
from backbone.bus.clock import VirtualClock, run_virtual
from backbone.bus.local_bus import LocalBus, LocalNetwork
from backbone.command_line import status
from backbone.command_line.where import Where
from backbone.launcher.endings import ExitCode, complaint_of
from backbone.nameserver.messages import Components, ListComponents
from backbone.picture.mission import MissionPicture
from backbone.run_files import MissionNotUp, RunFile


def begun_at(origin_s: float) -> RunFile:
    return RunFile("night", "unixsock-stream//nowhere", 1, origin_s, 1.0, "base", "night.xml")


class Shown:
    """Keeps the pictures."""

    every_s = 1.0

    def __init__(self) -> None:
        self.pictures: list[MissionPicture] = []

    def show(self, picture: MissionPicture) -> None:
        self.pictures.append(picture)

    async def keep_showing(self, pictures: AsyncIterator[MissionPicture]) -> None:
        async for picture in pictures:
            self.show(picture)


@pytest.mark.parametrize(
    ("silent_s", "later", "told"),
    [
        (0.0, [], "'night' is not up"),
        (0.5, [], "'night' is not up"),
        (0.5, [begun_at(2.0)], "night was started again"),
        (9.0, [begun_at(2.0)], "night was started again"),
    ],
    ids=["down", "down while it is watched", "again", "again, between two looks"],
)
def test_it_shows_a_mission_whose_hub_is_away_until_the_mission_has_ended(
    monkeypatch: pytest.MonkeyPatch, silent_s: float, later: list[RunFile], told: str
) -> None:
    shown, clock = Shown(), VirtualClock()

    async def answer(_asked: object) -> Components:
        return Components([], complete=True, hub_since_s=0.0)

    @asynccontextmanager
    async def connected(_where: Where) -> AsyncIterator[tuple[LocalBus, VirtualClock]]:
        bus = LocalBus(LocalNetwork("night"), "ui_console/cli-1", clock)
        if silent_s:
            serving = LocalBus(bus.network, NAMESERVER, clock).serve(NAMESERVER, ListComponents, answer)
            asyncio.get_running_loop().call_at(silent_s, serving.close)
        yield bus, clock

    monkeypatch.setattr(run_files, "find_all", lambda: [begun_at(1.0)] if clock.now_s() < 1.5 else later)
    monkeypatch.setattr(status, "connected", connected)
    with pytest.raises(MissionNotUp, match=told) as refused:
        run_virtual(show(shown))
    assert len(shown.pictures) == 2, "one a second"
    assert complaint_of(refused.value)[1] is ExitCode.NO_BACKBONE


async def show(shown: Shown) -> ExitCode:
    return await status.show_status(Where("night", None, None), shown, watch=True)
