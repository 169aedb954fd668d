"""Published motions: a robot's RC publishes each motion, and returns the last ones to localizers that missed some."""

from __future__ import annotations

import logging
from collections import deque
from typing import Annotated

import msgspec

from backbone.bus.interface import Bus
from backbone.errors import LinkError, Refusal
from backbone.keys import Conversation
from backbone.naming import component_of
from backbone.ranges import MANY, Count, Instant
from backbone.wire import Message
from resource_pool.messages import Applied
from resource_pool.motion_file import MotionFile

KEPT = 300  # chosen: half a minute of driving, longer than a localizer's restart or a cut of the network
ELSEWHERE_S = 1.0  # chosen: a killed RC misses one motion; an RC elsewhere begins when a cut is seen, after 2 s

log = logging.getLogger(__name__)


class AskLastMove(Message, frozen=True):
    """Ask a radio when it last took a packet that moves this robot. The robot's RC asks this when it begins."""

    network_id: Count


class LastMove(Message, frozen=True):
    """Answer to ``AskLastMove``.

    Attributes:
        since_s: Mission time at which the radio's process began; it knows no earlier packet.
        at_s: Mission time of the last packet that moves the robot; None: there was none since then.
    """

    since_s: Instant
    at_s: Instant | None = None


class AskMotions(Message, frozen=True):
    """Ask a robot's RC for the motions that it published.

    Attributes:
        since_s: Only motions from this mission time on.
    """

    since_s: Instant


class Motions(Message, frozen=True):
    """Answer to ``AskMotions``.

    Attributes:
        begun_s: Mission time since which the RC knows all motions: the begin of its process, or of a former one on the
            same host.
        motions: The last ones, in order; the oldest may be missing.
        before: What the robot's radio knew of earlier motions when the RC began; None: nothing.
    """

    begun_s: Instant
    motions: Annotated[list[Applied], MANY]
    before: LastMove | None = None


class PublishedMotions:
    """The motions of an RC, also those of its former processes on this host.

    Args:
        bus: The RC's.
        begun_s: Mission time at which the process began.
        run_directory: The mission's folder on this host, in which the next process finds them; empty: it does not.
    """

    def __init__(self, bus: Bus, begun_s: float, run_directory: str) -> None:
        self._bus = bus
        self._file = MotionFile(run_directory, component_of(bus.source))
        self._before: LastMove | None = None
        self._born_s = begun_s
        self._begun_s, former = self._file.read() or (begun_s, [])
        self._last = deque(former, maxlen=KEPT)
        self._number = former[-1].number if former else 0
        self._room = 0

    async def ask_before(self, radio: str, network_id: int, within_s: float) -> None:
        """Ask the robot's radio for its last motion before this process.

        The record of former processes on this host is forgotten if the robot moved after it, by an RC elsewhere.

        Args:
            radio: Address of the radio.
            within_s: How long to wait for its answer, seconds of the machine.
        """
        try:
            before = await self._bus.ask(radio, AskLastMove(network_id), LastMove, within_s=within_s)
        except (Refusal, LinkError) as error:  # the radio begins, too, or is of another make
            log.info("%s does not say when the robot moved last: %s", radio, error)
            return
        if self._last and before.at_s is not None and before.at_s > self._last[-1].at_s + ELSEWHERE_S:
            self._last.clear()
            self._begun_s, self._number = self._born_s, 0
        if not self._last:
            self._before = before

    def publish(self, done: Applied) -> None:
        """Publish a motion under the next number, and keep it."""
        self._number += 1
        told = msgspec.structs.replace(done, number=self._number)
        self._last.append(told)
        if self._room:
            self._file.add(told)
            self._room -= 1
        else:
            self._file.begin(self._begun_s, self._last)
            self._room = KEPT
        self._bus.publish(self._bus.source, Conversation.MOTIONS, told)

    def since(self, at_s: float) -> Motions:
        """Return the kept motions from this time on."""
        return Motions(self._begun_s, [one for one in self._last if one.at_s >= at_s], self._before)
