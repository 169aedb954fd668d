"""``status`` where no picture can be drawn over another."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator

import pytest

from backbone.command_line.standard_streams import can_redraw
from backbone.command_line.tables import MissionTables
from backbone.component.messages import ComponentState, LifeState
from backbone.picture.mission import MissionPicture


def picture(components: int, at_s: float = 1.0) -> MissionPicture:
    states = [
        ComponentState(f"resource_pool/scout{number}", "scout", "base", number, LifeState.READY, 0.0)
        for number in range(1, components + 1)
    ]
    return MissionPicture("night", at_s, {state.address: state for state in states})


async def two_pictures() -> AsyncIterator[MissionPicture]:
    for at_s in (1.0, 2.0):
        yield picture(3, at_s)


@pytest.mark.parametrize("term", ["", "dumb"])
def test_watched_where_text_cannot_be_placed_each_picture_is_printed_below_the_last(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], term: str
) -> None:
    if term:
        monkeypatch.setenv("TERM", term)
        monkeypatch.setattr("sys.stdout.isatty", lambda: True)
    assert not can_redraw()
    asyncio.run(MissionTables(120).keep_showing(two_pictures()))
    told = capsys.readouterr().out
    assert [told.count(f"{at_s:.1f} s   health ok") for at_s in (1.0, 2.0)] == [1, 1]
    assert told.count("scout3") == 2
