"""``status`` where no picture can be drawn over another, and where it is longer than the terminal."""

from __future__ import annotations

import asyncio
import io
from collections.abc import AsyncIterator

import pytest
from rich.console import Console

from backbone.command_line import tables
from backbone.command_line.standard_streams import can_redraw
from backbone.command_line.tables import MissionTables
from backbone.component.messages import ComponentState, LifeState
from backbone.picture.mission import MissionPicture

LINES = 20


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


@pytest.mark.parametrize(("components", "is_terminal", "times"), [(19, True, 1), (21, True, 2), (21, False, 1)])
def test_on_a_terminal_that_is_too_short_the_health_is_printed_at_the_end_too(
    monkeypatch: pytest.MonkeyPatch, components: int, is_terminal: bool, times: int
) -> None:
    out = io.StringIO()
    console = Console(file=out, force_terminal=is_terminal, width=120, height=LINES, color_system=None)
    monkeypatch.setattr(tables, "console_of_width", lambda _width: console)
    MissionTables(None).show(picture(components))
    told = out.getvalue()
    assert told.count("health ok") == times
    assert ("health ok" in told.splitlines()[-1]) is (times == 2)
