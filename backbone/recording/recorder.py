"""Recorder: a component that writes everything it overhears into a recording.

It claims nothing and is asked by nobody, so it delays nobody: its subscriptions drop what it has no time for, and count
that. It ends in good order when its file can grow no more.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path
from typing import IO, Annotated

import msgspec

from backbone.bus.interface import Bus, Clock, Overhearing
from backbone.component.component import Component
from backbone.component.launch import Launch
from backbone.component.messages import LogLevel
from backbone.keys import Conversation
from backbone.ranges import FEW
from backbone.recording.reader import is_meant
from backbone.recording.writer import RecordingWriter
from backbone.spoken import counted
from backbone.wire import Message

FLUSH_EACH_S = 0.4  # chosen: below the half second that a killed recorder may lose; seconds of the machine
LEAST_FREE_BYTES = 100 * 1000 * 1000  # B-Human's logger: it stops below 100 MB
MOST_WAITING_BYTES = 64 * 1024 * 1024  # chosen: a second of four cameras in color


class RecorderParameters(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Parameters of ``Recorder``.

    Attributes:
        keys: Patterns of the keys to record, without ``scout/<mission>/``; empty: all.
    """

    keys: Annotated[list[str], FEW] = []


class Recorder(Component[RecorderParameters]):
    """Writes a recording until it ends.

    Args:
        file: Written from its beginning; not closed.
        path: Of the file.
        classes: Known message classes, by schema.
        about: Facts about the mission.
        mission_xml: Its file; empty: not known.
    """

    parameters_type = RecorderParameters

    def __init__(
        self,
        launch: Launch,
        bus: Bus,
        clock: Clock,
        *,
        file: IO[bytes],
        path: Path,
        classes: Mapping[str, type[Message]],
        about: Mapping[str, str],
        mission_xml: str = "",
    ) -> None:
        super().__init__(launch, bus, clock)
        self._file, self._path = file, path
        self._writer = RecordingWriter(file, classes, about, mission_xml)
        self._subscribed: list[Overhearing] = []
        self._is_full = False

    @property
    def written(self) -> int:
        """Messages so far."""
        return self._writer.written

    @property
    def dropped(self) -> int:
        """Messages that it had no time for."""
        return sum(each.dropped for each in self._subscribed)

    @property
    def is_full(self) -> bool:
        """True if it ended because the disc was full."""
        return self._is_full

    async def connect(self) -> None:
        """Subscribe to all conversations of which a key is meant."""
        for conversation in _conversations(self.parameters.keys):
            self._subscribed.append(self.bus.overhear(conversation, self._heard, MOST_WAITING_BYTES))

    async def serve(self) -> None:
        """Flush twice a second; end below ``LEAST_FREE_BYTES``."""
        dropped = 0
        while True:
            await self.clock.sleep_s(FLUSH_EACH_S * self.clock.rate)
            if not self._flushed():
                return
            if self.dropped > dropped:
                self.publish_event(self.name, f"dropped {counted(self.dropped - dropped, 'message')}", LogLevel.WARNING)
                dropped = self.dropped
            self.report(f"{counted(self.written, 'message')} in {self._path.name}")

    async def drain(self) -> None:
        """Finish the file."""
        for subscribed in self._subscribed:
            subscribed.close()
        try:
            self._writer.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            self._fill(str(error))

    def statistics(self) -> dict[str, float]:
        """Return its counts."""
        return {"messages_written": self.written, "messages_dropped": self.dropped, "file_bytes": self._file.tell()}

    def _heard(self, key: str, raw: bytes) -> None:
        if self._is_full or (self.parameters.keys and not is_meant(key, tuple(self.parameters.keys))):
            return
        try:
            self._writer.write(key, raw, self.clock.now_s())
        except OSError as error:
            self._fill(str(error))

    def _flushed(self) -> bool:
        try:
            self._writer.flush()
            free = shutil.disk_usage(self._path.parent).free
        except OSError as error:
            return self._fill(str(error))
        return free >= LEAST_FREE_BYTES or self._fill(f"less than {LEAST_FREE_BYTES // 1_000_000} MB are free")

    def _fill(self, why: str) -> bool:
        if not self._is_full:
            self._is_full = True
            self.publish_event(self.name, f"stops to record: {why}", LogLevel.WARNING)
            self.end(why)
        return False


def _conversations(patterns: list[str]) -> list[Conversation]:
    """Return the conversations of which a key could match a pattern.

    Example:
        >>> [one.value for one in _conversations(["resource_pool/*/readings"])]
        ['readings']
    """
    published: list[Conversation] = [one for one in Conversation if one not in (Conversation.ASK, Conversation.ALIVE)]
    ends = {pattern.rpartition("/")[2] for pattern in patterns}
    if not ends or not ends <= {one.value for one in published}:
        return published
    return [one for one in published if one.value in ends]
