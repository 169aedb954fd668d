"""Beats that a recorder sends to the launcher of the mission, if a person started the recorder.

No process watches such a recorder, unlike one of ``up --record`` (``recorder_signs``). Therefore it raises a claim to
its address. It publishes a beat at its begin and after each flush (once a second), and a last one when its file is
complete.
"""

from __future__ import annotations

import os
import socket
import time
from pathlib import Path

import msgspec

from backbone.bus.interface import Bus
from backbone.incarnation import Incarnation, random_start
from backbone.keys import Conversation
from backbone.naming import Subsystem, address, claim_address
from backbone.ranges import Line, Mention, Pid, Start
from backbone.wire import Message

NAME_BEGIN = "recorder-"
BEAT_EACH_S = 1.0  # chosen: a hung recorder is reported within seconds, and a small message each second costs nothing


class RecorderBeat(Message, frozen=True):
    """A recorder begins, or has flushed its file; published under ``Conversation.BEAT``.

    Attributes:
        host: Host name of its machine.
        pid: Process id on that machine.
        start: Random number of this recorder, see ``incarnation``.
        file: The first file of its recording, for people.
        is_last: True if the recording is complete and the recorder ends.
    """

    host: Mention
    pid: Pid
    file: Line
    is_last: bool = False
    start: Start = 0

    @property
    def incarnation(self) -> Incarnation:
        """This run of the recorder."""
        return Incarnation(self.host, self.pid, self.start)


def address_of_recorder() -> str:
    """Return the address of a recorder in this process."""
    return address(Subsystem.BACKBONE, f"{NAME_BEGIN}{os.getpid()}")


class RecorderBeats:
    """Publishes the beats of one recorder; its claim exists from now on.

    Args:
        bus: Bus of the recorder; the claim falls when the bus is closed, or when the process dies.
    """

    def __init__(self, bus: Bus, file: Path) -> None:
        self._bus, self._next_s = bus, 0.0
        beat = RecorderBeat(socket.gethostname(), os.getpid(), str(file.absolute()), start=random_start())
        self._beat = beat
        bus.declare_alive(claim_address(bus.source, beat.incarnation))
        self.give()

    def give(self) -> None:
        """Publish a beat if the last one is at least ``BEAT_EACH_S`` old."""
        now_s = time.monotonic()
        if now_s >= self._next_s:
            self._next_s = now_s + BEAT_EACH_S
            self._publish()

    def end(self) -> None:
        """Publish that the recording is complete."""
        self._publish(is_last=True)

    def _publish(self, *, is_last: bool = False) -> None:
        beat = msgspec.structs.replace(self._beat, is_last=is_last)
        self._bus.publish(self._bus.source, Conversation.BEAT, beat)
