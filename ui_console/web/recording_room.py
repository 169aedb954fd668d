"""The web console of a recording: the same page as of a mission that is up, and a time that people move.

All is in one process: a player says on a local bus what was said, and a hub shows it. To go back, or far ahead, both
begin anew at that time, and the pages stay.
"""

from __future__ import annotations

import asyncio
import math
import os
from collections.abc import Callable, Iterable
from typing import IO

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.launch import Launch
from backbone.keys import Conversation
from backbone.naming import MAX_NAME_LENGTH, Subsystem, legal
from backbone.recording.checkpoints import Checkpoints
from backbone.recording.known_messages import message_classes
from backbone.recording.markers import markers_in
from backbone.recording.playback import Playback
from backbone.recording.player import Player
from backbone.recording.reader import Recording
from backbone.waiting import end_tasks, first_to_end
from ui_console.model.playback import PlaybackView
from ui_console.web.hub import WebHub
from ui_console.web.login import ProtocolViolation, Welcome
from ui_console.web.operator import Operator
from ui_console.web.outbox import Outbox
from ui_console.web.playing import Looking, Playing, PlayOn, ShowTime, StandStill, StepOn
from ui_console.web.protocol import Intent, ParametersRequest, SearchLog, WhyRequest

CLASSES = message_classes()
NEAR_S = 2.0  # chosen: a step ahead is played, so that nothing between is left out; mission seconds
TOLD_EVERY_S = 0.1  # chosen: the slider moves smoothly; machine seconds
AGAIN_EVERY_S = 1.0  # chosen: a page that comes while time stands still has its pictures soon; machine seconds
STEPS_TO = tuple(f"*/{one}" for one in (Conversation.FRAMES, Conversation.LOG, Conversation.SCHEDULE))
NOT_NOW = "This is a recording: nothing in it can be commanded. It can be played, and asked why."


class Performance:
    """A recording that is played from one instant on, and the hub that shows it.

    Args:
        recording: Nobody else reads it.
        mission: Name under which it is shown.
        playback: Its time.
        checkpoints: Of the recording.
    """

    def __init__(self, recording: Recording, mission: str, playback: Playback, checkpoints: Checkpoints) -> None:
        network = LocalNetwork(mission)
        launch = Launch(
            mission,
            Subsystem.UI_CONSOLE,
            f"web-{os.getpid()}",
            "console",
            "ui_console.session.observer:Observer",
            "",
            "",
            0.0,
            playback.rate,
        )

        async def join(launch: Launch) -> Bus:
            return network.join(launch.address, playback)

        self._bus = network.join(f"{Subsystem.BACKBONE}/replay", playback)
        self.player = Player(self._bus, playback, recording, CLASSES, since_s=playback.now_s(), checkpoints=checkpoints)
        self.hub = WebHub(launch, network.join(launch.address, playback), playback, join, is_played=True)

    async def begin(self) -> None:
        """Take in what was said before; the page stays usable meanwhile.

        Raises:
            NoRecording: The recording is damaged.
        """
        await asyncio.to_thread(self.player.catch_up)
        self.player.begin()

    async def run(self) -> None:
        """Play, and keep the pages fresh; until cancelled.

        Raises:
            NoRecording: The recording is damaged from here on.
            BaseException: The bug that ended the hub's component.
        """
        lives = (self.player.run(), self.hub.observer.run(), self.hub.refresh_all())
        tasks = [asyncio.create_task(life) for life in lives]
        try:
            await asyncio.gather(*tasks)
        finally:
            await end_tasks(*tasks)
            await self._bus.close()


class Viewer:
    """A person at a page that shows a recording.

    Args:
        operator: At the hub of now.
    """

    def __init__(self, operator: Operator) -> None:
        self.operator = operator

    @property
    def welcome(self) -> Welcome:
        """Identity."""
        return self.operator.welcome

    @property
    def outbox(self) -> Outbox:
        """What the page is sent; the same at any time of the recording."""
        return self.operator.outbox

    @property
    def news(self) -> asyncio.Event:
        """Set when there is something to send."""
        return self.operator.news

    def refuse(self, why: str) -> None:
        """Tell the page what is not done."""
        self.outbox.put_answer(msgspec.json.encode({"answer": {"refused": why}}))
        self.news.set()


class RecordingRoom:
    """Shows a recording to any number of pages, all at the same time of it.

    Args:
        opened: Opens the recording's file once more.
        machine: Its seconds are those of the machine.

    Raises:
        NoRecording: The file is none, or its recorder was killed.
        OtherForm: It is of another release.
    """

    def __init__(self, opened: Callable[[], IO[bytes]], machine: Clock) -> None:
        self._opened, self._machine = opened, machine
        self._recording = Recording(opened())
        found = self._recording.contents()
        self.mission = legal((found.about.get("mission") or "recording")[:MAX_NAME_LENGTH])
        self.playback = Playback(machine, found.begin_s, found.end_s)
        self._markers = msgspec.json.encode(markers_in(self._recording))
        self._checkpoints = Checkpoints(CLASSES)
        self.clients: dict[Viewer, None] = {}
        self._performance = self._new_performance()
        self._is_elsewhere, self._arrived, self._ended = asyncio.Event(), asyncio.Event(), asyncio.Event()

    # ------------------------------------------------------------------ the pages come and go
    def enter(self, welcome: Welcome) -> Viewer:
        """Return a new viewer, whose page gets the whole view."""
        viewer = Viewer(self._performance.hub.enter(welcome))
        self.clients[viewer] = None
        viewer.outbox.put_section("markers", self._markers)
        self._tell([viewer])
        return viewer

    async def leave(self, viewer: Viewer, reason: str) -> None:
        """Remove a viewer."""
        self.clients.pop(viewer, None)
        await self._hub.leave(viewer.operator, reason)

    def refused(self, viewer: Viewer) -> None:
        """Do nothing: no wheels turn."""

    def report_violation(self, who: str, violation: ProtocolViolation) -> None:
        """Show the viewers a client's violation."""
        self._hub.report_violation(who, violation)

    async def obey(self, viewer: Viewer, intent: Intent | Playing) -> None:
        """Play, or look; whatever would command is refused."""
        match intent:
            case PlayOn(speed):
                if self.playback.now_s() >= self.playback.end_s:
                    self._go_to(self.playback.begin_s)
                self.playback.play(speed)
            case StandStill():
                self.playback.pause()
            case StepOn():
                self._step()
            case ShowTime(at_s):
                self._go_to(at_s)
            case WhyRequest() | ParametersRequest() | SearchLog():
                await self._arrived.wait()  # the answer is of the time that is asked about
                await self._hub.obey(viewer.operator, intent)
            case _ if isinstance(intent, Looking):
                await self._hub.obey(viewer.operator, intent)
            case _:
                viewer.refuse(NOT_NOW)
        self._tell(self.clients)

    # ------------------------------------------------------------------ its life
    def end(self, _reason: str) -> None:
        """Make ``run`` return."""
        self._ended.set()

    async def run(self) -> None:
        """Show the recording until ``end``.

        Raises:
            NoRecording: The recording is damaged.
            BaseException: A bug.
        """
        await first_to_end(self._ended.wait(), self._perform_for_ever(), self._keep_telling(), self._keep_saying())

    async def _perform_for_ever(self) -> None:
        await self._performance.begin()
        while True:
            if not self._is_elsewhere.is_set():
                self._arrived.set()
            await first_to_end(self._performance.run(), self._is_elsewhere.wait())
            await self._begin_elsewhere()

    async def _begin_elsewhere(self) -> None:
        """Begin anew at the time of now, and take all pages along."""
        while self._is_elsewhere.is_set():
            self._is_elsewhere.clear()
            performance = self._new_performance()
            await performance.begin()
            if self._is_elsewhere.is_set():
                continue
            former, self._performance = self._performance.hub, performance
            for viewer in self.clients:
                await former.leave(viewer.operator, "another time of the recording is shown")
                viewer.operator = performance.hub.enter(viewer.operator.welcome, viewer.operator)

    def _new_performance(self) -> Performance:
        return Performance(Recording(self._opened()), self.mission, self.playback, self._checkpoints)

    # ------------------------------------------------------------------ within
    @property
    def _hub(self) -> WebHub:
        return self._performance.hub

    def _go_to(self, at_s: float) -> None:
        before_s = self.playback.now_s()
        self.playback.go_to(at_s)
        if not 0.0 <= self.playback.now_s() - before_s <= NEAR_S:
            self._arrived.clear()
            self._is_elsewhere.set()

    def _step(self) -> None:
        since_s = math.nextafter(self.playback.now_s(), math.inf)
        following = next(self._recording.messages(STEPS_TO, since_s), None)
        self.playback.pause()
        self._go_to(self.playback.end_s if following is None else following.at_s)

    async def _keep_telling(self) -> None:
        while True:
            if self.playback.now_s() >= self.playback.end_s:
                self.playback.pause()
            self._tell(self.clients)
            await self._machine.sleep_s(TOLD_EVERY_S * self._machine.rate)

    async def _keep_saying(self) -> None:
        while True:
            await self._machine.sleep_s(AGAIN_EVERY_S * self._machine.rate)
            if not self.playback.is_playing and not self._is_elsewhere.is_set():
                self._performance.player.say_again()

    def _tell(self, viewers: Iterable[Viewer]) -> None:
        playback = self.playback
        body = msgspec.json.encode(
            PlaybackView(
                playback.begin_s, playback.end_s, round(playback.now_s(), 3), playback.is_playing, playback.rate
            )
        )
        for viewer in viewers:
            viewer.outbox.put_section("playback", body)
            viewer.news.set()
