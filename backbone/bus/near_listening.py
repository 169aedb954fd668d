"""A subscription to the values of one key: from blackboards of this host if possible, else by network.

It begins with a subscription on the network. Each sender that uses blackboards declares a token. When every sender
with a token for the key has put a value on its board, the network's subscription is withdrawn. If a board ends, or
another sender declares a token, the network's subscription is declared again at once. So no sender is missed for longer
than a declaration takes.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from typing import NamedTuple, Protocol

from backbone.blackboard.reader import BlackboardReader
from backbone.blackboard.values import NoWriter
from backbone.bus.host_boards import LOOK_EACH_S, HostBoards
from backbone.bus.inbox import EachSample, InboxBus, LatestSample, Sample
from backbone.bus.interface import Listener
from backbone.errors import Refusal
from backbone.wire import MAX_LARGE_MESSAGE_BYTES, Envelope, Message, Reader

IN_FLIGHT_S = 1.0  # chosen: the longest time for which a value may be on its way while a newer one overtakes it
MOST_SENDERS = 64  # chosen: for one key; it has one sender at a time, but any process may invent senders


log = logging.getLogger(__name__)


class Entity(Protocol):
    """A declaration on the network."""

    def undeclare(self) -> None:
        """Withdraw it."""


class SendersHeard:
    """Decides whether the network is needed to get the values of all senders of a key. Pure."""

    def __init__(self) -> None:
        self._standing: set[str] = set()
        self._near: set[str] = set()

    def rose(self, source: str) -> None:
        """Record a sender's token."""
        self._standing.add(source)

    def fell(self, source: str) -> None:
        """Record that the sender's token ended."""
        self._standing.discard(source)

    def stands(self, source: str) -> bool:
        """Return whether the sender's token stands."""
        return source in self._standing

    def gave(self, source: str) -> None:
        """Record that a value came from the sender's board."""
        self._near.add(source)

    def ended(self, source: str) -> None:
        """Record that the sender's board ended."""
        self._near.discard(source)

    @property
    def need_network(self) -> bool:
        """True unless there are senders with tokens, and all of them put their values on boards."""
        return not self._standing or not self._standing <= self._near


class _Last(NamedTuple):
    sequence: int
    stamp_s: float
    came_s: float


class NewestOnly:
    """Decides which values to deliver if the values of one sender come by two ways: no old ones, none twice. Pure.

    Numbers grow within a sender's life, and a later life has later stamps. If a sender restarts on a host whose clock
    is behind, its values are delivered after ``IN_FLIGHT_S``.
    """

    def __init__(self) -> None:
        self._last: dict[str, _Last] = {}

    def admits(self, source: str, sequence: int, stamp_s: float, now_s: float) -> bool:
        """Return whether to deliver this value, which is the sender's newest then."""
        last = self._last.pop(source, None)
        is_new = (
            last is None or sequence > last.sequence or stamp_s > last.stamp_s or now_s - last.came_s >= IN_FLIGHT_S
        )
        self._last[source] = _Last(sequence, stamp_s, now_s) if is_new or last is None else last
        if len(self._last) > MOST_SENDERS:
            del self._last[next(iter(self._last))]
        return is_new


class NearListening(LatestSample):
    """A subscription to the newest value of one key; it is called with each sample from the network.

    Args:
        key: Key of the publications.
        declare: Declares the network's subscription with this receiver.
    """

    def __init__(
        self,
        bus: InboxBus,
        reader: Reader[Message],
        listener: Listener,
        boards: HostBoards,
        key: str,
        declare: Callable[[Callable[[Sample], None]], Entity],
    ) -> None:
        super().__init__(bus, key, reader, listener)
        self._boards, self._key, self._declare = boards, key, declare
        self._loop = asyncio.get_running_loop()
        self._senders, self._order = SendersHeard(), NewestOnly()
        self._readers: dict[str, BlackboardReader] = {}
        self._had_boards: set[str] = set()
        self._look_again_s: dict[str, float] = {}
        self._will_look: set[str] = set()
        self._is_open = True
        self._network: Entity | None = declare(self)
        self.tokens: Entity | None = None
        """The watch over senders' tokens, which is withdrawn with the subscription; settable."""

    def sender_changed(self, source: str, stands: bool) -> None:
        """Record that a sender's token began or ended."""
        if source in self._boards.neighbors or not self._is_open:
            return
        if stands:
            self._senders.rose(source)
            self._look(source)
        else:
            self._senders.fell(source)
        self._mend()

    def deliver(self, envelope: Envelope[Message]) -> None:
        """Deliver a value from the network, unless the same or a newer value came from a board."""
        if not self._is_open:
            return
        if self._loop.time() >= self._look_again_s.get(envelope.source, 0.0):
            self._look(envelope.source)
        self._deliver_if_new(envelope)

    def undeclare(self) -> None:
        """Withdraw the subscription."""
        self._is_open = False
        for source in tuple(self._readers):
            self._leave(source)
        for entity in (self.tokens, self._network):
            if entity is not None:
                entity.undeclare()
        self.tokens = self._network = None

    def _look(self, source: str) -> None:
        """Read the sender's board from now on, if it has one here."""
        if source in self._readers or source in self._boards.neighbors:
            return
        found = self._boards.look(self._key, source)
        if found is None:
            if len(self._look_again_s) >= MOST_SENDERS:
                self._look_again_s.clear()
            self._look_again_s[source] = self._loop.time() + LOOK_EACH_S
            self._look_later(source)
            return
        self._readers[source] = found
        self._had_boards.add(source)
        self._loop.add_reader(found, self._take, source)

    def _look_later(self, source: str) -> None:
        """Look again for a board that was here: values too long for the network come by it alone."""
        if source not in self._had_boards or source in self._will_look:
            return

        def look() -> None:
            self._will_look.discard(source)
            if self._is_open and self._senders.stands(source):
                self._look(source)

        self._will_look.add(source)
        self._loop.call_later(LOOK_EACH_S, look)

    def _take(self, source: str) -> None:
        try:
            value = self._readers[source].newest()
        except (Refusal, OSError) as fault:
            if not isinstance(fault, NoWriter):  # an invalid board, or no descriptors are left
                log.warning("no board of %s for now: %s", source, fault)
                self._look_again_s[source] = self._loop.time() + LOOK_EACH_S
            self._leave(source)
            self._mend()
            self._look_later(source)
            return
        if value is None:
            return
        self._senders.gave(source)
        self._mend()
        try:
            envelope = self._reader.read(value.data, MAX_LARGE_MESSAGE_BYTES)
        except Refusal as unreadable:
            self.count_unreadable(self._key, unreadable)
            return
        self._deliver_if_new(envelope)

    def _deliver_if_new(self, envelope: Envelope[Message]) -> None:
        is_new = self._order.admits(envelope.source, envelope.sequence, envelope.stamp_s, self._loop.time())
        if is_new or envelope.source not in self._had_boards:  # a recording that is played may go back
            super().deliver(envelope)

    def _leave(self, source: str) -> None:
        reader = self._readers.pop(source)
        self._loop.remove_reader(reader)
        reader.close()
        self._senders.ended(source)

    def _mend(self) -> None:
        """Declare or withdraw the network's subscription, so that it exists only while it is needed."""
        if self._senders.need_network and self._network is None:
            self._network = self._declare(self)
        elif not self._senders.need_network and self._network is not None:
            self._network.undeclare()
            self._network = None


class EachNear(NearListening):
    """A subscription to each value of one key, on boards that keep each value for their readers."""

    def __call__(self, sample: Sample) -> None:
        """Take a sample in; called from any thread."""
        EachSample.__call__(self, sample)
