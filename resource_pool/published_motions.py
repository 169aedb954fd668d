"""Published motions: what a robot's RC tells localizers, and keeps for those that miss a part of it."""

from __future__ import annotations

from collections import deque
from typing import Annotated

import msgspec

from backbone.bus.interface import Bus
from backbone.keys import Conversation
from backbone.ranges import MANY, Instant
from backbone.wire import Message
from resource_pool.messages import Applied

KEPT = 300  # chosen: half a minute of driving, longer than a localizer's restart or a cut of the network


class AskMotions(Message, frozen=True):
    """Ask a robot's RC for the motions that it published.

    Attributes:
        since_s: Only motions from this mission time on.
    """

    since_s: Instant


class Motions(Message, frozen=True):
    """Answer to ``AskMotions``.

    Attributes:
        begun_s: Mission time at which the process of the RC began.
        motions: The last ones of this process, in order; the oldest may be missing.
    """

    begun_s: Instant
    motions: Annotated[list[Applied], MANY]


class PublishedMotions:
    """The motions of one process of an RC.

    Args:
        bus: The RC's.
        begun_s: Mission time at which the process began.
    """

    def __init__(self, bus: Bus, begun_s: float) -> None:
        self._bus = bus
        self._begun_s = begun_s
        self._number = 0
        self._last: deque[Applied] = deque(maxlen=KEPT)

    def publish(self, done: Applied) -> None:
        """Publish a motion under the next number, and keep it."""
        self._number += 1
        told = msgspec.structs.replace(done, number=self._number)
        self._last.append(told)
        self._bus.publish(self._bus.source, Conversation.MOTIONS, told)

    def since(self, at_s: float) -> Motions:
        """Return the kept motions from this time on."""
        return Motions(self._begun_s, [one for one in self._last if one.at_s >= at_s])
