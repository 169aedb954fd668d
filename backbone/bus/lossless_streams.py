"""Lossless delivery on a session: listeners that must get every message, and what a bus sends them.

Such a listener raises a token under the key that it listens to, and gets the messages at that token's key, apart from
the publications for everybody else. A sender that sees the token sends each message of the key there, too, and keeps it
until the listener acknowledges it; see ``lossless``. A token that falls is waited for, so a hub that begins anew costs
no message.
"""

from __future__ import annotations

import asyncio
import logging
import os
import struct
from typing import Any, cast

import zenoh

from backbone.bus.inbox import EachSample, InboxBus, Sample
from backbone.bus.interface import Listener
from backbone.bus.lossless import LosslessHearing, LosslessSending
from backbone.bus.neighbor_declarations import matches
from backbone.bus.zenoh_outlets import on_the_wire
from backbone.bus.zenoh_questions import LONGEST_KEY, is_inbox, new_inbox_key
from backbone.keys import Conversation, address_of, key_of_lossless, keys_of_lossless, listened_to
from backbone.quality import QUALITY, Quality
from backbone.wire import Message, Reader

STILL_COME_S = 2.0  # chosen: the lease of a link; a restarted hub is back sooner
MOST_LISTENERS = 64  # chosen: of one sender; any token may stand
_HEAD = struct.Struct("<8sQQ")  # stream, number, lost; the sender's inbox for acknowledgements follows
_ACKNOWLEDGED = struct.Struct("<8sQ")
_KIND = "acknowledged"
_BEST_EFFORT = on_the_wire(Quality(express=True))

log = logging.getLogger(__name__)


class LosslessStream:
    """What a bus sends to one such listener.

    Args:
        at: Key of the listener's token.
        quality: Of the conversation; what is dropped is sent again, so nobody is waited for.
    """

    def __init__(self, session: zenoh.Session, at: str, inbox: str, quality: Quality) -> None:
        self.at, self.pattern, self.id = at, listened_to(at), os.urandom(8)
        self.conversation = self.pattern.rpartition("/")[2]
        self.sending, self.is_wanted = LosslessSending(), True
        self._session, self._inbox, self._loop = session, inbox.encode(), asyncio.get_running_loop()
        self._wire = on_the_wire(quality) | {"congestion_control": zenoh.CongestionControl.DROP}
        self._timer: asyncio.TimerHandle | None = None

    def send(self, raw: bytes) -> None:
        """Send a message as soon as few of the earlier ones are under way."""
        if not self.sending.add(raw) and self.sending.lost == 1:
            log.warning("%s takes too little: messages for it are lost", self.at)
        self._send_due()

    def acknowledged(self, number: int) -> None:
        """Send more, because the listener has this one."""
        self.sending.acknowledge(number, self._loop.time())
        self._send_due()

    def close(self) -> None:
        """Send no more."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None

    def _send_due(self) -> None:
        self.close()
        for number, lost, raw in self.sending.due(self._loop.time()):
            self._session.put(self.at, raw, attachment=_HEAD.pack(self.id, number, lost) + self._inbox, **self._wire)
        if self.sending.again_s < float("inf"):
            self._timer = self._loop.call_at(self.sending.again_s, self._send_due)


class LosslessStreams:
    """The streams of one bus.

    Args:
        only_elsewhere: True: listeners of the same session are neighbors, who get everything without it.
    """

    def __init__(self, bus: InboxBus, session: zenoh.Session, mission: str, own: str, *, only_elsewhere: bool) -> None:
        self._bus, self._session, self._mission = bus, session, mission
        self.inbox = new_inbox_key(mission, own, _KIND)
        """Key at which it is told what listeners have."""
        self._own_id = session_id(session) if only_elsewhere else ""
        self._streams: dict[str, LosslessStream] = {}
        self._by_id: dict[bytes, LosslessStream] = {}
        self._acknowledgements: zenoh.Subscriber[None] | None = None
        at_once: Any = zenoh.handlers.Callback(lambda sample: bus.push(self._changed, sample), indirect=False)
        self._tokens = cast(
            "Any", session.liveliness().declare_subscriber(keys_of_lossless(mission), at_once, history=True)
        )

    def to(self, address: str, conversation: Conversation) -> list[LosslessStream]:
        """Return the streams of a key."""
        if not self._streams:
            return []
        return [
            one
            for one in self._streams.values()
            if one.conversation == conversation and matches(address_of(one.pattern), address)
        ]

    def close(self) -> None:
        """Send no more."""
        for stream in self._streams.values():
            stream.close()
        self._streams.clear()
        self._tokens.undeclare()
        if self._acknowledgements is not None:
            self._acknowledgements.undeclare()  # type: ignore[no-untyped-call]

    def _changed(self, sample: zenoh.Sample) -> None:
        at, stands = str(sample.key_expr), sample.kind == zenoh.SampleKind.PUT
        if self._own_id and at.rpartition("/")[2].startswith(self._own_id):
            return
        stream = self._streams.get(at)
        if stream is None and stands:
            self._begin(at)
        elif stream is not None:
            stream.is_wanted = stands
            if not stands:
                asyncio.get_running_loop().call_later(STILL_COME_S, self._end_unwanted, stream)

    def _begin(self, at: str) -> None:
        conversation = listened_to(at).rpartition("/")[2]
        if conversation not in set(Conversation) or len(self._streams) >= MOST_LISTENERS:
            log.warning("nothing is sent to %s", at)
            return
        if self._acknowledgements is None:
            self._acknowledgements = self._session.declare_subscriber(
                self.inbox, lambda sample: self._bus.push(self._acknowledged, sample)
            )
        stream = LosslessStream(self._session, at, self.inbox, QUALITY[Conversation(conversation)])
        self._streams[at] = self._by_id[stream.id] = stream

    def _end_unwanted(self, stream: LosslessStream) -> None:
        if not stream.is_wanted and self._streams.get(stream.at) is stream:
            stream.close()
            del self._streams[stream.at], self._by_id[stream.id]

    def _acknowledged(self, sample: zenoh.Sample) -> None:
        if len(sample.payload) != _ACKNOWLEDGED.size:
            return
        stream, number = _ACKNOWLEDGED.unpack(sample.payload.to_bytes())
        if (known := self._by_id.get(stream)) is not None:
            known.acknowledged(number)


class LosslessSample(EachSample):
    """Receives each message for one listener once, in order, and acknowledges those that were handed over.

    Args:
        of: Key, or pattern of keys, that it listens to.
    """

    def __init__(
        self,
        bus: InboxBus,
        session: zenoh.Session,
        of: str,
        reader: Reader[Message],
        listener: Listener,
        most_bytes: int,
    ) -> None:
        super().__init__(bus, of, reader, listener, most_bytes)
        at = key_of_lossless(of, session_id(session) + os.urandom(6).hex())
        self._session, self._mission, self._hearing = session, of.split("/")[1], LosslessHearing()
        self._subscriber = session.declare_subscriber(at, self)
        self._token = session.liveliness().declare_token(at)

    @property
    def dropped(self) -> int:
        """Messages that it did not get, because too many waited for it."""
        return self._dropped + self._hearing.lost

    def undeclare(self) -> None:
        """Withdraw it."""
        self._token.undeclare()  # type: ignore[no-untyped-call]
        self._subscriber.undeclare()  # type: ignore[no-untyped-call]

    def hand_over(self, sample: Sample) -> None:
        """Call the listener, unless the message came before, or an earlier one is missing."""
        attached = b"" if sample.attachment is None else sample.attachment.to_bytes()
        inbox = attached[_HEAD.size :].decode(errors="replace")
        if len(attached) > LONGEST_KEY or not is_inbox(inbox, self._mission, _KIND):
            self._bus.unreadable += 1
            return
        stream, number, lost = _HEAD.unpack_from(attached)
        is_new, newest = self._hearing.take(stream, number, lost)
        if is_new:
            super().hand_over(sample)
        self._session.put(inbox, _ACKNOWLEDGED.pack(stream, newest), **_BEST_EFFORT)


def session_id(session: zenoh.Session) -> str:
    """Return the id of a session."""
    return str(session.zid())
