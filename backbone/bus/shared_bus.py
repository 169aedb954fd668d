"""The bus of a shared process: one session, one ``SharedBus`` for each member.

Neighbors exchange the objects themselves, as on the local bus; other processes are reached over Zenoh. A member sees no
difference and gets no message twice: a publication leaves the process once, for other processes, and a question to a
neighbor never leaves the process.

A session reports its own tokens unreliably: late echoes of them return from the hub, and a token that ends here is
reported as ended although another process holds it too. So this file reports neighbors' tokens itself, and asks the hub
about an address that is or was a neighbor's. If the session reports a token before the hub's answer, it drops this
answer. So a "no" counts only if the session's last report agrees.
"""

from __future__ import annotations

import asyncio
from collections import Counter
from typing import Any, cast

from backbone.bus.host_boards import boards_for
from backbone.bus.host_copies import copies_for
from backbone.bus.host_lines import lines_for
from backbone.bus.interface import Answer, Clock, LifeListener, Listener, Overhearer, Overhearing, Reply, Subscription
from backbone.bus.local_bus import LocalNetwork, Neighbor
from backbone.bus.zenoh_bus import ZenohBus
from backbone.bus.zenoh_far_copies import FarCopies
from backbone.bus.zenoh_links import Links
from backbone.bus.zenoh_sessions import client_config, close_session, open_session
from backbone.bus.zenoh_subscribers import Subscribers
from backbone.keys import Conversation
from backbone.quality import NEVER_DROPPED
from backbone.wire import Accepts, Envelope, Message

AGAIN_AFTER_S = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0)  # chosen: together as long as a lost link stays unnoticed


class SharedSession:
    """One session to the hub and the members that use it. Open it inside a running event loop.

    Args:
        secret: Secret of the mission; empty: the hub asks for none.
        directory: Folder of the mission's files on this host; empty: none, and no socket or blackboard of this host.

    Raises:
        HubUnreachable: No hub listens at the endpoint.
    """

    def __init__(self, mission: str, endpoint: str, secret: str = "", directory: str = "") -> None:
        self._session = open_session(client_config(endpoint, secret))
        self._links = Links(self._session)
        self._neighbors = LocalNetwork(mission)
        self._copies, self._far = copies_for(directory), cast("FarCopies | None", None)
        self._lines, self._subscribers = lines_for(directory), Subscribers(self._session)
        self._directory, self._members = directory, set[str]()

    def join(self, source: str, clock: Clock) -> SharedBus:
        """Return a new member's bus. Close it before the session."""
        bus = SharedBus(self._neighbors, source, clock, self._session)
        self._far = self._far or FarCopies(self._session, bus.mission, source)
        bus.copies, bus.far, bus.ways.lines, bus.members = self._copies, self._far, self._lines, self._members
        bus.subscribers = self._subscribers
        self._members.add(source)
        bus.boards = boards_for(self._directory, self._members)
        return bus

    async def close(self) -> None:
        """Close the session; return when its threads have ended."""
        self._links.close()
        for sockets in (self._copies, self._far, self._lines):
            if sockets is not None:
                sockets.close()
        await close_session(self._session)


class SharedBus(Neighbor, ZenohBus):
    """One member's bus, to its neighbors and to other processes."""

    def __init__(self, neighbors: LocalNetwork, source: str, clock: Clock, session: Any) -> None:
        super().__init__(neighbors.mission, source, clock, session, shared=True)
        self.network = neighbors
        self.declared = []
        self.members = set[str]()
        """Sources of this process; settable."""

    async def ask(self, address: str, question: Message, reply: type[Reply], *, within_s: float) -> Reply:
        """Ask one component, a neighbor without leaving the process; see ``Bus.ask``."""
        if address in self.network.servers:
            return await self.ask_neighbor(address, question, reply, within_s=within_s)
        return await super().ask(address, question, reply, within_s=within_s)

    def serve(self, address: str, accepts: Accepts, answer: Answer) -> Subscription:
        """Answer questions to this address; see ``Bus.serve``."""
        elsewhere = super().serve(address, accepts, answer)
        return _Both(self.serve_neighbors(address, accepts, answer), elsewhere)

    def publish(self, address: str, conversation: Conversation, message: Message) -> None:
        """Send the message to all subscribers; see ``Bus.publish``."""
        if not self.closed:
            envelope = self.send(address, conversation, message)
            self.publish_to_neighbors(address, conversation, envelope)
            if conversation in NEVER_DROPPED:
                self.tell(address, conversation, envelope)

    def is_unheard(self, conversation: Conversation) -> bool:
        """Return whether certainly neither a neighbor nor another process hears this; see ``Bus.is_unheard``."""
        return not self.is_overheard_by_neighbors(conversation) and super().is_unheard(conversation)

    def pass_on(self, address: str, conversation: Conversation, envelope: Envelope[Message]) -> None:
        """Send a message of another sender, to neighbors too; see ``Bus.pass_on``."""
        super().pass_on(address, conversation, envelope)
        self.publish_to_neighbors(address, conversation, envelope)

    def subscribe(
        self,
        address: str,
        conversation: Conversation,
        accepts: Accepts,
        listener: Listener,
        *,
        latest: bool = False,
        lossless: bool = False,
    ) -> Subscription:
        """Subscribe to publications; see ``Bus.subscribe``."""
        elsewhere = super().subscribe(address, conversation, accepts, listener, latest=latest, lossless=lossless)
        latest = latest and not lossless
        return _Both(self.subscribe_to_neighbors(address, conversation, accepts, listener, latest=latest), elsewhere)

    def dropped(self) -> dict[str, int]:
        """Return the messages that listeners did not get, by key; see ``Bus.dropped``."""
        return dict(Counter(Neighbor.dropped(self)) + Counter(ZenohBus.dropped(self)))

    def is_overheard(self, conversation: Conversation) -> bool:
        """Return whether a component, here or in another process, hears this conversation at this bus's own address."""
        return self.is_overheard_by_neighbors(conversation) or super().is_overheard(conversation)

    def overhear(
        self,
        conversation: Conversation,
        listener: Overhearer,
        most_waiting_bytes: int,
        of: str = "",
        *,
        lossless: bool = False,
    ) -> Overhearing:
        """Subscribe to a conversation of all components, neighbors too; see ``Bus.overhear``."""
        elsewhere = super().overhear(conversation, listener, most_waiting_bytes, of, lossless=lossless)
        here = self.overhear_neighbors(conversation, listener, most_waiting_bytes, of, lossless=lossless)
        return _BothHeard(elsewhere, here)

    def declare_alive(self, address: str) -> Subscription:
        """Declare a liveliness token; see ``Bus.declare_alive``."""
        elsewhere = super().declare_alive(address)
        return _Both(elsewhere, self.declare_to_neighbors(address))

    def watch_alive(self, address: str, listener: LifeListener) -> Subscription:
        """Watch liveliness tokens; see ``Bus.watch_alive``."""
        watch = _Watch(self, self._clock, listener)
        elsewhere = super().watch_alive(address, watch.elsewhere_changed)
        return _Both(_Both(elsewhere, self.watch_neighbors(address, watch.here_changed)), watch)

    def take_back(self) -> None:
        """Withdraw all declarations, in this process and on the session."""
        self.take_back_from_neighbors()
        super().take_back()

    async def leave(self) -> None:
        """Leave the session, which other members use."""
        self.members.discard(self.source)
        await super().leave()


class _Watch:
    """One watch over tokens of neighbors and of other processes."""

    def __init__(self, bus: SharedBus, clock: Clock, listener: LifeListener) -> None:
        self._bus, self._clock, self._listener = bus, clock, listener
        self._stands: set[str] = set()
        self._reported: set[str] = set()
        self._checks: dict[str, asyncio.Task[None]] = {}
        self._stale: set[str] = set()

    def here_changed(self, address: str, stands: bool) -> None:
        """Record that a neighbor's token began or ended."""
        if not stands:
            self._check(address)
            return
        check = self._checks.pop(address, None)
        if check is not None:  # it ended and came back before the hub answered: report both
            check.cancel()
            self._notify(address, False)
        self._notify(address, True)

    def elsewhere_changed(self, address: str, stands: bool) -> None:
        """Record a report of the session."""
        (self._reported.add if stands else self._reported.discard)(address)
        if address not in self._bus.network.tokens:
            self._notify(address, stands)
        elif not self._bus.network.tokens[address]:
            self._check(address)

    def close(self) -> None:
        """Stop calling the listener."""
        for check in self._checks.values():
            check.cancel()
        self._checks.clear()

    def _check(self, address: str) -> None:
        """Ask the hub whether the token exists; if a question is open, ask again after it."""
        if address in self._checks:
            self._stale.add(address)
        else:
            self._checks[address] = self._bus.start(self._ask_hub(address))

    async def _ask_hub(self, address: str) -> None:
        pauses_s = iter(AGAIN_AFTER_S)
        while True:
            self._stale.discard(address)
            stands = await self._bus.stands(address)
            if address in self._stale:
                continue
            if stands or address not in self._reported or (pause_s := next(pauses_s, None)) is None:
                break
            await self._clock.sleep_s(pause_s)
        del self._checks[address]
        self._notify(address, stands)

    def _notify(self, address: str, stands: bool) -> None:
        if stands is (address in self._stands):
            return
        if stands:
            self._stands.add(address)
        else:
            self._stands.discard(address)
        self._bus.call("", self._listener, address, stands)


class _Both:
    """Two declarations that close together."""

    def __init__(self, first: Subscription, second: Subscription) -> None:
        self._declared = (first, second)

    def close(self) -> None:
        """Withdraw both, in order."""
        for declared in self._declared:
            declared.close()


class _BothHeard(_Both):
    """Two subscriptions to whole conversations."""

    def __init__(self, first: Overhearing, second: Overhearing) -> None:
        super().__init__(first, second)
        self._heard = (first, second)

    @property
    def dropped(self) -> int:
        return sum(heard.dropped for heard in self._heard)
