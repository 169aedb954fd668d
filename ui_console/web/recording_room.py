"""The web console of a recording: the same page as for a running mission, with a time that people can change.

A hub receives the messages that ``RecordedPlay`` plays. A jump replaces the hub; the pages stay.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from functools import partial
from typing import IO

import msgspec

from backbone.bus.interface import Bus, Clock
from backbone.bus.local_bus import LocalNetwork
from backbone.component.launch import Launch
from backbone.keys import COPIED
from backbone.recording.playback import Playback
from backbone.recording.reader import Recording
from backbone.waiting import first_to_end
from ui_console.session.recorded_play import NOT_NOW, RecordedPlay
from ui_console.web.hub import WebHub
from ui_console.web.key_ears import RecordingEar
from ui_console.web.key_watch import KeyWatch
from ui_console.web.login import ProtocolViolation, Welcome
from ui_console.web.operator import Operator
from ui_console.web.page_client import PageClient
from ui_console.web.playing import Looking, PlaybackView, Playing, PlayOn, ShowTime, StandStill, StepOn
from ui_console.web.protocol import Intent, ParametersRequest, SearchLog, WhyRequest

TOLD_EVERY_S = 0.1  # chosen: the slider moves smoothly; machine seconds


class RecordedHub(WebHub):
    """A hub that receives a recording from one time on.

    Args:
        launch: See ``WebHub``.
        network: Network on which the recording is played.
        playback: Its time.
        reopened: Opens the recording once more.
    """

    def __init__(
        self, launch: Launch, network: LocalNetwork, playback: Playback, reopened: Callable[[], Recording]
    ) -> None:
        async def join(launch: Launch) -> Bus:
            return network.join(launch.address, playback)

        super().__init__(launch, network.join(launch.address, playback), playback, join)
        ear = RecordingEar(reopened, playback, self.observer.start_task)
        self.keys = KeyWatch(ear, playback, lambda: self.clients, self.observer.start_task)
        self.hidden = COPIED

    async def run(self) -> None:
        """Receive the recording, and refresh the pages; until cancelled.

        Raises:
            BaseException: The bug that ended the hub's component.
        """
        await first_to_end(self.observer.run(), self.refresh_all())


class Viewer(PageClient):
    """A person at a page that shows a recording.

    Args:
        operator: The operator at the present hub, with the same messages for the page at any time of the recording.
    """

    def __init__(self, operator: Operator) -> None:
        super().__init__(operator.welcome, operator)
        self.operator = operator


class RecordingRoom:
    """Shows a recording to any number of pages, all at the same recorded time.

    Args:
        opened: Opens the recording's file once more.
        machine: Clock of machine seconds.

    Raises:
        NoRecording: The file is not a recording, or its recorder was killed.
        OtherForm: The recording was made by another release.
    """

    def __init__(self, opened: Callable[[], IO[bytes]], machine: Clock) -> None:
        self._machine = machine
        new_hub = partial(RecordedHub, reopened=lambda: Recording(opened()))
        self.play: RecordedPlay[RecordedHub] = RecordedPlay(opened, machine, f"web-{os.getpid()}", new_hub)
        self.play.moved = self._take_along
        self._hub = self.play.console
        self._markers: bytes | None = None
        self.clients: dict[Viewer, None] = {}

    def enter(self, welcome: Welcome) -> Viewer:
        """Return a new viewer, whose page gets the whole view."""
        viewer = Viewer(self._hub.enter(welcome))
        self.clients[viewer] = None
        self._tell([viewer])
        return viewer

    async def leave(self, viewer: Viewer, reason: str) -> None:
        """Remove a viewer."""
        self.clients.pop(viewer, None)
        await self._hub.leave(viewer.operator, reason)

    def refused(self, viewer: Viewer) -> None:
        """Do nothing, because no wheels turn."""

    def report_violation(self, who: str, violation: ProtocolViolation) -> None:
        """Show the viewers a client's violation."""
        self._hub.report_violation(who, violation)

    async def obey(self, viewer: Viewer, intent: Intent | Playing) -> None:
        """Carry out playback and viewing; refuse commands to the mission."""
        match intent:
            case PlayOn(speed):
                self.play.play(speed)
            case StandStill():
                self.play.playback.pause()
            case StepOn():
                self.play.step()
            case ShowTime(at_s):
                self.play.go_to(at_s)
            case WhyRequest() | ParametersRequest() | SearchLog():
                await self.play.wait_arrived()  # the answer is of the requested time
                await self._hub.obey(viewer.operator, intent)
            case _ if isinstance(intent, Looking):
                await self._hub.obey(viewer.operator, intent)
            case _:
                viewer.refuse(NOT_NOW)
        self._tell(self.clients)

    def end(self, reason: str) -> None:
        """Make ``run`` return."""
        self.play.end(reason)

    async def run(self) -> None:
        """Show the recording until ``end``.

        Raises:
            NoRecording: The recording is damaged.
            BaseException: A bug.
        """
        await first_to_end(self.play.run(), self._keep_telling())

    async def _take_along(self, hub: RecordedHub) -> None:
        """Switch all pages to the time of this hub."""
        former, self._hub = self._hub, hub
        for viewer in list(self.clients):
            await former.leave(viewer.operator, "another time of the recording is shown")
            if viewer in self.clients:
                viewer.operator = hub.enter(viewer.welcome, viewer.operator)

    async def _keep_telling(self) -> None:
        while True:
            self._tell(self.clients)
            await self._machine.sleep_s(TOLD_EVERY_S * self._machine.rate)

    def _tell(self, viewers: Iterable[Viewer]) -> None:
        playback = self.play.playback
        body = msgspec.json.encode(
            PlaybackView(
                playback.begin_s, playback.end_s, round(playback.now_s(), 3), playback.is_playing, playback.rate
            )
        )
        if self._markers is None and self.play.has_markers:
            self._markers = msgspec.json.encode(self.play.markers)
        for viewer in viewers:
            viewer.put("playback", body)
            if self._markers is not None:
                viewer.put("markers", self._markers)
