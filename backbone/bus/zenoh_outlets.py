"""Outlets of a bus: one zenoh publisher for each key, and a blackboard for a key of a large conversation."""

from __future__ import annotations

import logging
import math
from collections import OrderedDict
from collections.abc import Callable, Sequence
from typing import Any, cast

import zenoh

from backbone.bus.host_boards import LARGE_BYTES, HostBoards, SentBoard
from backbone.keys import Conversation, key, key_of_sender
from backbone.quality import EACH_ON_HOST, OF_ANY_SIZE, Quality, Urgency
from backbone.wire import Envelope, Message, refuse_oversized, write

log = logging.getLogger(__name__)

MISSED_AFTER_S = 2.0  # chosen: a listener of this host finds the board in milliseconds, on a busy machine in 1 s
MOST_PUBLISHERS = 64  # chosen: most components have far fewer; a framegrabber has one for each of its ARCs
KNOWN_AFTER_S = 1.0  # chosen: a new publisher knows its subscribers by then; it takes milliseconds

Receiver = Callable[[bytes], None]

_PRIORITIES = {
    Urgency.URGENT: (zenoh.Priority.REAL_TIME, zenoh.Priority.INTERACTIVE_HIGH),
    Urgency.NORMAL: (zenoh.Priority.DATA_HIGH, zenoh.Priority.DATA),
    Urgency.LOW: (zenoh.Priority.DATA_LOW, zenoh.Priority.DATA_LOW),
    Urgency.LOWEST: (zenoh.Priority.BACKGROUND, zenoh.Priority.BACKGROUND),
}
"""Urgency → priority of reliable messages, and of others: in one queue, a status would wait behind outputs that fill
it, and block its sender while the hub hangs."""


def on_the_wire(quality: Quality) -> dict[str, Any]:
    """Return a quality as settings of zenoh, for a publisher or a single publication."""
    control = zenoh.CongestionControl
    reliable, best_effort = _PRIORITIES[quality.urgency]
    return {
        "priority": reliable if quality.reliable else best_effort,
        "congestion_control": control.BLOCK if quality.reliable else control.DROP,
        "express": quality.express,
    }


class Outlet:
    """The publisher of one key.

    Args:
        known_s: Time from which the publisher knows the subscribers that were there before it.
        board: Board for listeners on this host; None: there is none.
        declare_token: Declares the token by which listeners find this sender of the key.
    """

    def __init__(
        self,
        key: str,
        publisher: zenoh.Publisher,
        quality: Quality,
        known_s: float,
        board: SentBoard | None,
        declare_token: Callable[[], zenoh.LivelinessToken],
    ) -> None:
        self.key, self.publisher, self.quality, self.board, self._known_s = key, publisher, quality, board, known_s
        self._is_output = key.endswith(f"/{Conversation.OUTPUTS}")
        self._declare_token = declare_token
        self._token = declare_token() if quality.most_bytes_on_host else None
        self._is_matched = False
        self._missed_since_s, self._has_told = math.inf, False
        self._matching = self._watch_matching() if board is not None else None

    def is_heard(self, now_s: float) -> bool:
        """Return whether the network may have a subscriber of large values; True while the publisher is new."""
        return self._is_matched or now_s < self._known_s

    def _watch_matching(self) -> Any:
        """Watch for subscribers, because to ask zenoh before each picture takes as long as to send it."""

        def changed(status: zenoh.MatchingStatus) -> None:
            self._is_matched = bool(cast("Any", status).matching)  # zenoh's stubs declare the status as bool

        return self.publisher.declare_matching_listener(zenoh.handlers.Callback(changed, indirect=False))

    @property
    def has_subscriber(self) -> bool:
        """Whether the network is known to have a subscriber; 0.5 µs."""
        return bool(cast("Any", self.publisher).matching_status.matching)

    def is_unheard(self, now_s: float) -> bool:
        """Return whether the network is known to have no subscriber; also without a board."""
        return now_s >= self._known_s and not self.has_subscriber

    def send(self, envelope: Envelope[Message], apart: Sequence[Receiver], now_s: float) -> None:
        """Publish a message, and pass its bytes to the receivers ``apart``, too.

        A repeated value without a listener is not even encoded, because the next one follows soon.

        Raises:
            OversizedMessage: The message is longer than its quality admits; no listener gets it.
        """
        if self.board is not None:
            self._send_large(self.board, envelope, apart, now_s)
            return
        if not apart and self._is_output and self.is_unheard(now_s):
            return
        raw = write(envelope, self.quality.most_bytes)
        self.publisher.put(raw)
        for send in apart:
            send(raw)

    def _send_large(
        self, board: SentBoard, envelope: Envelope[Message], apart: Sequence[Receiver], now_s: float
    ) -> None:
        """Put the message on the board, and publish it if the network may have a subscriber."""
        is_heard = self.is_heard(now_s)
        if not (is_heard or apart or board.is_read):
            return
        raw = write(envelope, self.quality.most_bytes_on_host)
        if board.put(raw):
            self._raise_token()
        if len(raw) > self.quality.most_bytes:
            if not board.is_open:
                what = f"without a board on this host, {type(envelope.body).__name__}"
                refuse_oversized(len(raw), self.quality.most_bytes, what)
            self._watch_missed(len(raw), now_s)
            return
        if is_heard:
            self.publisher.put(raw)
        for send in apart:
            send(raw)

    def _watch_missed(self, length: int, now_s: float) -> None:
        """Log once that a subscriber that does not read the board misses the values, which are too long for it."""
        if not self._is_matched:
            self._missed_since_s = math.inf
        elif self._missed_since_s == math.inf:
            self._missed_since_s = now_s
        elif not self._has_told and now_s - self._missed_since_s >= MISSED_AFTER_S:
            self._has_told = True
            limit = self.quality.most_bytes
            log.warning("%s: subscribers on other hosts miss %d bytes, %d fit the network", self.key, length, limit)

    def _raise_token(self) -> None:
        """Declare the token again, so that listeners find the board that was opened."""
        if self._token is not None:
            self._token.undeclare()  # type: ignore[no-untyped-call]
        self._token = self._declare_token()

    def close(self) -> None:
        """Withdraw the publisher."""
        for entity in (self._token, self._matching):
            if entity is not None:
                entity.undeclare()
        if self.board is not None:
            self.board.close()
        self.publisher.undeclare()  # type: ignore[no-untyped-call]


class Outlets:
    """The outlets of one bus that were used last.

    Args:
        quality_of: Returns the quality of the key of an address and a conversation.
        only_elsewhere: True: publications do not reach subscribers of the same session.
    """

    def __init__(
        self,
        session: zenoh.Session,
        mission: str,
        source: str,
        quality_of: Callable[[str, Conversation], Quality],
        *,
        only_elsewhere: bool,
    ) -> None:
        self._session, self._mission, self._source, self._quality_of = session, mission, source, quality_of
        self._destination = zenoh.Locality.REMOTE if only_elsewhere else zenoh.Locality.ANY
        self._outlets: OrderedDict[tuple[str, Conversation], Outlet] = OrderedDict()

    def outlet(self, address: str, conversation: Conversation, now_s: float, boards: HostBoards | None) -> Outlet:
        """Return the outlet of a key.

        Raises:
            IllegalName: The address cannot be part of a key.
        """
        outlet = self._outlets.get((address, conversation))
        if outlet is None:
            outlet = self._outlets[address, conversation] = self._declare(address, conversation, now_s, boards)
            while len(self._outlets) > MOST_PUBLISHERS:
                self._outlets.popitem(last=False)[1].close()
        self._outlets.move_to_end((address, conversation))
        return outlet

    @property
    def is_full(self) -> bool:
        """Whether a further outlet replaces another one."""
        return len(self._outlets) >= MOST_PUBLISHERS

    def close(self) -> None:
        """Withdraw all."""
        for outlet in self._outlets.values():
            outlet.close()
        self._outlets.clear()

    def close_boards(self) -> None:
        """Close all boards for their readers; the session withdraws the rest."""
        for outlet in self._outlets.values():
            if outlet.board is not None:
                outlet.board.close()

    def _declare(self, address: str, conversation: Conversation, now_s: float, boards: HostBoards | None) -> Outlet:
        name, quality = key(self._mission, address, conversation), self._quality_of(address, conversation)
        publisher = self._session.declare_publisher(name, allowed_destination=self._destination, **on_the_wire(quality))
        is_large = quality.most_bytes_on_host > 0
        from_bytes = 0 if conversation in OF_ANY_SIZE else LARGE_BYTES
        board = None
        if boards is not None and is_large:
            board = boards.board(name, self._source, from_bytes, each=conversation in EACH_ON_HOST)

        def declare_token() -> zenoh.LivelinessToken:
            return self._session.liveliness().declare_token(key_of_sender(name, self._source))

        return Outlet(name, publisher, quality, now_s + KNOWN_AFTER_S, board, declare_token)
