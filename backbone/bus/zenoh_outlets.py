"""Where publications leave a bus: one zenoh publisher for each key, and the blackboard of a large conversation."""

from __future__ import annotations

from collections import OrderedDict
from typing import Any, cast

import zenoh

from backbone.bus.host_boards import HostBoards, SentBoard
from backbone.keys import LARGE, Conversation, key, key_of_sender

MOST_PUBLISHERS = 64  # chosen: most components have far fewer; a framegrabber has one for each of its ARCs
KNOWN_AFTER_S = 1.0  # chosen: the hub has told a new publisher of its subscribers by then; it takes milliseconds

# Priority, and congestion control for a full queue. Never express: without batching a queue holds two messages and
# dropped up to 360 of a burst of 1000; with batching it dropped none, at a thirtieth of the sender's cost.
_URGENT = (zenoh.Priority.REAL_TIME, zenoh.CongestionControl.BLOCK)
_SURE = (zenoh.Priority.DATA, zenoh.CongestionControl.BLOCK)
_REPEATED = (zenoh.Priority.DATA, zenoh.CongestionControl.DROP)
_BULK = (zenoh.Priority.DATA_LOW, zenoh.CongestionControl.DROP)
_FOR_RECORDERS = (zenoh.Priority.BACKGROUND, zenoh.CongestionControl.DROP)
_QUALITY = {
    Conversation.COMMAND: _URGENT,
    Conversation.LEASES: _URGENT,
    Conversation.STATUS: _SURE,
    Conversation.EVENTS: _SURE,
    Conversation.OPERATORS: _SURE,
    Conversation.SCHEDULE: _SURE,
    Conversation.FRAMES: _BULK,
    Conversation.LOG: _BULK,
    Conversation.TOLD: _FOR_RECORDERS,
    Conversation.FAR: _FOR_RECORDERS,
    Conversation.DECISIONS: _FOR_RECORDERS,
}


class Outlet:
    """The publisher of one key."""

    def __init__(self, key: str, publisher: zenoh.Publisher, known_s: float, board: SentBoard | None) -> None:
        self.key, self.publisher, self.board, self._known_s = key, publisher, board, known_s
        self._token: zenoh.LivelinessToken | None = None
        self._is_matched = False
        self._matching = self._watch_matching() if board is not None else None

    def is_heard(self, now_s: float) -> bool:
        """Return whether the network may have a subscriber of large values. A new publisher does not know it yet."""
        return self._is_matched or now_s < self._known_s

    def _watch_matching(self) -> Any:
        """Be told of subscribers, because to ask for each picture takes as long as to send it."""

        def changed(status: zenoh.MatchingStatus) -> None:
            self._is_matched = bool(cast("Any", status).matching)  # zenoh's stubs say bool of the status

        return self.publisher.declare_matching_listener(zenoh.handlers.Callback(changed, indirect=False))

    @property
    def has_subscriber(self) -> bool:
        """Whether the network is known to have a subscriber; 0.5 µs."""
        return bool(cast("Any", self.publisher).matching_status.matching)

    def is_unheard(self, now_s: float) -> bool:
        """Return whether the network is known to have no subscriber; also without a board."""
        return now_s >= self._known_s and not self.has_subscriber

    def raise_token(self, session: zenoh.Session, source: str) -> None:
        """Let listeners know this sender of the key; again, when its board was opened."""
        if self._token is not None:
            self._token.undeclare()  # type: ignore[no-untyped-call]
        self._token = session.liveliness().declare_token(key_of_sender(self.key, source))

    def close(self) -> None:
        """Withdraw the publisher."""
        for entity in (self._token, self._matching):
            if entity is not None:
                entity.undeclare()
        if self.board is not None:
            self.board.close()
        self.publisher.undeclare()  # type: ignore[no-untyped-call]


class Outlets:
    """The outlets of one bus, those that were used last.

    Args:
        only_elsewhere: True: publications do not reach subscribers of the same session.
    """

    def __init__(self, session: zenoh.Session, mission: str, source: str, *, only_elsewhere: bool) -> None:
        self._session, self._mission, self._source = session, mission, source
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

    def close(self) -> None:
        """Withdraw all."""
        for outlet in self._outlets.values():
            outlet.close()
        self._outlets.clear()

    def close_boards(self) -> None:
        """Let the readers of all boards go; the session withdraws the rest."""
        for outlet in self._outlets.values():
            if outlet.board is not None:
                outlet.board.close()

    def _declare(self, address: str, conversation: Conversation, now_s: float, boards: HostBoards | None) -> Outlet:
        priority, congestion_control = _QUALITY.get(conversation, _REPEATED)
        name = key(self._mission, address, conversation)
        publisher = self._session.declare_publisher(
            name,
            priority=priority,
            congestion_control=congestion_control,
            allowed_destination=self._destination,
        )
        board = boards.board(name, self._source) if boards is not None and conversation in LARGE else None
        outlet = Outlet(name, publisher, now_s + KNOWN_AFTER_S, board)
        if conversation in LARGE:
            outlet.raise_token(self._session, self._source)
        return outlet
