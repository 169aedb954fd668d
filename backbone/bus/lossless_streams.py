"""Lossless delivery on a session: listeners that must get every message, and the streams of a bus to them.

A lossless listener declares a token under the key that it listens to, and gets the messages at that token's key, apart
from the publications for all other listeners. A sender that sees the token sends each message of the key there, too,
and keeps it until the listener acknowledges it; see ``lossless``. If a token ends, senders keep its stream for
``STILL_COME_S``, so a restart of the hub costs no message.
"""

from __future__ import annotations

import asyncio
import logging
import math
import os
import struct
from collections.abc import Callable
from typing import Any, cast

import msgspec
import zenoh

from backbone.bus.inbox import InboxBus, Payload, Sample
from backbone.bus.interface import Subscription
from backbone.bus.lossless import STILL_COME_S, LosslessHearing, LosslessSending
from backbone.bus.neighbor_declarations import matches
from backbone.bus.zenoh_outlets import on_the_wire
from backbone.bus.zenoh_questions import LONGEST_KEY, is_inbox, new_inbox_key
from backbone.keys import Conversation, key_of_lossless, keys_of_lossless, listened_to
from backbone.quality import QUALITY, Quality

MOST_LISTENERS = 4096  # chosen: one for each component of the largest mission; a client may declare any token
MOST_KEYS_FOUND = 256  # chosen: four times the publishers of a bus
LEAST_SLASHES = 5  # of scout/<mission>/<subsystem>/<conversation>/all/<listener>
_HEAD = struct.Struct("<8sQQH")  # stream, number, lost, length of the sender's inbox, which follows, and then the key
_ACKNOWLEDGED = struct.Struct("<8sQ")
_KIND = "acknowledged"
_BEST_EFFORT = on_the_wire(Quality(express=True))

log = logging.getLogger(__name__)


class LosslessStream:
    """The messages of a bus to one lossless listener.

    Args:
        at: Key of the listener's token.
        inbox: Key at which the listener acknowledges.
    """

    def __init__(self, session: zenoh.Session, at: str, inbox: str) -> None:
        self.at, self.id, self.sending = at, os.urandom(8), LosslessSending()
        conversation = Conversation(listened_to(at).rpartition("/")[2])
        self._session, self._inbox, self._loop = session, inbox.encode(), asyncio.get_running_loop()
        quality = msgspec.structs.replace(QUALITY[conversation], reliable=False)  # dropped messages are sent again
        self._wire = on_the_wire(quality)
        self._timer: asyncio.TimerHandle | None = None

    def send(self, key: str, raw: bytes) -> None:
        """Send a message as soon as few of the earlier ones are under way."""
        if not self.sending.add(key, raw) and self.sending.lost == 1:
            log.warning("%s is too slow: messages for it are lost", self.at)
        self._send_due()

    def acknowledged(self, number: int) -> None:
        """Send more, because the listener has the messages up to this number."""
        self.sending.acknowledge(number, self._loop.time())
        self._send_due()

    def close(self) -> None:
        """Send no more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _send_due(self) -> None:
        self.close()
        for number, lost, key, raw in self.sending.due(self._loop.time()):
            head = _HEAD.pack(self.id, number, lost, len(self._inbox))
            self._session.put(self.at, raw, attachment=head + self._inbox + key.encode(), **self._wire)
        if self.sending.again_s < math.inf:
            self._timer = self._loop.call_at(self.sending.again_s, self._send_due)


class LosslessStreams:
    """The streams of one bus.

    Args:
        only_elsewhere: True: no streams to listeners of the same session, which get the messages as neighbors.
    """

    def __init__(self, bus: InboxBus, session: zenoh.Session, mission: str, own: str, *, only_elsewhere: bool) -> None:
        self._bus, self._session, self._mission = bus, session, mission
        self.inbox = new_inbox_key(mission, own, _KIND)
        """Key at which listeners acknowledge messages of this bus."""
        self._own_id = session_id(session) if only_elsewhere else ""
        self._fell_s: dict[str, float] = {}  # key of a listener's token → when it ended; infinite: it exists
        self._streams: dict[str, LosslessStream] = {}
        self._found: dict[tuple[str, Conversation], list[LosslessStream]] = {}
        self._by_id: dict[bytes, LosslessStream] = {}
        self._acknowledgements: zenoh.Subscriber[None] | None = None
        at_once: Any = zenoh.handlers.Callback(lambda sample: bus.push(self._changed, sample), indirect=False)
        self._tokens = cast(
            "Any", session.liveliness().declare_subscriber(keys_of_lossless(mission), at_once, history=True)
        )

    def to(self, address: str, conversation: Conversation) -> list[LosslessStream]:
        """Return the streams of a key."""
        if not self._fell_s:
            return []
        found = self._found.get((address, conversation))
        if found is None:
            meant = f"{address}/{conversation}"
            found = [self._stream(at) for at in self._fell_s if matches(listened_to(at).split("/", 2)[2], meant)]
            if len(self._found) >= MOST_KEYS_FOUND:
                self._found.clear()
            self._found[address, conversation] = found
        return found

    def close(self) -> None:
        """Send no more."""
        for stream in self._streams.values():
            stream.close()
        self._streams.clear()
        self._fell_s.clear()
        self._tokens.undeclare()
        if self._acknowledgements is not None:
            self._acknowledgements.undeclare()  # type: ignore[no-untyped-call]

    def _changed(self, sample: zenoh.Sample) -> None:
        at, stands = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
        if self._own_id and at.rpartition("/")[2].startswith(self._own_id):
            return
        loop = asyncio.get_running_loop()
        if at in self._fell_s:
            self._fell_s[at] = fell_s = math.inf if stands else loop.time()
            if not stands:
                loop.call_later(STILL_COME_S, self._forget_fallen, at, fell_s)
        elif stands and at.count("/") >= LEAST_SLASHES and len(self._fell_s) < MOST_LISTENERS:
            self._fell_s[at] = math.inf
            self._found.clear()

    def _forget_fallen(self, at: str, fell_s: float) -> None:
        if self._fell_s.get(at) != fell_s:
            return  # it exists again, or ended again
        del self._fell_s[at]
        self._found.clear()
        if (stream := self._streams.pop(at, None)) is not None:
            stream.close()
            del self._by_id[stream.id]

    def _stream(self, at: str) -> LosslessStream:
        """Return the stream to a listener, which begins with the first message for it."""
        if self._acknowledgements is None:
            self._acknowledgements = self._session.declare_subscriber(
                self.inbox, lambda sample: self._bus.push(self._acknowledged, sample)
            )
        stream = self._streams.get(at)
        if stream is None:
            stream = self._streams[at] = LosslessStream(self._session, at, self.inbox)
            self._by_id[stream.id] = stream
        return stream

    def _acknowledged(self, sample: zenoh.Sample) -> None:
        if len(sample.payload) != _ACKNOWLEDGED.size:
            return
        stream, number = _ACKNOWLEDGED.unpack(sample.payload.to_bytes())
        if (known := self._by_id.get(stream)) is not None:
            known.acknowledged(number)


class LosslessSamples:
    """Receives each message for one listener once, in order, and acknowledges those that were handed over.

    Args:
        of: Key, or pattern of keys, that it listens to.
        hand_over: Called in the event loop with the key of each message and its bytes.
    """

    def __init__(
        self, bus: InboxBus, session: zenoh.Session, of: str, hand_over: Callable[[str, Payload], None]
    ) -> None:
        self.of, self._bus, self._session, self._hand_over = of, bus, session, hand_over
        self._mission, self._hearing = of.split("/")[1], LosslessHearing()
        at = key_of_lossless(of, session_id(session) + os.urandom(6).hex())
        self._subscriber = session.declare_subscriber(at, lambda sample: bus.push(self._arrived, sample))
        self._token = session.liveliness().declare_token(at)

    @property
    def dropped(self) -> int:
        """Messages that it did not get, because too many waited for it at a sender."""
        return self._hearing.lost

    def undeclare(self) -> None:
        """Withdraw the subscription."""
        self._token.undeclare()  # type: ignore[no-untyped-call]
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]

    def _arrived(self, sample: Sample) -> None:
        """Hand over the message, unless it came before, or an earlier one is missing."""
        attached = b"" if sample.attachment is None else sample.attachment.to_bytes()
        if not _HEAD.size <= len(attached) <= 2 * LONGEST_KEY:
            self._bus.unreadable += 1
            return
        stream, number, lost, length = _HEAD.unpack_from(attached)
        names = attached[_HEAD.size :]
        inbox, key = (name.decode(errors="replace") for name in (names[:length], names[length:]))
        if not (is_inbox(inbox, self._mission, _KIND) and matches(self.of, key)):
            self._bus.unreadable += 1
            return
        is_new, newest = self._hearing.take(stream, number, lost)
        if is_new:
            self._hand_over(key, sample.payload)
        self._session.put(inbox, _ACKNOWLEDGED.pack(stream, newest), **_BEST_EFFORT)


class LosslessOverhearing:
    """A lossless subscription to whole conversations."""

    def __init__(self, declared: Subscription, samples: LosslessSamples) -> None:
        self._declared, self._samples = declared, samples

    @property
    def dropped(self) -> int:
        """Messages that it did not get, because too many waited for it at a sender."""
        return self._samples.dropped

    def close(self) -> None:
        """Withdraw the subscription."""
        self._declared.close()


def session_id(session: zenoh.Session) -> str:
    """Return the id of a session."""
    return str(session.zid())
