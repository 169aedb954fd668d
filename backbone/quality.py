"""Quality: how the messages of one key travel, declared once for each conversation.

The buses, the recorder, ``scout-backbone top`` and the reference page of messages read this table. A mission file can
declare another quality for one key of its modules.
"""

from __future__ import annotations

from enum import StrEnum
from typing import Annotated

import msgspec

from backbone.keys import Conversation
from backbone.ranges import Duration
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, MAX_MESSAGE_BYTES

FEW_BYTES = 64 * 1024  # chosen: sixteen times the longest payload of a packet
SOME_BYTES = 2 * 1024 * 1024  # chosen: the longest text, 262 144 characters of up to four bytes, and as much again


class Urgency(StrEnum):
    """The queue in which a message waits for the network; messages of an earlier one leave first."""

    URGENT = "urgent"
    NORMAL = "normal"
    LOW = "low"
    LOWEST = "lowest"


class Quality(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """How the messages of one key travel.

    Attributes:
        reliable: True: if a queue is full, the sender waits at most ``WAIT_BEFORE_CLOSE_US``; then the blocked link is
            closed. False: the message is dropped for the subscribers behind a full queue.
        urgency: The queue in which messages wait.
        express: True: each message leaves at once. False: messages that wait leave together.
        most_bytes: A longer message is refused.
        most_bytes_on_host: The same limit for listeners on the sender's host, which read the message from a blackboard;
            0: no blackboard is used.
        deadline_s: If the next message does not come within this mission time, the units that read the key report a
            missed deadline; 0: no deadline.
    """

    reliable: bool = False
    urgency: Urgency = Urgency.NORMAL
    express: bool = False
    most_bytes: Annotated[int, msgspec.Meta(ge=1, le=MAX_MESSAGE_BYTES)] = MAX_MESSAGE_BYTES
    most_bytes_on_host: Annotated[int, msgspec.Meta(ge=0, le=MAX_LARGE_MESSAGE_BYTES)] = 0
    deadline_s: Duration = 0.0

    def __str__(self) -> str:
        """Return it in two words.

        Example:
            >>> str(QUALITY[Conversation.FRAMES]), str(QUALITY[Conversation.ASK])
            ('best effort, low', 'reliable, normal, express')
        """
        words = ["reliable" if self.reliable else "best effort", self.urgency, *(["express"] if self.express else [])]
        return ", ".join(words)


_SMALL = Quality(most_bytes=FEW_BYTES)
_LARGE = Quality(most_bytes_on_host=MAX_LARGE_MESSAGE_BYTES)
QUALITY: dict[Conversation, Quality] = {
    # Sent once: each message must arrive. Only questions and answers are express, because a single small message gains
    # nothing from a batch. Without batches a queue holds two messages and dropped up to 360 of a burst of 1000.
    Conversation.ASK: Quality(reliable=True, express=True),
    Conversation.COMMAND: Quality(
        reliable=True, urgency=Urgency.URGENT, most_bytes=FEW_BYTES, most_bytes_on_host=FEW_BYTES
    ),
    Conversation.LEASES: Quality(reliable=True, urgency=Urgency.URGENT),
    Conversation.STATUS: Quality(reliable=True),
    Conversation.EVENTS: Quality(reliable=True, most_bytes=SOME_BYTES),
    Conversation.OPERATORS: Quality(reliable=True, most_bytes=SOME_BYTES),
    Conversation.SCHEDULE: Quality(reliable=True),
    # Repeated: the next message replaces a dropped one.
    Conversation.ALIVE: _SMALL,  # tokens have no messages; a recording has one for each start and end of a token
    Conversation.TELEMETRY: Quality(),
    Conversation.MOTIONS: _SMALL,
    Conversation.REPLIES: _SMALL,
    Conversation.READINGS: Quality(most_bytes=SOME_BYTES),
    Conversation.POSES: _SMALL,
    Conversation.SIGHTINGS: _SMALL,
    Conversation.BEAT: _SMALL,
    Conversation.HEALTH: Quality(),
    Conversation.BODIES: _LARGE,
    Conversation.OUTPUTS: _LARGE,
    Conversation.VIEWS: _LARGE,
    Conversation.FRAMES: Quality(urgency=Urgency.LOW, most_bytes_on_host=MAX_LARGE_MESSAGE_BYTES),
    Conversation.LOG: Quality(urgency=Urgency.LOW, most_bytes=SOME_BYTES),
    # For recorders, in a queue of their own.
    Conversation.TOLD: Quality(urgency=Urgency.LOWEST),
    Conversation.FAR: Quality(urgency=Urgency.LOWEST),
    Conversation.DECISIONS: Quality(urgency=Urgency.LOWEST),
}
"""Conversation → quality of its keys, unless a mission file declares another one."""

NEVER_DROPPED = frozenset(one for one, quality in QUALITY.items() if quality.reliable) - {Conversation.ASK}
"""Conversations whose publications must arrive: a subscriber that does not read them blocks senders."""
EACH_ON_HOST = frozenset({Conversation.COMMAND})
"""Conversations whose listeners on the sender's host get each message from its blackboard, in order."""
LARGE = frozenset(one for one, quality in QUALITY.items() if quality.most_bytes_on_host) - EACH_ON_HOST
"""Conversations of large values: listeners on the sender's host read the newest one on its blackboard."""
OF_ANY_SIZE = frozenset({Conversation.BODIES}) | EACH_ON_HOST
"""Conversations whose small values use the blackboard too: few senders repeat them many times a second."""


class OutputQuality(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The quality of one key of a mission's modules, as the mission file declares it; see ``Quality``.

    Attributes:
        most_bytes: A longer value is refused; one that is longer than the network admits stays on its host.
    """

    reliable: bool = False
    urgency: Urgency = Urgency.NORMAL
    express: bool = False
    most_bytes: Annotated[int, msgspec.Meta(ge=1, le=MAX_LARGE_MESSAGE_BYTES)] = MAX_LARGE_MESSAGE_BYTES
    deadline_s: Duration = 0.0

    @property
    def quality(self) -> Quality:
        """The quality of the key."""
        return Quality(
            reliable=self.reliable,
            urgency=self.urgency,
            express=self.express,
            most_bytes=min(self.most_bytes, MAX_MESSAGE_BYTES),
            most_bytes_on_host=self.most_bytes,
            deadline_s=self.deadline_s,
        )
