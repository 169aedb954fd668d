"""Declarations of a bus to its neighbors in its process. Each delivery is a separate step of the event loop."""

from __future__ import annotations

import asyncio
import functools
import logging
from collections.abc import Callable

from backbone.bus.bus_base import BusBase
from backbone.bus.interface import Answer, LifeListener, Listener, Overhearer
from backbone.keys import Conversation, key
from backbone.wire import (
    Accepts,
    Envelope,
    Message,
    OversizedMessage,
    UnknownMessage,
    UnwritableMessage,
    kinds_of,
    schema_of,
    write,
)

TakeBack = Callable[[], None]

log = logging.getLogger(__name__)


class Declaring(BusBase):
    """A bus with declarations in its process.

    Attributes:
        declared: Declarations that are not withdrawn.
    """

    declared: list[NeighborDeclaration]


class NeighborDeclaration:
    """A declaration of one bus.

    Args:
        take_back: Removes it from the network; called once.
    """

    def __init__(self, owner: Declaring, take_back: TakeBack) -> None:
        self.owner, self._take_back, self.closed = owner, take_back, False
        owner.declared.append(self)

    def close(self) -> None:
        """Withdraw the declaration."""
        if not self.closed:
            self.closed = True
            self.owner.declared.remove(self)
            self._take_back()


class Serving(NeighborDeclaration):
    """A declaration that answers at an address."""

    def __init__(self, owner: Declaring, take_back: TakeBack, accepts: Accepts, answer: Answer) -> None:
        super().__init__(owner, take_back)
        self.kinds, self.answer = kinds_of(accepts), answer


class Listening(NeighborDeclaration):
    """A declaration that subscribes to a conversation."""

    def __init__(
        self,
        owner: Declaring,
        take_back: TakeBack,
        pattern: str,
        conversation: Conversation,
        accepts: Accepts,
        listener: Listener,
        latest: bool,
    ) -> None:
        super().__init__(owner, take_back)
        self.pattern, self.conversation, self.kinds, self.listener = pattern, conversation, kinds_of(accepts), listener
        self.latest = latest
        self.newest: dict[str, Envelope[Message]] = {}
        self.overwritten = 0

    def deliver(self, address: str, envelope: Envelope[Message]) -> None:
        """Deliver the publication in a step of its own."""
        loop = asyncio.get_running_loop()
        if not self.latest:
            loop.call_soon(self._hand_over, envelope)
            return
        if not self.newest:
            loop.call_soon(self._hand_over_newest)
        self.overwritten += address in self.newest
        self.newest[address] = envelope

    def _hand_over_newest(self) -> None:
        newest, self.newest = self.newest, {}
        for envelope in newest.values():
            self._hand_over(envelope)

    def _hand_over(self, envelope: Envelope[Message]) -> None:
        if self.closed:
            return
        if isinstance(envelope.body, self.kinds):
            self.owner.hear(self.listener, envelope)
        else:
            self.owner.unreadable += 1
            at = key(self.owner.mission, self.pattern, self.conversation)
            schema = schema_of(type(envelope.body))
            self.owner.on_unreadable(at, UnknownMessage(f"{schema} from {envelope.source} is not expected here"))


class Overheard(NeighborDeclaration):
    """A declaration that subscribes to a conversation of one component or of all, as bytes."""

    def __init__(
        self,
        owner: Declaring,
        take_back: TakeBack,
        conversation: Conversation,
        listener: Overhearer,
        most: int,
        of: str,
    ) -> None:
        super().__init__(owner, take_back)
        self._conversation, self._listener, self._most, self._of = conversation, listener, most, of
        self._waiting = self.dropped = 0

    def hears(self, address: str, conversation: Conversation) -> bool:
        """Return whether it is subscribed to this conversation of this address."""
        return conversation is self._conversation and self._of in ("", address)

    def arrived(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Deliver a publication in a step of its own, unless too many wait, or its bytes cannot be made."""
        if not self.hears(address, conversation):
            return
        try:
            raw = write(envelope)
        except (OversizedMessage, UnwritableMessage) as refusal:  # its sender and its listeners need no bytes
            log.info("not overheard: %s", refusal)
            self.dropped += 1
            return
        if self._waiting + len(raw) > self._most:
            self.dropped += 1
            return
        self._waiting += len(raw)
        name = key(self.owner.mission, address, conversation)
        asyncio.get_running_loop().call_soon(self._hand_over, name, raw)

    def _hand_over(self, name: str, raw: bytes) -> None:
        self._waiting -= len(raw)
        if not self.closed:
            self.owner.heard += 1
            self.owner.call("", self._listener, name, raw)


class Watching(NeighborDeclaration):
    """A declaration that watches tokens."""

    def __init__(self, owner: Declaring, take_back: TakeBack, pattern: str, listener: LifeListener) -> None:
        super().__init__(owner, take_back)
        self.pattern, self.listener = pattern, listener

    def concerns(self, address: str) -> bool:
        """Return whether the listener watches this address."""
        return matches(self.pattern, address)

    def notify(self, address: str, alive: bool) -> None:
        """Call the listener in a step of its own, if it watches this address."""
        if self.concerns(address):
            asyncio.get_running_loop().call_soon(self._hand_over, address, alive)

    def _hand_over(self, address: str, alive: bool) -> None:
        if not self.closed:
            self.owner.call("", self.listener, address, alive)


@functools.lru_cache(maxsize=4096)
def matches(pattern: str, address: str) -> bool:
    """Return whether a pattern matches an address or key: ``*`` is any one segment, and one ``**`` any number."""
    before, is_any_number, after = pattern.partition("**/")
    if is_any_number:
        begin, end = before.count("/"), after.count("/") + 1
        parts = address.split("/")
        return len(parts) >= begin + end and all(
            matches(one, "/".join(of))
            for one, of in ((before[:-1], parts[:begin]), (after, parts[len(parts) - end :]))
            if one
        )
    if pattern == address:
        return True
    wanted, given = pattern.split("/"), address.split("/")
    return len(wanted) == len(given) and all(w in ("*", g) for w, g in zip(wanted, given, strict=True))
