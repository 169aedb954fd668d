"""A recording on the terminal console: its screen and its player, in one event loop."""

from __future__ import annotations

import asyncio
import os
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from backbone.bus.clock import MissionClock
from backbone.bus.interface import Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.component import NoParameters
from backbone.component.launch import Launch
from backbone.launcher.endings import ExitCode
from backbone.mission_log.log import AskLog, Log
from backbone.mission_log.question import LogQuestion
from backbone.recording.playback import Playback
from backbone.waiting import first_to_end
from ui_console.model.console import ConsoleModel
from ui_console.model.key_table import KeyRow
from ui_console.model.key_view import KeyView
from ui_console.model.message_views import installed_views
from ui_console.model.team import TeamModel
from ui_console.model.time_line import TimeLine
from ui_console.session.joining import end_server_on_signals
from ui_console.session.key_looking import ShowRows, keep_listing_recorded, keep_reading
from ui_console.session.observer import Observer
from ui_console.session.recorded_play import RecordedPlay, opener
from ui_console.session.verbs import Session
from ui_console.terminal.pixels import can_show_pixels
from ui_console.terminal.recorded_app import RecordedApp
from ui_console.terminal.session import Pilot, on_terminal


@dataclass(frozen=True)
class HearingConsole:
    """A console that receives a recording from one time on.

    Attributes:
        observer: Its component.
        model: Content of the screen.
    """

    observer: Observer[NoParameters]
    model: ConsoleModel

    async def run(self) -> None:
        """Receive the recording until cancelled."""
        await self.observer.run()


class RecordedSession(Session):
    """Shows a recording; each jump replaces its model.

    Args:
        opened: Opens the recording's file once more.
        machine: Clock of machine seconds.
        user: The person at the console.

    Raises:
        NoRecording: The file is not a recording, or its recorder was killed.
        OtherForm: The recording was made by another release.
    """

    def __init__(self, opened: Callable[[], IO[bytes]], machine: Clock, user: str) -> None:
        self._user = user
        self.play = RecordedPlay(opened, machine, f"console-{os.getpid()}", self._new_console)
        super().__init__(self.play.console.model)
        self._console = self.play.console.observer
        self.play.moved = self._moved
        playback = self.play.playback
        self.time_line = TimeLine(playback.begin_s, playback.end_s, self.play.markers)

    async def run(self, *, pilot: Pilot | None = None, size: tuple[int, int] = (120, 40)) -> ExitCode:
        """Show the screen until a key or ``play.end`` ends it.

        Raises:
            NoRecording: The recording is damaged.
            BaseException: A bug.
        """
        screen = RecordedApp(self, self.play, self.time_line, has_pixels=pilot is None and can_show_pixels(os.environ))
        living = asyncio.create_task(self.play.run(), name="recording")
        living.add_done_callback(lambda _living: screen.exit())
        try:
            if pilot is None:
                await on_terminal(screen, self.play.end)
            else:
                await screen.run_async(headless=True, size=size, auto_pilot=pilot)
        finally:
            self.play.end("the screen was closed")
            await living
        return ExitCode(screen.return_code or ExitCode.DONE)

    # What a screen may ask, see ``Session``.
    def closed(self) -> None:
        """End the playback, because the screen has ended."""
        self.play.end("the screen was closed")

    async def why(self, name: str) -> list[str]:
        """Return the explanation of its state at the shown time."""
        await self.play.wait_arrived()
        return await super().why(name)

    async def search_log(self, question: LogQuestion) -> tuple[AskLog, Log]:
        """Return the question, and the matching events up to the shown time."""
        await self.play.wait_arrived()
        return await super().search_log(question)

    async def ask_parameters(self, name: str) -> bool:
        """Ask for a component's parameters at the shown time; return whether there is an answer."""
        await self.play.wait_arrived()
        return await super().ask_parameters(name)

    async def keep_listing(self, show: ShowRows) -> None:
        """Call ``show`` each second with the keys of the recording, until cancelled."""
        await self._at_each_time(lambda: keep_listing_recorded(self.play.reopened(), self.play.playback, show))

    async def keep_hearing(self, row: KeyRow, begin: Callable[[KeyView], None]) -> None:
        """Call ``begin`` with a view of a key, and again after each jump, until cancelled."""
        views = await asyncio.to_thread(installed_views)

        async def hear() -> None:
            view = KeyView(row.schema, views)
            begin(view)
            await keep_reading(self.play.reopened(), self.play.playback, row, view)

        await self._at_each_time(hear)

    async def _at_each_time(self, look: Callable[[], Awaitable[None]]) -> None:
        """Run until cancelled; restart at each jump."""
        while True:
            await self.play.wait_arrived()
            await first_to_end(look(), self.play.wait_elsewhere())

    def _new_console(self, launch: Launch, network: LocalNetwork, playback: Playback) -> HearingConsole:
        model = ConsoleModel(launch.name, self._user, TeamModel(launch.mission, ""), sees=False)
        bus = network.join(launch.address, playback)
        observer: Observer[NoParameters] = Observer(
            launch, bus, playback, show=model.apply, signs_in=False, user=self._user
        )
        return HearingConsole(observer, model)

    async def _moved(self, console: HearingConsole) -> None:
        self.model, self._console = console.model, console.observer


async def watch_recording(path: Path, user: str) -> int:
    """Show a recording until a key or a signal ends it; return the command's exit code.

    Args:
        path: Path of the recording; no mission needs to be up.
        user: The person at the console.

    Raises:
        Refusal: ``FileUnusable``, ``NoRecording`` or ``OtherForm``.
    """
    session = RecordedSession(opener(path), MissionClock.started_now(), user)
    interrupted = end_server_on_signals(session.play.end)
    ended = await session.run()
    return ExitCode.INTERRUPTED if interrupted() else ended
