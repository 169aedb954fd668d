"""The picture and the notices across it, and every screen as it was when somebody looked."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest
from console_scenes import STOP, held_model
from pressed_keys import SIZE
from screen_text import same_as_before, screen_text
from written_session import WrittenSession, settle

from resource_pool.arc_client import Suspended
from ui_console.model.events import (
    Attention,
    ConsoleEvent,
    GivenBack,
    Heard,
    LinkHeard,
    LinkTrouble,
)
from ui_console.model.profile import Profile
from ui_console.terminal.app import ConsoleApp
from ui_console.terminal.tables import PanelName
from ui_console.terminal.widgets import Video


@pytest.mark.parametrize("profile", list(Profile))
async def test_a_console_without_a_link_says_across_the_screen_that_it_stops_nothing(profile: Profile) -> None:
    session = WrittenSession(shown=held_model())
    app = ConsoleApp(session, profile=profile)
    async with app.run_test(size=(80, 24)) as pilot:
        session.model.apply(LinkHeard(11.0, False))
        await pilot.pause(0.5)  # no key is pressed: it is the console that has to look
        shown = " ".join(screen_text(app).split())
        assert "NO LINK to the mission" in shown
        assert "x and X reach no robot now: stop at another console, or at the robot itself" in shown
        assert "you hold" not in shown
        assert app.screen.has_class("-unlinked")
        session.model.apply(LinkHeard(11.5, True, 0.001))
        await pilot.pause(0.5)
        assert "NO LINK" not in screen_text(app)
        assert not app.screen.has_class("-unlinked")


async def test_a_robot_that_was_lost_is_taken_again_by_one_key_or_known_to_be_lost_by_another() -> None:
    shown = held_model()
    shown.apply(GivenBack(11.0, "anna is away", True, wanted=False))
    session = WrittenSession(shown=shown)
    app = ConsoleApp(session)
    async with app.run_test(size=(80, 24)) as pilot:
        await settle(pilot)
        told = "you lost scout1 1 s ago: anna is away [t: take it again, k: seen]"
        assert told in " ".join(screen_text(app).split())
        await pilot.press("t", "k")
        await settle(pilot)
        assert session.wanted == ["take", "dismiss lost"]
        assert "you lost" not in screen_text(app)


async def test_the_screen_shows_picture_holder_and_status() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.tile(np.arange(0, 240, 6, dtype=np.uint8), (30, 1))
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        first = screen_text(screen).splitlines()[0]
        assert "you hold scout1" in first
        assert "picture 0.2 s old" in first
        line = screen.query_one(Video).render_line(2)
        assert "▀" in line.text
        assert line.cell_length == screen.query_one(Video).size.width


async def test_a_terminal_with_real_pixels_is_sent_the_picture_once_and_cells_that_name_it() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.full((30, 40), 200, np.uint8)
    screen = ConsoleApp(session, has_pixels=True)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        video = screen.query_one(Video)
        first, second = video.render_line(0), video.render_line(1)
        assert (first.cell_length, second.cell_length) == (video.size.width, video.size.width)
        assert "\x1b_Ga=T" in first.text
        assert "\x1b" not in second.text
        session.now_s = lambda: 20.0  # type: ignore[method-assign]
        screen.redraw()
        assert "\x1b_G" not in video.render_line(0).text, "an old picture is drawn dark, in half blocks"


async def test_an_old_picture_says_so_across_the_picture() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.full((30, 40), 200, np.uint8)
    session.now_s = lambda: 20.0  # type: ignore[method-assign]
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        video = screen.query_one(Video)
        assert "picture is 8 s old" in video.render_line(video.size.height // 2).text


async def test_a_robot_that_was_taken_away_says_by_whom_across_the_picture() -> None:
    session = WrittenSession(shown=held_model())
    session.shown = np.full((30, 40), 200, np.uint8)
    session.model.apply(Heard(11.9, Suspended("arc", "higher", "console-2", -1.0)))
    screen = ConsoleApp(session)
    async with screen.run_test(size=SIZE) as pilot:
        screen.redraw()
        await pilot.pause()
        video = screen.query_one(Video)
        assert "console-2 has the higher priority" in video.render_line(video.size.height // 2).text


ALARMING: list[ConsoleEvent] = [
    Attention(8.0, False),
    LinkTrouble(9.0, "nobody answers at resource_pool/scout2"),
    Attention(9.5, True),
    Heard(11.0, STOP),
]


async def test_every_table_looks_as_it_did() -> None:
    shown = held_model()
    for event in ALARMING:
        shown.apply(event)
    screen = ConsoleApp(WrittenSession(shown=shown))
    async with screen.run_test(size=SIZE) as pilot:
        for panel in PanelName:
            assert screen.chosen is panel
            await pilot.pause()
            same_as_before(screen, f"table-{panel}")
            await pilot.press("tab")


@pytest.mark.parametrize(
    ("name", "profile", "size", "keys"),
    [
        ("attach-narrow", Profile.TERMINAL, (60, 40), []),
        ("attach-80x24", Profile.TERMINAL, (80, 24), []),
        ("dialog-lift", Profile.TERMINAL, (80, 24), ["c"]),
        ("attach-video-only", Profile.TERMINAL, (80, 24), ["v"]),
        ("pendant", Profile.PENDANT, (50, 20), []),
        ("monitor", Profile.MONITOR, SIZE, []),
        ("dialog-picker", Profile.TERMINAL, SIZE, ["p"]),
        ("dialog-why", Profile.TERMINAL, SIZE, ["y"]),
        ("dialog-keys", Profile.TERMINAL, (120, 50), ["question_mark"]),
        ("dialog-parameter", Profile.TERMINAL, SIZE, [*["tab"] * 6, "e"]),
    ],
)
async def test_every_screen_looks_as_it_did(
    name: str, profile: Profile, size: tuple[int, int], keys: list[str]
) -> None:
    session = WrittenSession(shown=held_model())
    if name == "dialog-lift":
        session.model.apply(Heard(11.0, msgspec.structs.replace(STOP, by="ben")))
    session.shown = np.tile(np.arange(0, 240, 6, dtype=np.uint8), (30, 1))
    screen = ConsoleApp(session, profile=profile)
    async with screen.run_test(size=size) as pilot:
        await pilot.pause()
        screen.redraw()
        await pilot.pause()
        for key in keys:
            await pilot.press(key)
        await settle(pilot)
        screen.redraw()
        await pilot.pause()
        same_as_before(screen, name)
