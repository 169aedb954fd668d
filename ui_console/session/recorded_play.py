"""Playback of a recording to a console in this process: pause, play, and jump to another time.

A player publishes the recorded messages on a local bus, and a console receives them. For a jump back or far ahead,
player and console are created again at the new time; the screen stays. Commands are not possible.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import IO, Generic, Protocol, TypeVar

from backbone.bus.interface import Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.command_line.unusable_file import FileUnusable
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.naming import MAX_NAME_LENGTH, Subsystem, legal
from backbone.recording.known_messages import message_classes
from backbone.recording.markers import Marker, markers_in
from backbone.recording.playback import Playback
from backbone.recording.player import Player
from backbone.recording.reader import Recording, open_file
from backbone.recording.writer import NS
from backbone.waiting import end_tasks, first_to_end, in_thread_within

NEAR_S = 2.0  # chosen: a shorter step ahead is played, so that no message is left out; mission seconds
LOOK_EACH_S = 0.1  # chosen: detects the end soon enough for a person; machine seconds
AGAIN_EACH_S = 1.0  # chosen: a view opened during a pause gets its pictures soon; machine seconds
STEPS_TO = tuple(f"*/{one}" for one in (Conversation.FRAMES, Conversation.LOG, Conversation.SCHEDULE))
STILL_READ = "the markers are still being read"
NOT_NOW = "This is a recording: nothing in it can be commanded. It can be played, and asked why."


class Shows(Protocol):
    """A console that receives a recording from one time on."""

    async def run(self) -> None:
        """Receive the recording until cancelled."""


Console = TypeVar("Console", bound=Shows)
NewConsole = Callable[[Launch, LocalNetwork, Playback], Console]


def opener(path: Path) -> Callable[[], IO[bytes]]:
    """Return a function that opens this file, and raises ``FileUnusable`` if that fails."""

    def opened() -> IO[bytes]:
        try:
            return open_file(path)
        except OSError as error:
            raise FileUnusable(f"{path} cannot be read: {error.strerror}") from error

    return opened


class Performance(Generic[Console]):
    """A recording that is played from one time on, and the console that receives it."""

    def __init__(self, player: Player, console: Console, close: Callable[[], asyncio.Future[None]]) -> None:
        self.player, self.console, self._close = player, console, close

    async def begin(self) -> None:
        """Restore the state before this time; the screen stays usable meanwhile.

        Raises:
            NoRecording: The recording is damaged.
        """
        await asyncio.to_thread(self.player.catch_up)
        self.player.begin()

    async def run(self) -> None:
        """Play until cancelled.

        Raises:
            NoRecording: The recording is damaged from here on.
            BaseException: The bug that ended the console.
        """
        tasks = [asyncio.create_task(life) for life in (self.player.run(), self.console.run())]
        try:
            await asyncio.gather(*tasks)
        finally:
            await end_tasks(*tasks)
            await self._close()


class RecordedPlay(Generic[Console]):
    """Plays a recording.

    Args:
        opened: Opens the recording's file once more.
        new_console: Creates the console that receives the recording from a time on; its bus joins the given network.

    Raises:
        NoRecording: The file is not a recording, or its recorder was killed.
    """

    def __init__(
        self, opened: Callable[[], IO[bytes]], machine: Clock, name: str, new_console: NewConsole[Console]
    ) -> None:
        self._opened, self._machine, self._name, self._new_console = opened, machine, name, new_console
        self.moved: Callable[[Console], Awaitable[None]] | None = None
        """Awaited with the new console after a jump."""
        self.classes = message_classes()
        """Known message classes by schema."""
        self._recording = Recording(opened())
        found = self._recording.contents()
        self.mission = legal((found.about.get("mission") or "recording")[:MAX_NAME_LENGTH])
        self.playback = Playback(machine, found.begin_s, found.end_s)
        self.markers = list[Marker]()
        """The markers in the order of time, once they are read."""
        self.has_markers = False
        """Whether they are read; that takes seconds, so a large recording is shown before."""
        self._is_elsewhere, self._arrived, self._ended = asyncio.Event(), asyncio.Event(), asyncio.Event()
        self._performance = self._new_performance()

    @property
    def console(self) -> Console:
        """The console at the present time; replaced after a jump."""
        return self._performance.console

    def reopened(self) -> Recording:
        """Open the recording again for another reader."""
        return Recording(self._opened())

    async def wait_arrived(self) -> None:
        """Wait until the requested time is shown, so that answers are of that time."""
        await self._arrived.wait()

    async def wait_elsewhere(self) -> None:
        """Wait until a person has jumped to another time."""
        await self._is_elsewhere.wait()

    def play(self, speed: float) -> None:
        """Play; at the end, begin again."""
        if self.playback.now_s() >= self.playback.end_s:
            self.go_to(self.playback.begin_s)
        self.playback.play(speed)

    def go_to(self, at_s: float) -> None:
        """Show another time."""
        before_s = self.playback.now_s()
        self.playback.go_to(at_s)
        if not 0.0 <= self.playback.now_s() - before_s <= NEAR_S:
            self._arrived.clear()
            self._is_elsewhere.set()

    def step(self) -> None:
        """Go to the next picture, decision or event, and pause there."""
        since_s = (round(self.playback.now_s() * NS) + 1) / NS  # a recording counts whole nanoseconds
        following = next(self._recording.messages(STEPS_TO, since_s), None)
        self.playback.pause()
        self.go_to(self.playback.end_s if following is None else following.at_s)

    def end(self, _reason: str) -> None:
        """Make ``run`` return."""
        self._ended.set()

    async def run(self) -> None:
        """Play to the console until ``end``.

        Raises:
            NoRecording: The recording is damaged.
            BaseException: A bug.
        """
        await first_to_end(
            self._ended.wait(),
            self._perform_for_ever(),
            self._keep_to_the_end(),
            self._keep_saying(),
            self._read_markers(),
        )

    async def _perform_for_ever(self) -> None:
        await self._performance.begin()
        while True:
            if not self._is_elsewhere.is_set():
                self._arrived.set()
            await first_to_end(self._performance.run(), self._is_elsewhere.wait())
            while self._is_elsewhere.is_set():
                self._is_elsewhere.clear()
                performance = self._new_performance()
                await performance.begin()
                if not self._is_elsewhere.is_set():
                    self._performance = performance
                    if self.moved is not None:
                        await self.moved(performance.console)

    def _new_performance(self) -> Performance[Console]:
        playback, kind = self.playback, "ui_console.session.observer:Observer"
        launch = Launch(self.mission, Subsystem.UI_CONSOLE, self._name, "console", kind, "", "", 0.0, playback.rate)
        network = LocalNetwork(self.mission)
        bus = network.join(f"{Subsystem.BACKBONE}/replay", playback)
        recording, since_s = self.reopened(), playback.now_s()
        player = Player(bus, playback, recording, self.classes, since_s=since_s)
        console = self._new_console(launch, network, playback)
        return Performance(player, console, lambda: asyncio.ensure_future(bus.close()))

    async def _read_markers(self) -> None:
        self.markers += await in_thread_within(lambda: markers_in(self.reopened()), None)
        self.has_markers = True
        await asyncio.Event().wait()

    async def _keep_to_the_end(self) -> None:
        while True:
            if self.playback.now_s() >= self.playback.end_s:
                self.playback.pause()
            await self._machine.sleep_s(LOOK_EACH_S * self._machine.rate)

    async def _keep_saying(self) -> None:
        while True:
            await self._machine.sleep_s(AGAIN_EACH_S * self._machine.rate)
            if not self.playback.is_playing and not self._is_elsewhere.is_set():
                self._performance.player.say_again()
