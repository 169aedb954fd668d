"""The bus of a process that several components share: one session, one ``SharedBus`` for each member.

Neighbors hand each other the object itself, as on the local bus; everybody else is reached over Zenoh.
A member sees no difference, and nothing reaches it by both ways: what it publishes leaves the process
once, for others, and what it asks of a neighbor does not leave the process at all.

A session tells its own tokens unreliably: late echoes of them come back from the hub, and one that falls
here is told as fallen although another process holds it too. So neighbors' tokens are told here, and what
the session says about an address that is or was a neighbor's is taken from the hub's own word.
"""

from __future__ import annotations

import asyncio
from typing import Any

from backbone.bus.interface import Accepted, Answer, Clock, LifeListener, Listener, Reply, Subscription
from backbone.bus.local_bus import LocalNetwork, Neighbor
from backbone.bus.zenoh_bus import ZenohBus, client_config, close_session, open_session
from backbone.keys import Conversation
from backbone.wire import Message


class SharedSession:
    """One session to the hub and the members who speak over it. Open it inside a running event loop.

    Args:
        mission: Name of the mission.
        endpoint: Where the hub listens.
        secret: What it asks its clients for; empty: nothing.

    Raises:
        HubUnreachable: Nobody listens there.
    """

    def __init__(self, mission: str, endpoint: str, secret: str = "") -> None:
        self._session = open_session(client_config(endpoint, secret))
        self._neighbors = LocalNetwork(mission)

    def join(self, source: str, clock: Clock) -> SharedBus:
        """Return a new member's bus. It is closed before the session is."""
        return SharedBus(self._neighbors, source, clock, self._session)

    async def close(self) -> None:
        """Close the session; return when its threads have ended."""
        await close_session(self._session)


class SharedBus(Neighbor, ZenohBus):
    """One member's voice and ears, towards its neighbors and towards other processes."""

    def __init__(self, neighbors: LocalNetwork, source: str, clock: Clock, session: Any) -> None:
        super().__init__(neighbors.mission, source, clock, session, shared=True)
        self.network = neighbors
        self.declared = []

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component, a neighbor without leaving the process; see ``Bus.ask``."""
        if address in self.network.servers:
            return await self.ask_neighbor(address, question, reply, within_s=within_s)
        return await super().ask(address, question, reply, within_s=within_s)

    def serve(self, address: str, accepts: Accepted, answer: Answer) -> Subscription:
        """Answer questions asked of this address; see ``Bus.serve``."""
        elsewhere = super().serve(address, accepts, answer)
        return _Both(self.serve_neighbors(address, accepts, answer), elsewhere)

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Hand the message to whoever subscribed; see ``Bus.publish``."""
        if not self.closed:
            self.tell_neighbors(address, conversation, self.send(address, conversation, message))

    def subscribe(
        self, address: str, conversation: Conversation, accepts: Accepted, listener: Listener, *, latest: bool = False
    ) -> Subscription:
        """Hear publications; see ``Bus.subscribe``."""
        elsewhere = super().subscribe(address, conversation, accepts, listener, latest=latest)
        return _Both(self.hear_neighbors(address, conversation, accepts, listener, latest=latest), elsewhere)

    def declare_alive(self, address: str) -> Subscription:
        """Raise a liveliness token; see ``Bus.declare_alive``."""
        elsewhere = super().declare_alive(address)
        return _Both(elsewhere, self.show_neighbors(address))

    def watch_alive(self, address: str, listener: LifeListener) -> Subscription:
        """Watch liveliness tokens; see ``Bus.watch_alive``."""
        watch = _Watch(self, listener)
        elsewhere = super().watch_alive(address, watch.elsewhere_changed)
        return _Both(_Both(elsewhere, self.watch_neighbors(address, watch.here_changed)), watch)

    def take_back(self) -> None:
        """Take back everything declared, here and elsewhere."""
        self.take_back_from_neighbors()
        super().take_back()


class _Watch:
    """One watch over tokens here and elsewhere, told as one."""

    def __init__(self, bus: SharedBus, listener: LifeListener) -> None:
        self._bus, self._listener = bus, listener
        self._stands: set[str] = set()
        self._checks: dict[str, asyncio.Task[None]] = {}
        self._stale: set[str] = set()

    def here_changed(self, address: str, stands: bool) -> None:
        """Take note that a neighbor's token rose or fell."""
        if not stands:
            self._check(address)
            return
        check = self._checks.pop(address, None)
        if check is not None:  # it fell and rose again before the hub was heard: both are told
            check.cancel()
            self._tell(address, False)
        self._tell(address, True)

    def elsewhere_changed(self, address: str, stands: bool) -> None:
        """Take note of what the session says."""
        if address not in self._bus.network.tokens:
            self._tell(address, stands)
        elif not self._bus.network.tokens[address]:
            self._check(address)

    def close(self) -> None:
        """Tell nothing more."""
        for check in self._checks.values():
            check.cancel()
        self._checks.clear()

    def _check(self, address: str) -> None:
        """Have the hub asked whether the token stands, again if it is just being asked."""
        if address in self._checks:
            self._stale.add(address)
        else:
            self._checks[address] = self._bus.start(self._ask_hub(address))

    async def _ask_hub(self, address: str) -> None:
        stands, is_stale = False, True
        while is_stale:
            self._stale.discard(address)
            stands = await self._bus.stands(address)
            is_stale = address in self._stale
        del self._checks[address]
        self._tell(address, stands)

    def _tell(self, address: str, stands: bool) -> None:
        if stands is (address in self._stands):
            return
        if stands:
            self._stands.add(address)
        else:
            self._stands.discard(address)
        self._bus.call("", self._listener, address, stands)


class _Both:
    """What was declared in two places."""

    def __init__(self, first: Subscription, second: Subscription) -> None:
        self._declared = (first, second)

    def close(self) -> None:
        """Take both back, the first first."""
        for declared in self._declared:
            declared.close()
