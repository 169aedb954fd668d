"""Liveliness on one session of zenoh: tokens, and the session's own link to the hub."""

from __future__ import annotations

from typing import Any

import zenoh

from backbone.bus.declared import Declaration, FirstReply
from backbone.bus.inbox import InboxBus, Receiving
from backbone.bus.interface import Clock, LifeListener, LinkListener, Subscription
from backbone.bus.zenoh_settings import LINK_LEASE_MS
from backbone.keys import Conversation, address_of, key


class LifeBus(InboxBus):
    """Base class of a bus on a session: its declarations, and its methods for liveliness.

    Args:
        is_hub: True if the session is the hub itself.
    """

    def __init__(self, mission: str, source: str, clock: Clock, session: zenoh.Session, *, is_hub: bool) -> None:
        super().__init__(mission, source, clock)
        self._session, self._is_hub = session, is_hub
        self._declared: set[Declaration] = set()

    def declare_alive(self, address: str) -> Subscription:
        """Declare this component's liveliness token; see ``Bus.declare_alive``."""
        self.require_open()
        own = key(self._mission, address, Conversation.ALIVE)
        return self._declare(self._session.liveliness().declare_token(own))

    async def stands(self, address: str) -> bool:
        """Return whether the hub has a token at this address; False without a hub.

        Raises:
            NoResponder: The bus is closed already.
        """
        answered = self.open_question()
        arrived = FirstReply(self, answered)
        try:
            self._session.liveliness().get(
                key(self._mission, address, Conversation.ALIVE),
                zenoh.handlers.Callback(arrived.reply, arrived.end, indirect=False),
                timeout=LINK_LEASE_MS / 1000,
            )
            got = await answered
        finally:
            self.end_question(answered)
        return got is not None and got.ok is not None

    def watch_alive(self, address: str, listener: LifeListener) -> Subscription:
        """Watch liveliness tokens; see ``Bus.watch_alive``."""
        self.require_open()

        def changed(sample: zenoh.Sample) -> None:
            self.call("", listener, address_of(str(sample.key_expr)), sample.kind == zenoh.SampleKind.PUT)

        def heard(sample: zenoh.Sample) -> None:
            self.push(changed, sample)

        pattern = key(self._mission, address, Conversation.ALIVE)
        at_once = zenoh.handlers.Callback(heard, indirect=False)
        return self._declare(self._session.liveliness().declare_subscriber(pattern, at_once, history=True))

    def watch_link(self, listener: LinkListener) -> Declaration:
        """Report the loss and return of this session's link; see ``Bus.watch_link``.

        The link of a hub is always up.
        """
        self.require_open()
        if self._is_hub:
            always = self._declare(None)

            def tell(_event: None) -> None:
                if always.stands:
                    self.call("", listener, True)

            self.push(tell, None)
            return always

        def changed(event: zenoh.TransportEvent) -> None:
            self.call("", listener, event.kind == zenoh.SampleKind.PUT)

        return self._declare(
            self._session.info.declare_transport_events_listener(lambda event: self.push(changed, event), history=True)
        )

    def take_back(self) -> None:
        """Withdraw all declarations."""
        for declared in tuple(self._declared):
            declared.close()

    def _declare(self, entity: Any, receiver: Receiving | None = None) -> Declaration:
        declared = Declaration(entity, self._declared, receiver)
        self._declared.add(declared)
        return declared
